"""Cameras by name: PrimeSense, and every depth and colour mode of a RealSense D455.

The values are nominal: what the data sheets promise, with square pixels and a centred principal point. A real device
differs by its tolerance (± 3 degrees for the D455, some 5 % of the focal length): measure with its own calibration,
which `rs-enumerate-devices -c`, the SDK or the recording tells. All of this is in
`course_lib.camera.pinhole`, too.

How the modes of the D455 are derived. Both its imagers have 1280x800 pixels. A mode of W x H pixels is that picture
scaled by s = max(W / 1280, H / 800) and cropped about its centre: 1280x720 is cropped only, 848x480 is scaled by
0.6625, 640x480 by 0.6 (to 768x480) and loses its sides. A real device's listing (realsense-ros issue 2788) agrees: its
focal lengths 212.11, 240.13, 320.17, 384.21 and 424.23 at 424x240, 480x270, 640x360, 640x480 and 848x480 are all 640.3
times s. The data sheet's two fields of view do not quite fit each other: 87 degrees across 1280 square pixels are 56.2
degrees across 720, not 58; the horizontal one is used. The 256x144 mode is left out: no source tells how it is cut.

References
----------
Intel RealSense Product Family D400 Series, data sheet 337029, depth and colour camera fields of view: D455 depth
87° x 58° (± 3°, ± 1°), 75° x 62° at 4:3; colour 90° x 65° (± 3°).
"""

from __future__ import annotations

import numpy as np

from course_lib import checks
from course_lib.camera.intrinsics import PinholeCamera, camera_from_fov

IMAGER = (1280, 800)  # pixels of each imager of the D455
DEPTH_FOV, COLOR_FOV = np.radians(87.0), np.radians(90.0)  # horizontal, across all 1280 columns
DEPTH_MODES = ((1280, 720), (848, 480), (848, 100), (640, 480), (640, 360), (480, 270), (424, 240))
COLOR_MODES = ((1280, 800), (1280, 720), (848, 480), (640, 480), (640, 360), (480, 270), (424, 240))


def _mode(kind: str, fov: float, width: int, height: int) -> PinholeCamera:
    """One mode of an ideal imager: scaled so that it covers width x height, then cropped about the centre."""
    f = max(width / IMAGER[0], height / IMAGER[1]) * camera_from_fov(fov, *IMAGER, axis="horizontal").fx
    source = (
        f"nominal, from the D455's horizontal {kind} field of view of {np.degrees(fov):.0f} degrees in data sheet "
        "337029, square pixels, centred; a real device's own calibration must be read from it."
    )
    return PinholeCamera(width, height, f, f, 0.5 * (width - 1), 0.5 * (height - 1), source=source)


PRESETS: dict[str, PinholeCamera] = {
    "primesense": PinholeCamera(
        640, 480, 525.0, 525.0, 319.5, 239.5,
        source="nominal, as Open3D's PrimeSenseDefault: Kinect, Xtion and their kin at 640x480.",
    ),
    **{f"d455_depth_{w}x{h}": _mode("depth", DEPTH_FOV, w, h) for w, h in DEPTH_MODES},
    **{f"d455_color_{w}x{h}": _mode("colour", COLOR_FOV, w, h) for w, h in COLOR_MODES},
}  # fmt: skip


def preset(name: str) -> PinholeCamera:
    """Return a nominal camera by name.

    Parameters
    ----------
    name : one of `PRESETS`, e.g. "primesense" or "d455_depth_848x480".

    Returns
    -------
    PinholeCamera whose `source` says where its numbers come from.

    Raises
    ------
    ValueError
        If the name is unknown; the nearest one is suggested.

    Examples
    --------
    >>> preset("primesence")
    Traceback (most recent call last):
    ValueError: preset: there is no camera 'primesence'; did you mean 'primesense'?
    """
    if not isinstance(name, str) or name not in PRESETS:
        raise ValueError(f"preset: there is no camera {name!r}; {checks.nearest_name(name, PRESETS)}")
    return PRESETS[name]
