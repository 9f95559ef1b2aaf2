"""The gains that are taught: by style, weather, manoeuvre, lead vehicle and earlier feedback (`data/vlm/gains.json`).

The paper's annotators wrote an action matrix for each pair of picture and instruction (Sec. VI-B5a). Here a table does:
each style has its boldest and its most careful gains, and what is seen decides where between the two.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cache
from typing import Any

from chauffeur.concept import DataError
from chauffeur.concept.data import read_data
from chauffeur.planners.vlm.template import GAINS, STYLES
from chauffeur.safety.gain_box import LOGARITHMIC


@dataclass(frozen=True, slots=True)
class GainCase:
    """Conditions that the gains depend on; words as in `planners.vlm.template`."""

    style: str
    weather: str
    grade: str
    lead: str = "no_lead"
    task: str = "acceleration"
    recall: str = "none"


@cache
def gain_table() -> dict[str, Any]:
    """The table. Raises DataError: it is not here or damaged."""
    try:
        found: dict[str, Any] = json.loads(read_data("vlm", "gains.json"))
    except ValueError as error:
        raise DataError(f"gains.json cannot be read: {error}.", hint="See data/vlm/CARD.md.") from error
    if found.get("names") != list(GAINS):
        raise DataError("gains.json does not name the six gains.", hint="See data/vlm/CARD.md.")
    return found


def care_share(case: GainCase) -> float:
    """Position of a case between a style's boldest (0) and most careful (1) gains."""
    table = gain_table()
    lead = {"no_lead": "none", "far_lead": "far", "lead": "ahead", "near_lead": "near"}[case.lead]
    share = table["weather"][case.weather] + table["lead"][lead] + table["task"][case.task]
    if case.grade == "heavy":
        share += table["heavy"]
    return min(1.0, share)


def taught_gains(case: GainCase) -> tuple[float, ...]:
    """Kp, Ki, Kd, Wl, Wh, Ws of a case.

    Feedback moves them by one style; at the last one, and never towards boldness in bad weather, by a share.
    """
    table, share, style = gain_table(), care_share(case), STYLES.index(case.style)
    if case.recall == "gentler":
        share = share if style > 0 else min(1.0, share + table["recall"])
        style = max(0, style - 1)
    elif case.recall == "brisker":
        share = share if style < 2 or case.weather != "sunny" else max(0.0, share - table["recall"])
        style = min(2, style + 1)
    bold, careful = table["bold"][STYLES[style]], table["careful"][STYLES[style]]
    found: list[float] = []
    for name, a, b in zip(GAINS, bold, careful, strict=True):
        if name in LOGARITHMIC:
            found.append(math.exp(math.log(a) + share * math.log(b / a)))
        else:
            found.append(a + share * (b - a))
    return tuple(found)
