"""Templates of JavaScript."""
