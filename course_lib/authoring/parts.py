"""The parts of a notebook: what stands under each heading of the second level, and which of them are its core."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from nbformat import NotebookNode

END = "To the lab"  # the last part of a lesson's core

_FENCE = re.compile(r"```.*?```", re.S)


@dataclass
class Part:
    """What stands under one heading of the second level; the part before the first has the title's heading."""

    heading: str
    prose: str = ""
    code: list[NotebookNode] = field(default_factory=list)

    @property
    def number(self) -> int | None:
        """The number of a section, "## 2 Depth is z"; None for the parts of the frame."""
        match = re.match(r"(\d+)\s", self.heading)
        return int(match[1]) if match else None

    @property
    def figures(self) -> int:
        """Pictures that are stored or linked here."""
        outputs = [output.get("data", {}) for cell in self.code for output in cell.outputs]
        stored = sum(any(kind.startswith("image/") for kind in data) for data in outputs)
        return stored + len(re.findall(r"!\[[^\]]*\]\(|<img\b", _FENCE.sub("", self.prose)))


def parts_of(nb: NotebookNode) -> list[Part]:
    """Cut a notebook at its headings of the first and second level."""
    parts = [Part("")]
    for cell in nb.cells:
        if cell.cell_type == "code":
            parts[-1].code.append(cell)
        if cell.cell_type != "markdown":
            continue
        fenced = False
        for line in cell.source.splitlines():
            fenced ^= line.lstrip().startswith("```")
            heading = None if fenced else re.match(r"(#{1,2})\s+(.+?)\s*$", line)
            if heading and (heading[1] == "##" or not parts[-1].heading):
                parts.append(Part(heading[2] if heading[1] == "##" else f"# {heading[2]}"))
            else:
                parts[-1].prose += line + "\n"
        parts[-1].prose += "\n"
    return parts if parts[0].prose.strip() or parts[0].code else parts[1:]


def core_of(parts: list[Part]) -> list[Part]:
    """The parts from the title to "To the lab", that one included."""
    names = [part.heading for part in parts]
    return parts[: names.index(END) + 1] if END in names else parts
