"""Robust kernels: weights by which least squares, repeated, listens less to residuals that are too large.

References
----------
Huber, Robust Statistics, 1981; Beaton and Tukey, Technometrics 16(2), 1974; Zhang, Parameter estimation techniques: a
tutorial with application to conic fitting, Image and Vision Computing 15(1), 1997.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["KERNELS", "robust_weights"]

KERNELS = ("none", "huber", "tukey")
TUKEY, HUBER = 4.685, 1.345  # in standard deviations: 95 % of the efficiency of least squares on Gaussian noise
TO_DEVIATION = 1.4826  # a median of absolute residuals times this is the standard deviation of Gaussian noise


def robust_weights(residual: NDArray[np.float64], kernel: str) -> NDArray[np.float64] | None:
    """Return a weight in [0, 1] for each residual, by its size against 1.4826 times their median.

    Parameters
    ----------
    residual : (N,) float ≥ 0, of any unit.
    kernel : "huber" (large residuals pull with a constant force), "tukey" (with none from 4.685 deviations on), "none".

    Returns
    -------
    (N,) float64, or None for "none", where all count alike. Where the median is 0, 1 for residuals of 0 and 0 for
    the others, which both kernels come to as the median shrinks.

    Raises
    ------
    ValueError
        If there is no such kernel, or a residual is not finite.

    Examples
    --------
    >>> robust_weights(np.array([1.0, 1.0, 1.0, 100.0]), "tukey").round(2).tolist()
    [0.96, 0.96, 0.96, 0.0]
    """
    if kernel not in KERNELS:
        raise ValueError(f"kernel: expected one of {', '.join(KERNELS)}, got {kernel!r}.")
    if kernel == "none":
        return None
    scale = TO_DEVIATION * float(np.median(residual))
    if not np.isfinite(residual).all():
        raise ValueError("residual: a NaN or infinite residual has no weight; drop such pairs first.")
    if scale == 0:
        return np.where(residual == 0, 1.0, 0.0)
    ratio = residual / scale
    if kernel == "huber":
        return np.minimum(1.0, HUBER / np.maximum(ratio, 1e-12))
    return np.where(ratio < TUKEY, (1 - (ratio / TUKEY) ** 2) ** 2, 0.0)
