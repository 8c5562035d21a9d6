"""Derivatives of a run by its numbers and initial values, through every switch."""
