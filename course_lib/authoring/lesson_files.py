"""The files that docs/add_a_lesson.md asks of every lesson: that none is forgotten where nothing else would miss it."""

from __future__ import annotations

from collections.abc import Iterable

from course_lib.notebook.lessons import lessons

from .tree import Tree

WANTED = {
    "notebooks/source/{}.toml": "its title, what one can do after it, and minutes",
    "notebooks/source/{}.py": "the lesson",
    "solutions/source/{}.py": "its lab, with the answers",
    "solutions/notes/{}.md": "its section for instructors",
}


def lacking(tree: Tree, names: Iterable[str] = ()) -> list[str]:
    """One line for each file that a lesson or a dataset lacks, or that says too little.

    Parameters
    ----------
    names : of lessons, as `Tree.find` takes them; none means all.
    """
    found = []
    known = {lesson.name: lesson for lesson in lessons(tree.lessons_folder / "source")}
    for name in dict.fromkeys(source.name for source in tree.find(names)):
        wanted = {place.format(name): what for place, what in WANTED.items()}
        found += [f"{place} is missing: {what}" for place, what in wanted.items() if not (tree.root / place).is_file()]
        if name in known and not (known[name].does and known[name].minutes and known[name].lab_minutes):
            found.append(f"notebooks/source/{name}.toml: a lesson that is there has does, minutes and lab_minutes")
    for entry in sorted((tree.root / "datasets").glob("*.toml")):
        if not entry.with_suffix(".md").is_file():
            found.append(f"{tree.relative(entry.with_suffix('.md'))} is missing: the card of this dataset")
    return found
