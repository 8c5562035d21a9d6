"""Stepping through a run: stop at a guard, see why, go back, change a value, compare."""
