"""Lowering of a model on a rig to a program: functions printed as Python text.

They run as Python or are compiled to machine code.
"""
