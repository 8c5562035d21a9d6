"""Systems as files and as tables of headers."""
