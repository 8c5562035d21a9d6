"""From a program to a trace: machines, the run and its files, sweeps."""
