"""Panels of instants with several transitions."""
