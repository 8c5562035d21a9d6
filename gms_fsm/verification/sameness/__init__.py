"""Whether two charts do the same: their states and names matched, their texts compared."""
