"""Charts as files: TOML, SCXML, machines of the package `transitions`."""
