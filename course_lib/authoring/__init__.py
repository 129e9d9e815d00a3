"""From reviewed sources to executed notebooks, and the proof that sources, notebooks and numbers agree."""
