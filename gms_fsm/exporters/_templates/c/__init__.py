"""Templates of C99."""
