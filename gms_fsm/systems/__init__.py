"""Friction models, rigs and input signals, as data."""
