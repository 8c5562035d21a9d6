"""Scripts of live pages."""
