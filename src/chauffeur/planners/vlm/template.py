"""The answer of the on-board VLM, token by token: the style it heard, the scene it saw (C), the action matrix P.

    wish | task acceleration, recall none, style aggressive | picture | see snow heavy lead near road straight |
    gains kp=7 ki=12 kd=3 wl=9 wh=11 ws=2

Each gain is one token of a codebook within the certified box: one token cannot contradict itself, and none of them
says what the box does not hold. `task` and `recall` are given to the model, never decided by it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from chauffeur.concept import ActionMatrix
from chauffeur.planners.vilad.template import ActionSlot, ActionTemplate
from chauffeur.safety.gain_box import GAIN_NAMES, LOGARITHMIC, GainBox

Style = Literal["conservative", "moderate", "aggressive"]
STYLES: Final[tuple[Style, ...]] = "conservative", "moderate", "aggressive"
TASKS: Final = ("acceleration", "lane_change", "left_turn")
RECALLS: Final = ("none", "gentler", "brisker")
"""Demands of earlier feedback on such a wish."""
SEEN_WEATHERS: Final = ("sunny", "night", "rain", "fog", "snow")
"""In the order in which they ask for care."""
GRADES: Final = ("clear", "light", "heavy")
LEADS: Final = ("no_lead", "far_lead", "lead", "near_lead")
ROADS: Final = ("straight", "bend_left", "bend_right")
SIGHTS: Final[Mapping[str, tuple[str, ...]]] = {
    "weather": SEEN_WEATHERS, "grade": GRADES, "lead": LEADS, "road": ROADS,
}  # fmt: skip
"""Words for what is seen, by slot."""
GAINS: Final = tuple(name.lower() for name in GAIN_NAMES)
LEVELS: Final = 24
"""Values of a gain in the codebook."""


def _gain_slot(name: str) -> ActionSlot:
    return ActionSlot(name, tuple(f"{name}={level}" for level in range(LEVELS)))


TEMPLATE: Final = ActionTemplate(
    (
        "wish",
        ActionSlot("task", TASKS),
        ActionSlot("recall", RECALLS),
        ActionSlot("style", STYLES),
        "see",
        *(ActionSlot(name, words) for name, words in SIGHTS.items()),
        "gains",
        *(_gain_slot(name) for name in GAINS),
    )
)
HEARD: Final = TEMPLATE.places["style"] + 1
"""Tokens before the picture: the style is decided by words alone."""
GIVEN: Final = ("task", "recall")
DECIDED: Final = tuple(slot.name for slot in TEMPLATE.slots if slot.name not in GIVEN)


@dataclass(frozen=True)
class GainCodebook:
    """Values of each gain's tokens, lowest first.

    Attributes:
        values: By gain's name, `LEVELS` each.
    """

    values: Mapping[str, tuple[float, ...]]

    @classmethod
    def of(cls, box: GainBox) -> GainCodebook:
        """Evenly over a box; in ratios where a gain spans orders of magnitude."""
        found: dict[str, tuple[float, ...]] = {}
        for name, shown in zip(GAINS, GAIN_NAMES, strict=True):
            low, high = box.low[shown], box.high[shown]
            shares = [level / (LEVELS - 1) for level in range(LEVELS)]
            if name in LOGARITHMIC:
                found[name] = tuple(math.exp(math.log(low) + s * math.log(high / low)) for s in shares)
            else:
                found[name] = tuple(low + s * (high - low) for s in shares)
        return cls(found)

    def tokens(self, gains: Sequence[float]) -> dict[str, str]:
        """The nearest token of each of six gains."""
        found: dict[str, str] = {}
        for name, value in zip(GAINS, gains, strict=True):
            values = self.values[name]
            scaled = math.log(max(value, 1e-9)) if name in LOGARITHMIC else value
            own = [math.log(one) for one in values] if name in LOGARITHMIC else list(values)
            found[name] = f"{name}={min(range(LEVELS), key=lambda level: abs(own[level] - scaled))}"
        return found

    def matrix(self, decided: Mapping[str, Any]) -> ActionMatrix:
        """P (Eq. 22) of decided tokens."""
        kp, ki, kd, wl, wh, ws = (
            round(self.values[name][int(str(decided[name]).partition("=")[2])], 4) for name in GAINS
        )
        return ActionMatrix((kp, ki, kd), (wl, wh, ws))
