"""Models with a deflection z: a spring that sticks, yields or slips."""
