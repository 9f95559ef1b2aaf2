"""Numbers and reasons as the person and the repairing model read them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Final

from chauffeur.concept import Verdict
from chauffeur.concept.units import kmh, people_speed

IN_A_HELPER: Final = "(In a helper function.)"
"""Added for the model that repairs a program; the person has none."""
_SENTENCE: Final = re.compile(r"(?<=[.!?])\s+(?=[A-Z(])")
_BOTH_UNITS: Final = re.compile(r"(?<![\d.])(\d{1,9}(?:\.\d{1,9})?(?:e[+-]?\d{1,3})?) m/s \((-?\d{1,9} km/h)\)")


@lru_cache(maxsize=256)
def speed_words(speed_mps: float) -> str:
    """A speed, e.g. `38.3 m/s (138 km/h)`."""
    return f"{speed_mps:.4g} m/s ({people_speed(speed_mps)})"


def reasons_once(verdicts: Iterable[Verdict], *, remedies: bool = False) -> str:
    """Reasons not to drive a plan, for the person: each once, however many checks have found it; empty when it is.

    Args:
        verdicts: Of all checks.
        remedies: Whether to say what would help, too.
    """
    found: dict[str, None] = {}
    for verdict in verdicts:
        if verdict.stops:
            said = verdict.reason.replace(IN_A_HELPER, "")
            texts = (said, verdict.remedy) if remedies else (said,)
            found |= dict.fromkeys(each for text in texts for each in _SENTENCE.split(in_km_per_h(text)) if each)
    return " ".join(found)


def in_km_per_h(text: str) -> str:
    """The text with speeds in km/h alone, to a tenth where whole ones would make two speeds the same."""
    found = _BOTH_UNITS.findall(text)
    alike = len({whole for _, whole in found}) < len({exact for exact, _ in found})

    def one_unit(speed: re.Match[str]) -> str:
        return f"{kmh(float(speed[1])):.1f} km/h" if alike else speed[2]

    return _BOTH_UNITS.sub(one_unit, text).strip()
