"""The lab as students get it, and their answers put back into it: release, hiding, private tasks, rebuilding."""
