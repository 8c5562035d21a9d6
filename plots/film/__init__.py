"""Films, and their parts: pace, chart, bristles, picture and files."""
