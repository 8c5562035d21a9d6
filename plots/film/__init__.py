"""The parts of a film: its pace, chart, bristles, picture and files (see `plots.animation`)."""
