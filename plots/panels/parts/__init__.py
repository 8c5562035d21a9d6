"""Parts of panels: axes, titles, the window and the rows that are drawn."""
