"""What pictures show of a run: a window in time, the plane of an element's guards."""
