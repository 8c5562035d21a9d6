"""C99 for people: what can happen at one start, under the names of the records."""
