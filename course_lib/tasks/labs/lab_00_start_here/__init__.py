"""Lab 00: one line, to rehearse handing in."""
