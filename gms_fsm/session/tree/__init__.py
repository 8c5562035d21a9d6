"""The branches of a session: computed row by row, walked, poked, exported."""
