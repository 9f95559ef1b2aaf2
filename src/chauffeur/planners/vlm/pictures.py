"""Pictures as the on-board VLM takes them, and what can be wrong with a camera before anybody asks what it sees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from chauffeur.concept import CameraImage

Array = np.ndarray[Any, Any]

WIDTH, HEIGHT = 224, 128
"""Size the network looks at, px: a car 40 m ahead is nine of them wide."""
CELLS: Final = (HEIGHT // 16, WIDTH // 16)
"""Rows and columns of the grid that the network sees in."""
_BLACK_LEVEL: Final = 6.0
_FLAT_LEVEL: Final = 2.0
_FROZEN_AFTER_S: Final = 0.05


def small(pixels: Array) -> Array:
    """A picture (H, W, 3) uint8 brought down to (HEIGHT, WIDTH, 3) uint8 by the mean of its pixels."""
    from PIL import Image

    if pixels.shape[:2] == (HEIGHT, WIDTH):
        return pixels
    return np.asarray(Image.fromarray(pixels).resize((WIDTH, HEIGHT), Image.Resampling.BOX))


def fault_of(images: Sequence[CameraImage], earlier: CameraImage | None = None) -> str:
    """What is wrong with the front camera's pictures, in words; empty where nothing is.

    Args:
        images: V of a request, oldest first.
        earlier: The picture of the request before.
    """
    if not images:
        return "The camera is off"
    last = images[-1]
    pixels = last.pixels()
    if float(pixels.mean()) < _BLACK_LEVEL and float(pixels.max()) < 64:
        return "The camera's picture is black"
    if float(pixels.std()) < _FLAT_LEVEL:
        return "The camera shows a blank picture"
    before = images[-2] if len(images) > 1 else earlier
    if before is not None and last.time_s - before.time_s > _FROZEN_AFTER_S:
        old = before.pixels()
        if old.shape == pixels.shape and bool((old == pixels).all()):
            return "The camera's picture is frozen"
    return ""
