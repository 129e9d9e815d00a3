"""The library against professional tools, how time grows, what a lesson costs, the grader against another."""
