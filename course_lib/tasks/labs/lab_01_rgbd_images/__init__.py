"""Lab 01: depth images, their encodings, resizing, and flying pixels."""
