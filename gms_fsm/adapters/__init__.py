"""Friction in other people's simulators; each module is named after the library it serves."""
