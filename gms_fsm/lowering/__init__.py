"""A model on a rig becomes a program: functions printed as Python text.

They run as they are, or as machine code.
"""
