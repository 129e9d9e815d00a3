"""Whether two stored outputs say the same, so that a rebuild changes only what changed."""

from __future__ import annotations

import base64
import binascii
import io

import numpy as np
from nbformat import NotebookNode
from numpy.typing import NDArray
from PIL import Image, ImageFilter, UnidentifiedImageError

MEAN_DIFFERENCE = 1.0  # of 255: the noise of another renderer, not another picture
STRONG_DIFFERENCE = 64  # of 255: a pixel that anybody would call changed
STRONG_SHARE = 0.002
ROUNDED = 2  # pixels


def decode_png(text: str) -> NDArray[np.uint8]:
    """Decode a base64 picture.

    Returns
    -------
    (H, W, 3) uint8, RGB; what is transparent becomes white.

    Raises
    ------
    ValueError
        If it is not a picture.
    """
    try:
        with Image.open(io.BytesIO(base64.b64decode(text))) as image:
            rgba = image.convert("RGBA")
    except (UnidentifiedImageError, binascii.Error, OSError) as error:
        raise ValueError("the stored picture cannot be decoded: build the notebook again.") from error
    white = Image.new("RGBA", rgba.size, "white")
    return np.asarray(Image.alpha_composite(white, rgba).convert("RGB"))


def same_picture(old: str, new: str) -> bool:
    """Whether two base64 PNGs look the same: small mean difference, hardly any pixel changed strongly.

    Sizes may differ by ROUNDED pixels: a figure that is cut to its contents comes out so on another processor.
    """
    if old == new:
        return True
    try:
        a, b = decode_png(old), decode_png(new)
    except ValueError:
        return False
    if np.abs(np.subtract(a.shape, b.shape)).max() > ROUNDED:
        return False
    if a.shape != b.shape:
        size = a.shape[1], a.shape[0]
        a, b = (np.asarray(Image.fromarray(one).resize(size).filter(ImageFilter.BoxBlur(1))) for one in (a, b))
    difference = np.abs(a.astype(np.int16) - b)
    strong = (difference.max(axis=2) > STRONG_DIFFERENCE).mean()
    return bool(difference.mean() <= MEAN_DIFFERENCE and strong <= STRONG_SHARE)


def same_output(old: NotebookNode, new: NotebookNode) -> bool:
    """Whether two outputs say the same, pictures compared by eye and the rest exactly."""
    if old.output_type != new.output_type:
        return False
    if old.output_type not in ("execute_result", "display_data"):
        return old == new
    if old.data.keys() != new.data.keys() or old.metadata != new.metadata:
        return False
    return all(
        same_picture(old.data[key], new.data[key]) if key == "image/png" else old.data[key] == new.data[key]
        for key in new.data
    )


def keep_unchanged(old: NotebookNode, new: NotebookNode) -> None:
    """Give cells of `new` the stored outputs of `old` wherever they say the same.

    Cells are matched by id. Execution counts are those of `new`.
    """
    stored = {cell.id: cell for cell in old.cells if cell.cell_type == "code" and "id" in cell}
    for cell in new.cells:
        before = stored.get(cell.id)
        if cell.cell_type != "code" or before is None or len(before.outputs) != len(cell.outputs):
            continue
        for a, b in zip(before.outputs, cell.outputs, strict=True):
            if same_output(a, b):
                b.update({key: value for key, value in a.items() if key != "execution_count"})
