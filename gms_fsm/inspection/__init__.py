"""Looking into charts and runs: explanations, notes, proofs, step-by-step sessions."""
