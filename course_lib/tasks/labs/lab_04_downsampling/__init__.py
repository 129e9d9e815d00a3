"""Lab 04: voxel grids, normals and sampling."""
