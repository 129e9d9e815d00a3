"""The commands of the grader, from release to export."""
