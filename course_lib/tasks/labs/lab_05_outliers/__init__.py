"""Lab 05: statistical and radius removal, clusters, and a desk to clean."""
