"""A program from its plan to its text."""
