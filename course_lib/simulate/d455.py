"""What a RealSense D455 makes of a true depth image.

The D455 compares two infrared images, so its errors live in disparity, d = f B / z, not in depth. An error of σ_d
pixels is one of z² σ_d / (f B) in depth: four times as large at twice the distance. At the edges of things one imager
sees what the other does not: holes beside near things, and pixels that fly between two depths.

References
----------
Intel RealSense Product Family D400 Series, data sheet 337029; Keselman et al., "Intel RealSense stereoscopic depth
cameras", CVPR workshops 2017; Grunnet-Jepsen et al., "Best-known-methods for tuning Intel RealSense D400".
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from course_lib.camera.pinhole import PinholeCamera
from course_lib.checks import check_depth

BASELINE = 0.095  # metres between the imagers of a D455
DISPARITIES = 126  # pixels that the matcher searches: nothing nearer than f B / 126 is measured
SIGMA = 0.08  # pixels of disparity
STEP = 1 / 32  # pixels: the finest disparity that the chip tells apart
NEAR, FAR = 0.4, 6.0  # metres: the range that the D455 is sold for
EDGE = 1.0  # pixels of disparity between neighbours that make an edge

MEASURED, FLYING, HIDDEN, EDGE_HOLE, OUTSIDE, OUT_OF_RANGE, UNMATCHED, NOTHING = range(8)
ARTEFACTS = (  # what can happen to a pixel; only the first two give a depth
    "measured",
    "flying between two depths",
    "hidden from the second imager",
    "hole at an edge",
    "outside the second image",
    "too near or too far",
    "nothing to match",
    "nothing there",
)


@dataclass(frozen=True)
class Measurement:
    """A measured depth image.

    Attributes
    ----------
    depth : (H, W) float32, metres in whole millimetres, 0 = no data.
    artefacts : (H, W) uint8, index into `ARTEFACTS`: what happened at this pixel.
    """

    depth: np.ndarray
    artefacts: np.ndarray

    def raw(self) -> np.ndarray:
        """(H, W) uint16 millimetres, as the camera stores it (the encoding "realsense")."""
        return np.rint(self.depth * 1000.0).astype(np.uint16)


def min_depth(camera: PinholeCamera, baseline: float = BASELINE) -> float:
    """The nearest depth that the matcher can find, metres: f B / 126."""
    return camera.fx * baseline / DISPARITIES


def depth_sigma(depth: np.ndarray | float, camera: PinholeCamera, baseline: float = BASELINE) -> np.ndarray | float:
    """The standard deviation of depth, metres, that the noise and the steps of disparity cause: z² σ_d / (f B)."""
    return np.square(depth) * np.hypot(SIGMA, STEP / np.sqrt(12)) / (camera.fx * baseline)


def measure(
    depth: np.ndarray,
    camera: PinholeCamera,
    rng: np.random.Generator,
    baseline: float = BASELINE,
    *,
    unmeasurable: np.ndarray | None = None,
) -> Measurement:
    """Measure a true depth image as a D455 would.

    Parameters
    ----------
    depth : (H, W) float, true depth in metres, 0 where there is nothing.
    camera : intrinsics of the depth image.
    rng : where the noise comes from; the same state gives the same image.
    baseline : metres between the two imagers.
    unmeasurable : (H, W) bool, pixels whose surface gives nothing to match (shining, mirroring); they become holes.

    Returns
    -------
    Measurement. A depth is there where ``artefacts`` is `MEASURED` or `FLYING`.

    Raises
    ------
    ValueError
        If the image is not the camera's size or not depth in metres, or the baseline is not positive.
    """
    depth = check_depth(depth)
    if depth.shape != (camera.height, camera.width):
        raise ValueError(
            f"The depth image is {depth.shape[1]}x{depth.shape[0]} but the camera {camera.width}x{camera.height}; "
            "give the intrinsics of this resolution (camera.scaled)."
        )
    if not baseline > 0:
        raise ValueError(f"The baseline must be a positive length in metres, not {baseline}.")
    if not isinstance(rng, np.random.Generator):
        raise ValueError(f"The noise needs numpy.random.default_rng(seed), not {type(rng).__name__}.")
    focal_baseline = camera.fx * baseline
    there = np.isfinite(depth) & (depth > 0)
    true = np.where(there, focal_baseline / np.where(there, depth, 1), 0).astype(np.float32)

    hidden = _hidden_from_right(true, there)
    low, high = _neighbourhood(true, there)
    edge = there & (high - low > EDGE)
    fate, share = rng.random(depth.shape, np.float32), rng.random(depth.shape, np.float32)
    flying = edge & ~hidden & (fate < 0.30)

    noise = cv2.GaussianBlur(rng.standard_normal(depth.shape, np.float32), (5, 5), 0.7)
    noise *= SIGMA / _blur_gain()
    # The matcher's window lies on both sides of an edge: it finds something between, more often near the front.
    disparity = np.where(flying, low + (high - low) * np.sqrt(share), true) + noise
    disparity = np.rint(disparity / STEP) * STEP

    z = np.where(disparity > 0, focal_baseline / np.maximum(disparity, STEP), 0)
    columns = np.arange(camera.width, dtype=np.float32)
    artefacts = np.where(flying, np.uint8(FLYING), np.uint8(MEASURED))
    artefacts[edge & (fate > 0.72)] = EDGE_HOLE
    artefacts[hidden] = HIDDEN
    artefacts[columns < true] = OUTSIDE
    artefacts[(z < max(NEAR, min_depth(camera, baseline))) | (z > FAR)] = OUT_OF_RANGE
    if unmeasurable is not None:
        artefacts[np.asarray(unmeasurable, bool)] = UNMATCHED
    artefacts[~there] = NOTHING
    millimetres = np.rint(np.where(artefacts <= FLYING, z, 0) * 1000.0)
    return Measurement((millimetres / 1000.0).astype(np.float32), artefacts)


def _hidden_from_right(disparity: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Points of the left image that something nearer hides from the right one: a strip left of each near thing.

    A point in column u appears in the right image at u - d. What lies further right in the left image but not in the
    right one stands in front of it.
    """
    columns = np.arange(disparity.shape[1], dtype=np.float32)
    at = np.where(there, columns - disparity, np.inf)
    rightmost = np.minimum.accumulate(at[:, ::-1], axis=1)[:, ::-1]
    hidden = np.zeros(disparity.shape, bool)
    hidden[:, :-1] = there[:, :-1] & (at[:, :-1] > rightmost[:, 1:] + 0.5)
    return hidden


def _neighbourhood(disparity: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest disparity of the 3 x 3 pixels around each pixel; pixels without any do not count."""
    kernel = np.ones((3, 3), np.uint8)
    low = cv2.erode(np.where(there, disparity, np.float32(1e6)), kernel)
    return low, cv2.dilate(disparity, kernel)


def _blur_gain() -> float:
    """What the blur leaves of the standard deviation of white noise."""
    kernel = cv2.getGaussianKernel(5, 0.7, cv2.CV_64F)
    return float(np.sum(kernel**2))


def color_noise(color: np.ndarray, rng: np.random.Generator, sigma: float = 1.2) -> np.ndarray:
    """Add the noise of an image sensor to a colour image: (H, W, 3) uint8, ``sigma`` in steps of 255."""
    grain = rng.standard_normal(color.shape, np.float32)
    return np.clip(np.rint(color + np.float32(sigma) * grain), 0, 255).astype(np.uint8)
