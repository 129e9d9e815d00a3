"""Rigid motion: transforms of points between frames (`T_to_from`); rotations as vectors, matrices and quaternions."""
