"""Systems with all their texts read, and what follows from their numbers."""
