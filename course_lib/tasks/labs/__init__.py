"""One folder a lab: what it asks and how it is judged (tasks), its registered wrong answers (mistakes), its scenes."""
