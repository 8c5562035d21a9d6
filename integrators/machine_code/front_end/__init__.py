"""From plain Python functions to the typed program."""
