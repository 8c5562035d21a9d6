"""Identification: parameters from measured records, with intervals, and what a record cannot tell."""
