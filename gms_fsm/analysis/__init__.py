"""What follows from the derivatives of runs: limit cycles."""
