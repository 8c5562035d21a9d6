"""What moves, what rubs, what drives: models, rigs and input signals, as data."""
