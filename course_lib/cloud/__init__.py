"""Point clouds: their types and messages, neighbours, downsampling, normals, outliers, clusters, planes and floors."""
