"""Scripts of the replay page."""
