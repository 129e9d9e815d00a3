"""Registration: the rigid motion that lays one cloud onto another, its correspondences, weights against outliers."""
