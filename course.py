#!/usr/bin/env python3
"""Set up the course and run it: `python3 course.py start` and `python3 course.py test` need no other step.

The first run finds uv (or installs it privately into .uv/), installs exactly what uv.lock says into .venv/, and checks
the Linux libraries that Open3D and VTK need before anything imports them. Later runs do none of that and need no
network. Every verb is then handed on to `course_lib.cli` in .venv.

What is done before there is an environment stands in course_lib/launch/bootstrap/. This file is read by any Python, so
that one which is too old for the course is told so in a sentence.
"""

import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))


def main():
    """Hand on to the launcher, where this Python can read it."""
    if sys.version_info < (3, 8):
        sys.stderr.write(
            "course: This is Python %d.%d; the course needs CPython 3.11 to 3.14, 64 bits. Name a newer one:\n"
            "    python3.11 %s\n" % (sys.version_info[0], sys.version_info[1], " ".join(sys.argv))
        )
        return 10
    if not os.path.isdir(os.path.join(HERE, "course_lib", "launch", "bootstrap")):
        sys.stderr.write("course: course_lib is missing from this copy of the course: get the whole of it again.\n")
        return 16
    sys.path.insert(0, HERE)
    from course_lib.launch.bootstrap import command

    return command.main(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
