"""Numbers as the person and the repairing model read them: m/s together with km/h."""

from __future__ import annotations

from chauffeur.concept.units import kmh


def speed_words(speed_mps: float) -> str:
    """A speed, e.g. `38.3 m/s (138 km/h)`."""
    return f"{speed_mps:.4g} m/s ({kmh(speed_mps):.0f} km/h)"
