"""The files of traces: NumPy archives, text, and the header that both contain."""
