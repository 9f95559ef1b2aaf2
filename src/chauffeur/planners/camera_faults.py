"""Faults of a camera that its pictures show by themselves, before any model is asked what is in them.

Simple statistics of a picture of 224 x 128 px, with thresholds that no picture of ours in any weather comes near:
the sharpest 1 % of its edges are 67 levels or more in the densest fog, no row or column of it is dark or of one grey,
and at most a quarter of it is within three levels of its median. A lens that is soiled in places shows none of this.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from chauffeur.concept import CameraImage

Array = np.ndarray[Any, Any]

WIDTH, HEIGHT = 224, 128
"""Size at which pictures are looked at, px: a car 40 m ahead is nine of them wide."""
CELLS: Final = (HEIGHT // 16, WIDTH // 16)
"""Rows and columns of the grid in which the on-board VLM sees a picture."""
_DARK_LEVEL: Final = 10.0
"""No pixel of a dark row is brighter, of 255."""
_GREY_LEVELS: Final = 3.0
_ONE_COLOUR_SHARE: Final = 0.9
_PART_SHARE: Final = 0.2
"""Rows or columns that are dark or of one grey, from which on a part of the picture is missing."""
_SHARP_LEVELS: Final = 25.0
"""Of the sharpest 1 % of edges (Laplacian): a blur of 2 px of 448 leaves 31, of 4 px 10."""
_FLAT_LEVELS: Final = 0.7
_FROZEN_AFTER_S: Final = 0.05


def small(pixels: Array) -> Array:
    """A picture (H, W, 3) uint8 brought down to (HEIGHT, WIDTH, 3) uint8 by the mean of its pixels."""
    from PIL import Image

    if pixels.shape[:2] == (HEIGHT, WIDTH):
        return pixels
    return np.asarray(Image.fromarray(pixels).resize((WIDTH, HEIGHT), Image.Resampling.BOX))


def camera_fault(images: Sequence[CameraImage], earlier: CameraImage | None = None) -> str:
    """Fault of a camera by its pictures, in words; empty if there is none.

    Args:
        images: V of a request, oldest first, of one camera.
        earlier: The picture of the request before.
    """
    if not images:
        return "The camera is off"
    last = images[-1]
    pixels = last.pixels()
    if fault := picture_fault(pixels):
        return fault
    before = images[-2] if len(images) > 1 else earlier
    if before is not None and last.time_s - before.time_s > _FROZEN_AFTER_S:
        old = before.pixels()
        if old.shape == pixels.shape and bool((old == pixels).all()):
            return "The camera's picture is frozen"
    return ""


def picture_fault(pixels: Array) -> str:
    """Fault of a picture (H, W, 3) uint8, in words; empty if there is none."""
    grey = small(pixels).astype(np.float64).mean(axis=2)
    median = float(np.median(grey))
    if float((np.abs(grey - median) <= _GREY_LEVELS).mean()) > _ONE_COLOUR_SHARE:
        return "The camera's picture is black" if median < _DARK_LEVEL else "The camera shows a blank picture"
    for axis in (0, 1):
        if float((grey.max(axis=axis) < _DARK_LEVEL).mean()) >= _PART_SHARE:
            return "A part of the camera's picture is black"
        if float((grey.std(axis=axis) < _FLAT_LEVELS).mean()) >= _PART_SHARE:
            return "A part of the camera's picture is blank"
    around = grey[:-2, 1:-1] + grey[2:, 1:-1] + grey[1:-1, :-2] + grey[1:-1, 2:]
    edges = np.abs(4.0 * grey[1:-1, 1:-1] - around)
    return "The camera's picture is blurred" if float(np.percentile(edges, 99.0)) < _SHARP_LEVELS else ""
