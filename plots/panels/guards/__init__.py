"""Panels of one element's guards: regions, flow, path, and the race to fire."""
