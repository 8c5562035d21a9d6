"""Where states, labels and lines of a chart are: in layers, in a ring, or where they were put."""
