"""Friction in the loops of other programs: SciPy, PathSim, python-control, MuJoCo, gymnasium."""
