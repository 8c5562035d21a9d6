"""What a run records while it goes: rows, events, the moment that callbacks see."""
