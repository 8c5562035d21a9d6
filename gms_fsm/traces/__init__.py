"""What a run leaves behind: rows, transition log, files, verdicts of its monitors."""
