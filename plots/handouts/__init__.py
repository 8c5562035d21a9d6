"""A model on one page."""
