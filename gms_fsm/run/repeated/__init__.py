"""Runs that are repeated with other numbers, in one block of memory."""
