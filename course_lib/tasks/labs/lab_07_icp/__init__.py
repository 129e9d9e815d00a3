"""Lab 07: rigid motions from pairs, steps of ICP, and partial overlap."""
