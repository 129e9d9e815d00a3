"""Virtual worlds and sensors with truth: scenes, ray-cast colour and depth, sensor noise, paths and dataset recipes."""
