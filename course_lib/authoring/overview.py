"""The README's picture, from pictures that lesson 00 stores: `python -m course_lib.authoring.overview`."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOK = "notebooks/00_start_here.ipynb"
PICTURE = "docs/images/overview.png"
CHOSEN = (0, 2)  # of the lesson's pictures: the frame, and the mesh coloured by its error
WIDTH = 1000


def pictures(notebook: Path) -> list[Image.Image]:
    """The stored PNG pictures of a notebook, in order."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    stored = [output["data"]["image/png"] for cell in cells for output in cell.get("outputs", [])
              if "image/png" in output.get("data", {})]  # fmt: skip
    return [Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB") for png in stored]


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
