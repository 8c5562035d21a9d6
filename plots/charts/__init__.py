"""State charts as pictures, and the parts they are made of."""
