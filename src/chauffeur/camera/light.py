"""Light of a scene under given conditions: sun or moon, sky, air."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from chauffeur.camera.look import CameraLook
    from chauffeur.camera.weather import Conditions

Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Light:
    """Display values, about 0 to 1.

    Attributes:
        sun: Direction towards sun or moon.
        sun_light: Of it.
        sky_light: From above.
        ground_light: From below.
        zenith: Sky overhead.
        horizon: Sky at the horizon, and what a wet road mirrors.
        air: What the air scatters.
        terrain: Colour of the land.
        mist: How much the air hides of the sky, 0 to 1.
        shadows: Strength of cast shadows, 0 to 1; 0: none are drawn.
    """

    sun: Colour
    sun_light: Colour
    sky_light: Colour
    ground_light: Colour
    zenith: Colour
    horizon: Colour
    air: Colour
    terrain: Colour
    mist: float
    shadows: float


def _mix(a: Colour, b: Colour, share: float) -> Colour:
    return tuple(x + (y - x) * share for x, y in zip(a, b, strict=True))  # type: ignore[return-value]


def _times(a: Colour, factor: float) -> Colour:
    return a[0] * factor, a[1] * factor, a[2] * factor


_LAND = {
    "country": ((0.34, 0.44, 0.19), (0.52, 0.46, 0.24), (0.24, 0.42, 0.28)),
    "town": ((0.44, 0.46, 0.34), (0.52, 0.48, 0.38), (0.40, 0.44, 0.42)),
    "lot": ((0.38, 0.44, 0.26), (0.50, 0.46, 0.30), (0.32, 0.42, 0.32)),
}


def light_of(conditions: Conditions, look: CameraLook, seed: int, surroundings: str) -> Light:
    """The light of a place under conditions; the sun's direction is the seed's."""
    rng = np.random.default_rng([seed, 77])
    azimuth, height = float(rng.uniform(0.0, math.tau)), math.radians(float(rng.uniform(32.0, 52.0)))
    sun = (math.cos(azimuth) * math.cos(height), math.sin(azimuth) * math.cos(height), math.sin(height))
    cloud, night = conditions.cloud, conditions.night
    grey: Colour = (0.62, 0.64, 0.67)
    if conditions.snow > max(conditions.rain, conditions.fog):
        grey = (0.80, 0.82, 0.85)
    elif conditions.fog > conditions.rain:
        grey = (0.76, 0.77, 0.78)
    elif conditions.rain > 0.0:
        grey = _mix((0.62, 0.65, 0.69), (0.44, 0.47, 0.51), conditions.rain)
    horizon = _mix((0.76, 0.85, 0.93), grey, cloud)
    zenith = _mix((0.22, 0.44, 0.78), _times(grey, 0.88), cloud)
    air = _mix((0.72, 0.81, 0.90), grey, min(1.0, cloud * 1.3))
    sun_light = _times((0.98, 0.90, 0.74), 0.92 * (1.0 - cloud) ** 1.5)
    sky_light = _mix((0.52, 0.58, 0.68), _mix(grey, (0.80, 0.80, 0.80), 0.35), cloud)
    ground_light = _mix((0.34, 0.33, 0.30), _times(grey, 0.55), cloud)
    day = (1.0 - night) ** 1.4
    dark: Colour = (0.022, 0.028, 0.055)
    scattered: Colour = _times((0.16, 0.155, 0.16), min(1.0, cloud) * 0.75)
    night_air: Colour = (dark[0] + scattered[0], dark[1] + scattered[1], dark[2] + scattered[2])
    return Light(
        sun,
        _mix((0.07, 0.08, 0.11) if cloud < 0.5 else (0.0, 0.0, 0.0), sun_light, day),
        _mix((0.085, 0.095, 0.14), sky_light, day),
        _mix((0.035, 0.035, 0.045), ground_light, day),
        _mix((0.010, 0.014, 0.035), zenith, day),
        _mix(_mix((0.055, 0.062, 0.10), (0.10, 0.098, 0.105), cloud), horizon, day),
        _mix(night_air, air, day),
        _LAND[surroundings][look.palette % 3],
        min(1.0, 0.15 + 1.1 * conditions.fog + 0.8 * conditions.snow + 0.6 * conditions.rain),
        max(0.0, (1.0 - cloud) * (1.0 - night)) * 0.92,
    )
