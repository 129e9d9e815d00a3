"""The verbs of the command line: what they do, and where each stands once there is an environment."""

from typing import NamedTuple

from .messages import EXITS


class Verb(NamedTuple):
    """One verb: its arguments, a line of help, and its click command as "module below course_lib:name"."""

    arguments: str
    line: str
    place: str


VERBS = {
    "start": Verb(
        "[LESSON] [--no-browser] [--port N] [--stop]",
        "Open JupyterLab on the course, labs as your own copies.",
        "launch.start:command",
    ),
    "test": Verb(
        "[--quick | --thorough] [--workers N]",
        "Prove the library, the tools and every notebook.",
        "authoring.verbs:test",
    ),
    "build": Verb(
        "[NAME ...] [--check] [--lessons | --labs]",
        "Turn sources into executed notebooks.",
        "authoring.verbs:build",
    ),
    "bench": Verb(
        "[--notebooks] [--only WORD] [--write]",
        "Measure speed against the professional tools.",
        "bench.verbs:bench",
    ),
    "data": Verb("list | get NAME", "List and fetch datasets.", "launch.data_verbs:data_group"),
    "reset": Verb("LAB [--lesson]", "Make a fresh copy of a lab, overwriting nothing.", "launch.reset:command"),
    "release": Verb(
        "LAB ... --out FOLDER [--hints 0..3]",
        "Make what students get of a lab: a folder and a zip.",
        "grading.verbs.release:release",
    ),
    "grade": Verb(
        "FOLDER --out FOLDER [--lab NAME] [--roster FILE]",
        "Grade a folder of submitted notebooks.",
        "grading.verbs.grade:grade",
    ),
    "regrade": Verb(
        "[LAB ...] [--dry-run] [--never-lower]",
        "After a judge was mended: whose grade changes, and why.",
        "grading.verbs.people:regrade",
    ),
    "adjust": Verb(
        "STUDENT LAB TASK --points N --by WHO --reason WHY",
        "Change a task's points by hand, with a reason.",
        "grading.verbs.people:adjust",
    ),
    "marks": Verb("out LAB | in FILE", "Hand-marked tasks: a rubric as CSV, out and in.", "grading.verbs.people:marks"),
    "feedback": Verb(
        "[--lab LAB] [--student ID]", "Write an HTML page for each student.", "grading.verbs.tell:feedback"
    ),
    "export": Verb(
        "--format canvas|moodle|csv --out FILE",
        "Write grades for Canvas, Moodle or a spreadsheet.",
        "grading.verbs.tell:export",
    ),
    "class-report": Verb(
        "--out FILE [--lab LAB]",
        "Write a page that shows how the class did.",
        "grading.verbs.tell:class_report",
    ),
    "explain": Verb("STUDENT LAB TASK", "Say how a grade came to be, step by step.", "grading.verbs.people:explain"),
    "viva": Verb(
        "STUDENT LAB [--answers]", "Questions to a student about their own code.", "grading.verbs.release:viva"
    ),
    "forget": Verb("STUDENT", "Erase a student from the ledger.", "grading.verbs.people:forget"),
    "doctor": Verb("[--csv]", "Say what works here, and how to mend the rest.", "launch.doctor:command"),
}
GRADING = ("test", "bench", "grade", "regrade")  # verbs that run submitted notebooks, in bubblewrap


def help_text(verb: str = "") -> str:
    """What `--help` prints before the environment is there."""
    if verb:
        return f"Usage: python3 course.py {verb} {VERBS[verb].arguments}\n\n  {VERBS[verb].line}\n"
    lines = "Usage: python3 course.py VERB [...]\n\nA course on 3D reconstruction. Two commands do all the set-up:\n\n"
    lines += "  python3 course.py start    open the course\n  python3 course.py test     prove it\n\nVerbs:\n"
    lines += "".join(f"  {name:<14}{verb.line}\n" for name, verb in VERBS.items())
    lines += "\n`python3 course.py VERB --help` explains a verb.\n\n"
    lines += "Exit codes of the launcher itself (a verb's own codes are passed on, and lie below 10):\n\n"
    return lines + "".join(f"{code:>4}  {meaning}\n" for code, meaning in EXITS.values())
