"""One picture that holds all pictures of a scene at full, half, quarter … size, to look colours up without flicker."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

LEVELS = 9
_WIDTH = 4096


class Atlas:
    """Pictures (h, w, 3) uint8 packed side by side, with their smaller versions (a mip map)."""

    def __init__(self, pictures: Sequence[np.ndarray]) -> None:
        chains = [_halvings(picture) for picture in pictures]
        places = [(level.shape[0], number, step) for number, c in enumerate(chains) for step, level in enumerate(c)]
        self.offset = np.zeros((len(chains), LEVELS, 2), np.float32)
        self.size = np.ones((len(chains), LEVELS, 2), np.float32)
        x = y = shelf = 0
        for height, number, step in sorted(places, key=lambda place: (-place[0], place[1], place[2])):
            width = chains[number][step].shape[1]
            if x + width > _WIDTH:
                x, y, shelf = 0, y + shelf, 0
            self.offset[number, step], self.size[number, step] = (x, y), (width, height)
            x, shelf = x + width, max(shelf, height)
        self.picture = np.zeros((y + shelf, _WIDTH, 3), np.uint8)
        for number, chain in enumerate(chains):
            for step in range(LEVELS):
                level = chain[min(step, len(chain) - 1)]
                if step >= len(chain):
                    self.offset[number, step] = self.offset[number, len(chain) - 1]
                    self.size[number, step] = self.size[number, len(chain) - 1]
                else:
                    left, top = self.offset[number, step].astype(int)
                    self.picture[top : top + level.shape[0], left : left + level.shape[1]] = level
        self._place = np.concatenate([self.offset, self.size], -1).reshape(-1, 4)

    def look_up(self, number: np.ndarray, uv: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Colours of points of pictures.

        Parameters
        ----------
        number : (N,) which picture.
        uv : (N, 2) where in it, 0 to 1 from its left top corner.
        level : (N,) how often it was halved, 0 for not at all; between two sizes the colours are mixed.

        Returns
        -------
        (N, 3) float32, 0 to 255.
        """
        level = np.clip(level, 0, LEVELS - 1)
        below = np.minimum(level.astype(np.int32), LEVELS - 2)
        rest = (level - below).astype(np.float32)[:, None]
        entry = number.astype(np.int32) * LEVELS + below
        sharp, blurred = self._at(entry, uv), self._at(entry + 1, uv)
        return sharp + rest * (blurred - sharp)

    def _at(self, entry: np.ndarray, uv: np.ndarray) -> np.ndarray:
        columns = 1024  # cv2.remap wants its answer in the form of a picture
        rows = max(1, -(-len(entry) // columns))
        spot = np.zeros((rows * columns, 2), np.float32)
        place = self._place[entry]
        size, inside = place[:, 2:], spot[: len(entry)]
        np.multiply(uv, size, out=inside)
        inside -= 0.5
        np.clip(inside, 0, size - 1, out=inside)
        inside += place[:, :2]
        found = cv2.remap(self.picture, spot.reshape(rows, columns, 2), None, cv2.INTER_LINEAR)
        return found.reshape(-1, 3)[: len(entry)].astype(np.float32)


def _halvings(picture: np.ndarray) -> list[np.ndarray]:
    chain = [picture]
    while len(chain) < LEVELS and max(chain[-1].shape[:2]) > 1:
        height, width = chain[-1].shape[:2]
        chain.append(cv2.resize(chain[-1], (max(1, width // 2), max(1, height // 2)), interpolation=cv2.INTER_AREA))
    return chain
