"""Lessons about choosing, fitting and combining friction models."""
