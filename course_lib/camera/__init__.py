"""Cameras that see colour and depth: the pinhole model, its presets, distortion, encodings of depth, RGB-D frames."""
