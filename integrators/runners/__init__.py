"""The loop as run by others: Python, machine code, SciPy's solvers, co-simulation."""
