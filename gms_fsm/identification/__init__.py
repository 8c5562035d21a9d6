"""Identification: parameters from records, with intervals, and what a record cannot tell."""
