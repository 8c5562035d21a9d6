"""Texts with holes: `string.Template` fills them, and `str.format` those of MATLAB."""
