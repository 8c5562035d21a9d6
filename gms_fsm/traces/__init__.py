"""The results of a run: rows, transition log, files and monitor verdicts."""
