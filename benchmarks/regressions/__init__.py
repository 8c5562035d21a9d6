"""Times that asv compares between commits; the cases are those of compare.py."""
