"""Lessons about the GMS model: what its elements do, and how runs go wrong."""
