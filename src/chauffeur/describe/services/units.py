"""Speeds, distances and ages in words, in the units of the region."""

from __future__ import annotations

from chauffeur.concept.units import M_PER_MILE, people_speed
from chauffeur.describe.services.rules import Rules


def speed_words(speed_mps: float, rules: Rules | None) -> str:
    """A speed as signs of the region give it: `50 km/h`, `30 mph`."""
    return people_speed(speed_mps, "mph" if rules is not None and rules.unit == "mph" else "km/h")


def distance_words(length_m: float, rules: Rules | None) -> str:
    """A distance: `240 m`, `1.4 km`, `1.4 miles`."""
    if length_m < 995.0:
        return f"{max(0.0, round(length_m, -1)):.0f} m" if length_m >= 100.0 else f"{max(0.0, length_m):.0f} m"
    if rules is not None and rules.unit == "mph":
        return f"{length_m / M_PER_MILE:.1f} miles"
    return f"{length_m / 1000.0:.1f} km"


def age_words(age_s: float) -> str:
    """An age: `40 s`, `14 min`, `3 h`, `12 days`."""
    if age_s < 99.5:
        return f"{age_s:.0f} s"
    if age_s < 99.5 * 60.0:
        return f"{age_s / 60.0:.0f} min"
    if age_s < 48.0 * 3_600.0:
        return f"{age_s / 3_600.0:.0f} h"
    return f"{age_s / 86_400.0:.0f} days"
