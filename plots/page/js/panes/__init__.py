"""The panes of the replay page, one script each."""
