"""A fit as a least-squares problem, and the search for its minimum."""
