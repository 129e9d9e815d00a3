"""Surfaces: triangle meshes, and how far points lie from a true surface."""
