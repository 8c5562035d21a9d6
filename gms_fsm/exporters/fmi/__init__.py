"""The parts of an FMU: archive, C sources, variables."""
