"""Rain, snow and drops on the lens, as soft quads on the screen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.camera.light import Light
    from chauffeur.camera.rig import Camera
    from chauffeur.camera.weather import Conditions

    RowArray = NDArray[np.float32]

FALL: Final = 9
"""Numbers a quad: place x y and half size x y on the screen (-1 to 1, y down), colour, opacity, slant."""


def falling(camera: Camera, conditions: Conditions, light: Light, seed: int, tick: int, index: int) -> RowArray:
    """Precipitation before a camera at one instant, (n, 9)."""
    parts: list[RowArray] = []
    rng = np.random.default_rng([seed, tick, index, 5])
    bright = np.clip(np.array(light.sky_light) * 1.15 + 0.10 * conditions.night, 0.0, 1.0)
    px = 2.0 / camera.width, 2.0 / camera.height
    scale = camera.width / 448.0
    if conditions.rain > 0.0:
        n = round(60 + 420 * conditions.rain)
        rows = _rows(n, rng)
        near = rng.random(n) ** 2.0
        rows[:, 2] = np.maximum(0.55, (0.55 + 0.9 * near) * scale) * px[0]
        rows[:, 3] = (0.02 + 0.10 * near) * (0.6 + 0.6 * conditions.rain)
        rows[:, 4:7] = bright
        rows[:, 7] = (0.10 + 0.26 * near) * (0.6 + 0.5 * conditions.rain)
        rows[:, 8] = 0.10 + 0.06 * rng.standard_normal()
        parts.append(rows)
        n = round(4 + 16 * conditions.rain)
        rows = _rows(n, rng)
        size = rng.uniform(0.008, 0.028, n) * (0.7 + 0.5 * conditions.rain)
        rows[:, 2], rows[:, 3] = size, size * camera.width / camera.height * rng.uniform(1.0, 1.5, n)
        rows[:, 4:7] = bright * rng.uniform(0.75, 1.1, (n, 1))
        rows[:, 7] = 0.38
        parts.append(rows)
    if conditions.snow > 0.0:
        n = round(120 + 900 * conditions.snow)
        rows = _rows(n, rng)
        near = rng.random(n) ** 5.0
        size = np.maximum(0.7, (0.8 + 5.0 * near) * scale)
        rows[:, 2], rows[:, 3] = size * px[0], size * px[1]
        rows[:, 4:7] = np.clip(bright * 1.25 + 0.12, 0.0, 1.0)
        rows[:, 7] = np.where(near > 0.3, 0.55, 0.85)
        parts.append(rows)
    return np.concatenate(parts).astype(np.float32) if parts else np.zeros((0, FALL), np.float32)


def _rows(n: int, rng: np.random.Generator) -> RowArray:
    rows = np.zeros((n, FALL), np.float32)
    rows[:, :2] = rng.uniform(-1.05, 1.05, (n, 2))
    return rows
