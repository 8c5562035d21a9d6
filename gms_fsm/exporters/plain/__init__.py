"""The paper's plain form as statements, which each language prints in its own way."""
