"""Linear answers about systems with friction: state space at a time, describing functions."""
