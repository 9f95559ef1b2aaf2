"""What the named colours of road users look like: the one table that cameras and pages paint from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from chauffeur.concept.utterance import Colour

PAINT_RGB: Final[Mapping[Colour, tuple[float, float, float]]] = {
    "white": (0.90, 0.90, 0.88),
    "black": (0.06, 0.06, 0.07),
    "grey": (0.33, 0.34, 0.36),
    "silver": (0.66, 0.68, 0.71),
    "red": (0.66, 0.08, 0.08),
    "blue": (0.10, 0.22, 0.52),
    "green": (0.08, 0.36, 0.18),
    "yellow": (0.88, 0.72, 0.10),
    "orange": (0.87, 0.42, 0.08),
    "brown": (0.36, 0.20, 0.12),
    "beige": (0.76, 0.69, 0.55),
    "pink": (0.87, 0.50, 0.62),
    "purple": (0.40, 0.14, 0.46),
    "dark": (0.13, 0.13, 0.16),
}
"""Red, green, blue, each 0 to 1, in daylight."""


def css_colour(colour: Colour) -> str:
    """A colour as pages write it, `#rrggbb`."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in PAINT_RGB[colour])
