"""Where edges of a chart can be taken: points on the surfaces of guards, and proofs of nowhere."""
