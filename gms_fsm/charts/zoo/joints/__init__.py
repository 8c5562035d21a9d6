"""Gaps, stops and clutches."""
