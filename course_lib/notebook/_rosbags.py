"""The two formats of RealSense recordings, read by rosbags: what they say of the cameras, and their images.

.bag (ROS 1) is what librealsense wrote before 2.57, .db3 (ROS 2) what it has written since. What is not read:
recordings of ROS's own camera nodes, whose topics have other names; encrypted bags; colour that is not RGB or BGR.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from course_lib.notebook._bag_common import printable
from course_lib.notebook._bag_ros1 import Ros1
from course_lib.notebook._bag_ros2 import Ros2
from course_lib.notebook._errors import Refusal, shown

ROS1_MAGIC, SQLITE_MAGIC = b"#ROSBAG V2.0\n", b"SQLite format 3\0"


@contextmanager
def opened(path: Path) -> Iterator[Ros1 | Ros2]:
    """Open a recording; whatever its bytes do to the reader of its format becomes one sentence.

    Raises
    ------
    Refusal
        If it is missing, empty, of another format, cut short, never closed, or spoiled inside.
    """
    if not path.is_file():
        raise Refusal(f"There is no recording {shown(path)}: check the name and the folder.")
    check, kind = (_check_ros1, Ros1) if path.suffix.lower() == ".bag" else (_check_ros2, Ros2)
    check(path)
    try:
        recording = kind(path)
        try:
            yield recording
        finally:
            recording.reader.close()
    except (Refusal, OSError):
        raise
    except MemoryError as error:
        raise Refusal(f"{shown(path)} asks for more memory than there is: copy it again, or give most=.") from error
    except Exception as error:
        why = printable(str(error)).rstrip(". ") or type(error).__name__
        raise Refusal(f"{shown(path)} is damaged inside ({why}): copy it again.") from error


def _check_ros1(path: Path) -> None:
    """Prove that a file is a whole bag, and say what else it is."""
    with open(path, "rb") as file:
        content = file.read(4096)
    if not content.startswith(ROS1_MAGIC):
        what = "is empty" if not content else "is not a ROS 1 bag"
        raise Refusal(f"{shown(path)} {what}: record it again.")
    at = content.find(b"index_pos=")
    index = int.from_bytes(content[at + 10 : at + 18], "little") if at >= 0 else 0
    if index == 0:
        raise Refusal(f"{shown(path)} was never closed (it has no index): mend it with rosbag reindex or record again.")
    if index >= path.stat().st_size:
        raise Refusal(f"{shown(path)} is cut short: its index lies behind its end; copy it again.")


def _check_ros2(path: Path) -> None:
    with open(path, "rb") as file:
        content = file.read(len(SQLITE_MAGIC))
    if content != SQLITE_MAGIC:
        what = "is empty" if not content else "is not a ROS 2 recording"
        raise Refusal(f"{shown(path)} {what}: record it again.")
