"""The parts of a replay page: what Python stores in it, its charts, style and scripts."""
