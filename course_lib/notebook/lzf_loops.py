"""The loop that unpacks LZF: bytes as they stand, and pieces of what was unpacked before.

References
----------
Marc Lehmann, LibLZF, lzf_d.c: the format of the block in a compressed PCD.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from course_lib.compiled import compiled

Bytes = NDArray[np.uint8]


@compiled("int64(Array(uint8, 1, 'C', True), uint8[::1])")
def unpack(packed: Bytes, out: Bytes) -> int:
    """Unpack into `out`; how many bytes were written, or -1 where the block is damaged."""
    at = written = 0
    while at < len(packed):
        control = int(packed[at])
        at += 1
        if control < 32:  # so many bytes and one more, as they stand
            length = control + 1
            if at + length > len(packed) or written + length > len(out):
                return -1
            for i in range(length):
                out[written + i] = packed[at + i]
            at += length
        else:  # a piece of what was written: its length, and how far back
            length = control >> 5
            if length == 7:
                if at >= len(packed):
                    return -1
                length += int(packed[at])
                at += 1
            if at >= len(packed):
                return -1
            back = written - ((control & 31) << 8) - int(packed[at]) - 1
            at += 1
            length += 2
            if back < 0 or written + length > len(out):
                return -1
            for i in range(length):
                out[written + i] = out[back + i]
        written += length
    return written
