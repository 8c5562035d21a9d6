"""Running a program to obtain a trace: machines, runs and their files, sweeps."""
