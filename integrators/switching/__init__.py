"""What switches at a stop: machines, jolts, start and end of sliding."""
