"""Outright requests that parameters can do: sides, a pace, a mood, whom to pass.

Read from the acts of the words (`language.meaning`); whatever only may be meant is left to `hints`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept.utterance import Act, Style, Utterance
from chauffeur.planners.arbitration import one_sign

SURE: Final = 0.6
"""Of a reading: surer ones are taken at their word. Chosen on the tuning half of the simulated passengers."""
_MOODS: Final[dict[Style, str]] = {"hurry": "hurry", "sporty": "hurry", "relaxed": "calm", "gentle": "calm",
    "careful": "calm"}  # fmt: skip
_PACES: Final = {"faster": 1, "slower": -1, "hurry": 1, "calm": -1}


@dataclass(frozen=True, slots=True)
class Outright:
    """The outright requests of a wish.

    Attributes:
        sides: Left and right, as far as named for something to do.
        pace: 1 for faster or in haste, -1 for slower or at ease, 0 for neither or both.
        plain: Whether anything at all is asked for.
        asks: Whether the words are a question, and ask for nothing to be done.
    """

    sides: frozenset[str] = frozenset()
    pace: Literal[-1, 0, 1] = 0
    plain: bool = False
    asks: bool = False

    @classmethod
    def of(cls, said: Utterance) -> Outright:
        """As the acts have it; nothing where the reading is unsure."""
        if said.sure < SURE:
            return cls()
        acts = [act for act in said.acts if not act.negated and act.when is None]
        sides = frozenset(act.side for act in acts if act.side is not None and act.act in ("lane", "turn"))
        return cls(sides, one_sign(map(_pace, acts)), bool(said.acts), said.address == "question" and not said.acts)

    def contradicts(self, *, side: str, pace: int) -> bool:
        """True if a reading that goes to a side (empty for none) at a pace (sign) drops or denies what was said."""
        return bool(self.sides and side not in self.sides) or (self.pace != 0 and pace not in (0, self.pace))


def _pace(act: Act) -> int:
    mood = _MOODS.get(act.style, "") if act.style is not None else ""
    return _PACES.get(mood or (act.direction or "" if act.act == "speed" else ""), 0)
