"""Templates of FMUs."""
