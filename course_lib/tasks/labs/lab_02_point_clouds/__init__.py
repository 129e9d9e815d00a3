"""Lab 02: cells and messages of point clouds, frames, and packing."""
