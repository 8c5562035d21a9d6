"""The engine of lessons: text, notebook, predictions."""
