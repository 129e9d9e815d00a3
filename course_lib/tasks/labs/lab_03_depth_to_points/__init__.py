"""Lab 03: focal lengths, deprojection, and which mistake made a cloud."""
