"""Models and phenomena: what each friction model shows on the same bench, as measured numbers."""
