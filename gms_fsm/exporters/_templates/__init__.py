"""Texts with holes, which `string.Template` fills."""
