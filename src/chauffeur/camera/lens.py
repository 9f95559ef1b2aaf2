"""Lens and sensor effects: radial distortion and noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.camera.look import CameraLook
    from chauffeur.camera.rig import Camera

    FloatArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Lens:
    """A lens with distortion k1 and a sensor with noise.

    A point at radius r from the principal point (in half image widths) shows at zoom r (1 + k1 r^2). The zoom of a
    barrel lens is the one at which the farthest corner shows itself: no pixel lies outside of what was rendered.
    """

    camera: Camera
    distortion: float
    noise: float

    @classmethod
    def of(cls, camera: Camera, look: CameraLook) -> Lens:
        """The lens of a look on a camera."""
        return cls(camera, look.distortion, look.noise)

    @property
    def zoom(self) -> float:
        """Magnification at the principal point."""
        (cx, cy), camera = self.camera.centre_px, self.camera
        corner = math.hypot(max(cx, camera.width - cx), max(cy, camera.height - cy)) / (camera.width / 2.0)
        return 1.0 / (1.0 + min(self.distortion, 0.0) * corner**2)

    def bend(self, picture: NDArray[Any]) -> NDArray[Any]:
        """A pinhole picture (H, W, ...) as the lens shows it; nearest pixel, so that masks stay masks."""
        if self.distortion == 0.0:
            return picture
        rows, columns = _sources(
            self.camera.width, self.camera.height, *self.camera.centre_px, self.distortion, self.zoom
        )
        return picture[rows, columns]

    def points(self, pixels: FloatArray) -> FloatArray:
        """Map pinhole pixels (n, 2) through the lens."""
        if self.distortion == 0.0:
            return pixels
        centre, half = np.array(self.camera.centre_px), self.camera.width / 2.0
        away = (pixels - centre) / half
        return centre + away * half * self.zoom * (1.0 + self.distortion * (away**2).sum(axis=1, keepdims=True))

    def noisy(self, picture: NDArray[np.uint8], seed: int, tick: int, index: int) -> NDArray[np.uint8]:
        """The picture with the sensor's noise."""
        if self.noise == 0.0:
            return picture
        rng = np.random.default_rng([seed, tick, index, 9])
        grain = rng.standard_normal(picture.shape, np.float32) * self.noise
        return np.clip(picture + grain, 0.0, 255.0).astype(np.uint8)


@lru_cache(maxsize=16)
def _sources(
    width: int, height: int, cx: float, cy: float, k1: float, zoom: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Row and column of the pinhole pixel that each pixel shows."""
    u, v = np.meshgrid(np.arange(width) + 0.5 - cx, np.arange(height) + 0.5 - cy)
    shown = np.hypot(u, v) / (width / 2.0)
    r = shown / zoom
    for _ in range(12):  # Newton on zoom (r + k1 r^3) = shown
        r -= (r + k1 * r**3 - shown / zoom) / (1.0 + 3.0 * k1 * r**2)
    factor = np.where(shown > 1e-9, r / np.maximum(shown, 1e-9), 1.0)
    columns = np.clip(np.floor(u * factor + cx), 0, width - 1).astype(np.int64)
    rows = np.clip(np.floor(v * factor + cy), 0, height - 1).astype(np.int64)
    return rows, columns
