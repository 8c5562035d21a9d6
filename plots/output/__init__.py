"""What pictures become: SVG, files, cells of notebooks, texts of other tools."""
