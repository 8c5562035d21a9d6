"""Models without an elastic bristle: stick, slip and the force between."""
