"""DejaVu Sans and DejaVu Sans Mono 2.37, as published; LICENSE has their terms."""
