"""Preferences from earlier trips for the numbers that the planner chooses by itself.

Only feedback on the same intent counts, the most recent one first: "a bit too fast" after a hurry makes the next hurry
slower. The offset a trip was driven with is kept in its settings, so that feedback adds up from trip to trip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from chauffeur.concept import Feedback, History, HistoryItem, Round
from chauffeur.concept.utterance import Act
from chauffeur.language.meaning.reader import read
from chauffeur.planners.onboard.meaning import BIT, MUCH, PLAIN

SPEED_SETTING = "personal_speed_mps"
HEADWAY_SETTING = "personal_headway_s"

_SPEED_STEP_MPS = 4.0
"""Offset that feedback of full strength makes; "a bit" (0.35) makes 1.4 m/s."""
_HEADWAY_STEP_S = 0.7
_MAX_SPEED_MPS = 6.0
_MAX_HEADWAY_S = 1.0


@dataclass(frozen=True, slots=True)
class Leaning:
    """A person's preference for an intent, relative to the planner's defaults.

    Attributes:
        speed_mps: Added to a speed the planner chooses.
        headway_s: Added to a headway the planner chooses.
        gentle: Whether changes are to be softer.
        because: Which trip says so, a full sentence; empty without one.
    """

    speed_mps: float = 0.0
    headway_s: float = 0.0
    gentle: bool = False
    because: str = ""

    @property
    def settings(self) -> tuple[tuple[str, float], ...]:
        """The offsets that are not zero, for the plan's settings."""
        pairs = ((SPEED_SETTING, self.speed_mps), (HEADWAY_SETTING, self.headway_s))
        return tuple((name, round(value, 3)) for name, value in pairs if value)


def leaning_of(history: History, intent: str, corrections: tuple[Feedback, ...] = ()) -> Leaning:
    """Leaning of a person for an intent.

    Args:
        history: What memory recalled.
        intent: Family of the present wish, e.g. `style.hurry`.
        corrections: Feedback on the present wish itself, from earlier rounds.
    """
    items = sorted((item for item in history.items if _bears_on(item, intent)), key=lambda item: item.when)
    leaning = Leaning()
    if items:
        last = items[-1]
        leaning = _moved(_driven_with(last), last.feedback[-1:], because(last))
    return _moved(leaning, corrections, "I corrected it after what you just said.")


def _bears_on(item: HistoryItem, intent: str) -> bool:
    return intent in item.intent.split("+") and bool(item.feedback)


def _driven_with(item: HistoryItem) -> Leaning:
    settings = dict(item.settings)
    return Leaning(settings.get(SPEED_SETTING, 0.0), settings.get(HEADWAY_SETTING, 0.0))


def _moved(leaning: Leaning, feedback: tuple[Feedback, ...], why: str) -> Leaning:
    for said in feedback:
        speed = leaning.speed_mps + said.speed * said.strength * _SPEED_STEP_MPS
        # feedback says how the gap was: too small (-1) asks for more
        headway = leaning.headway_s - said.gap * said.strength * _HEADWAY_STEP_S
        changed = bool(said.speed or said.gap or said.comfort < 0) and said.strength > 0
        kept = why if changed or leaning.speed_mps or leaning.headway_s else leaning.because
        leaning = Leaning(
            max(-_MAX_SPEED_MPS, min(_MAX_SPEED_MPS, speed)),
            max(-_MAX_HEADWAY_S, min(_MAX_HEADWAY_S, headway)),
            said.comfort < 0 or leaning.gentle,
            kept,
        )
    return leaning


def because(item: HistoryItem) -> str:
    """The reason why a remembered trip counts, a full sentence."""
    said = " ".join(item.feedback[-1].text.split())[:80] if item.feedback else ""
    day = f" on {item.when[:10]}" if item.when else ""
    words = f', you said "{said}"' if said else ""
    return f'After "{item.instruction[:80]}"{day}{words}; I keep to that.'


def corrections_of(rounds: Sequence[Round]) -> tuple[Feedback, ...]:
    """Feedback on the numbers from earlier rounds of the same wish."""
    said = (read(one.feedback) for one in rounds)
    return tuple(found for one in said for act in (*one.acts, *one.opinion) if (found := _correction(act)) is not None)


def _correction(act: Act) -> Feedback | None:
    """A wish for another drive as feedback on the one that has been: asked for more room, the gap was too small."""
    strength = {"bit": BIT, "much": MUCH}.get(act.degree or "", PLAIN)
    if act.negated:
        return None
    if act.style in ("gentle", "careful"):
        return Feedback("", comfort=-1, strength=strength)
    if act.act == "speed" and act.direction in ("faster", "slower"):
        return Feedback("", speed=1 if act.direction == "faster" else -1, strength=strength)
    if act.act == "gap" and act.direction in ("more", "less"):
        return Feedback("", gap=-1 if act.direction == "more" else 1, strength=strength)
    return None
