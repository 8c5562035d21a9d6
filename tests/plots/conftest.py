"""Which modules of this folder pytest does not search for doctests."""

# They skip where there is no browser. Collected as modules of doctests, they would stay imported in
# part, and the tests that import them would fail instead of being skipped.
collect_ignore = ["browser.py", "printed.py", "widget_host.py"]
