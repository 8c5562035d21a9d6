"""What knows nothing of friction: arguments, files, extras, tables, displays."""
