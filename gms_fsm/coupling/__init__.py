"""Friction in somebody's own loop: stepping, banks, equations with events."""
