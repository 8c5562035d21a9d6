"""Systems that are advanced sample by sample: their memory, and what advances it."""
