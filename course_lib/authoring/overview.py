"""The README's picture, from pictures that lesson 00 stores: `python -m course_lib.authoring.overview`."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from .notebooks import read_notebook
from .outputs import decode_png

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOK = "notebooks/00_start_here.ipynb"
PICTURE = "docs/images/overview.png"
CHOSEN = (0, 2)  # of the lesson's pictures: the frame, and the mesh coloured by its error
WIDTH = 1000


def pictures(notebook: Path) -> list[Image.Image]:
    """The stored PNG pictures of a notebook, in order."""
    data = [output.get("data", {}) for cell in read_notebook(notebook).cells for output in cell.get("outputs", [])]
    return [Image.fromarray(decode_png(one["image/png"])) for one in data if "image/png" in one]


def overview(notebook: Path) -> Image.Image:
    """The chosen pictures, one below the other, on white."""
    chosen = [pictures(notebook)[index] for index in CHOSEN]
    sheet = Image.new("RGB", (WIDTH, sum(image.height for image in chosen)), "white")
    top = 0
    for image in chosen:
        sheet.paste(image, ((WIDTH - image.width) // 2, top))
        top += image.height
    return sheet.quantize(256)


if __name__ == "__main__":
    (ROOT / PICTURE).parent.mkdir(parents=True, exist_ok=True)
    overview(ROOT / NOTEBOOK).save(ROOT / PICTURE, optimize=True)
