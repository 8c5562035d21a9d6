"""One module for each format; all of them are found here."""
