"""Colour variations of camera and world, for training and testing models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from chauffeur.concept import ConfigError


@dataclass(frozen=True, slots=True)
class CameraLook:
    """Palette, exposure and lens of a picture.

    Attributes:
        name: Preset's name.
        exposure: Factor on light, 1 neutral.
        contrast: Slope about mid grey, 1 neutral.
        saturation: 0 grey, 1 neutral.
        tint: Factor on (red, green, blue).
        palette: Which colours buildings, vehicles and vegetation are painted in (0, 1, 2).
        vignette: Darkening of the corners, 0 to 1.
        distortion: Radial distortion k1 of the lens, on radii in half image widths; negative: barrel.
        noise: Standard deviation of sensor noise, 0 to 255.
    """

    name: str = "default"
    exposure: float = 1.0
    contrast: float = 1.0
    saturation: float = 1.0
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    palette: int = 0
    vignette: float = 0.0
    distortion: float = 0.0
    noise: float = 0.0


LOOKS: Final = {
    look.name: look
    for look in (
        CameraLook(),
        CameraLook("held_out_a", 1.22, 0.88, 0.72, (1.06, 1.0, 0.9), 1, 0.35, -0.10, 2.0),
        CameraLook("held_out_b", 0.80, 1.14, 1.25, (0.94, 1.0, 1.10), 2, 0.15, 0.06, 4.0),
    )
}
"""`default` is what models train on; the held-out ones have another palette, exposure and lens, for tests only."""


def look_of(name: str) -> CameraLook:
    """A preset by name. Raises ConfigError."""
    if name not in LOOKS:
        raise ConfigError(f"There is no look {name!r}.", hint=f"Choose of: {', '.join(LOOKS)}.")
    return LOOKS[name]
