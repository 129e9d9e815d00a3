"""Lab 06: planes, floors and what stands on them."""
