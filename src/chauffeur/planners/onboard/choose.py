"""From meaning to program: which exemplar, with which numbers, in this situation; or why not, in words.

What the person names is taken as named: 200 km/h is planned as 200 km/h and left to the safety checks to refuse.
What the planner chooses itself stays inside the limits it was told.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from chauffeur.concept import Limits, Situation
from chauffeur.planners.onboard.choose_gap import choose_follow, choose_gap, choose_yield
from chauffeur.planners.onboard.choose_road import (
    choose_lane,
    choose_overtake,
    choose_pull_over,
    choose_stop,
    choose_turn,
)
from chauffeur.planners.onboard.choose_speed import choose_resume, choose_speed, choose_style
from chauffeur.planners.onboard.meaning import Manoeuvre, Meaning
from chauffeur.planners.onboard.options import Chosen, Declined, Options
from chauffeur.planners.onboard.personal import Leaning

_CHOOSERS: dict[Manoeuvre, Callable[[Meaning, Options], Chosen | Declined]] = {
    "speed": choose_speed,
    "gap": choose_gap,
    "follow": choose_follow,
    "yield": choose_yield,
    "lane": choose_lane,
    "overtake": choose_overtake,
    "turn": choose_turn,
    "pull_over": choose_pull_over,
    "stop": choose_stop,
    "style": choose_style,
    "keep": choose_resume,
    "resume": choose_resume,
}


@dataclass(frozen=True, slots=True)
class Choice:
    """Exemplars for all steps of a wish; `intent` joins their tags with `+`."""

    steps: tuple[Chosen, ...]
    intent: str

    def settings(self, used: Sequence[Leaning]) -> tuple[tuple[str, float], ...]:
        """Numbers the program relies on, and what the person's history added to them; of one name, the last counts."""
        pairs = [pair for part in (*self.steps, *used) for pair in part.settings]
        return tuple(dict(pairs).items())


def choose(
    meanings: Sequence[Meaning],
    situation: Situation,
    limits: Limits,
    leaning: Callable[[str], Leaning],
    *,
    wary: bool = False,
    joins: bool = True,
) -> Choice | Declined:
    """Exemplars and numbers for a wish, or the reason why this road or situation does not allow it.

    Args:
        meanings: What was understood, in order.
        situation: Where we are.
        limits: Bounds for what the planner chooses itself.
        leaning: What this person's history says about an intent.
        wary: Whether they say that the road is slippery or the sight bad.
        joins: Whether an overtaking and the way back to its lane are one step.
    """
    steps: list[Chosen] = []
    options = Options(situation, limits, wary=wary)
    waiting = list(meanings)
    while waiting:
        meaning = waiting.pop(0)
        options = options.with_leaning(leaning(meaning.family))
        chosen = _CHOOSERS[meaning.manoeuvre](meaning, options)
        if joins and isinstance(chosen, Chosen) and waiting and _comes_back(chosen, waiting[0]):
            # "overtake it, then move back right": one manoeuvre with its return
            del waiting[0]
            chosen = _CHOOSERS["overtake"](replace(meaning, variant="return"), options)
        if isinstance(chosen, Declined):
            return chosen
        steps.append(chosen)
        options = options.after(chosen)
    return Choice(tuple(steps), "+".join(step.intent for step in steps))


def _comes_back(overtaking: Chosen, following: Meaning) -> bool:
    """True if a lane wish leads back to where the overtaking began."""
    back = {"overtake.left": "right", "overtake.right": "left"}.get(overtaking.intent)
    return back is not None and following.manoeuvre == "lane" and not following.variant and following.direction == back
