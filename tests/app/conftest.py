"""Which modules of this folder pytest does not search for doctests."""

collect_ignore = ["full_screen.py"]  # needs Textual, which its tests look for before they import it
