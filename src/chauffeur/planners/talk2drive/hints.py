"""Wishes that are only hinted at: "he is crawling", "my train leaves in ten minutes".

A sorter that was trained on such sentences says how likely each thing is that can be meant where we are; what the
person meant before on such roads makes the same things likelier (never certain: plain words outweigh any habit).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chauffeur.concept import History, Situation
from chauffeur.language.text_classifier import load_sorter
from chauffeur.planners.onboard.options import last_lane
from chauffeur.planners.talk2drive.explicit_overtake import told
from chauffeur.planners.talk2drive.habits import Meant, meant_before

WEIGHTS: Final = Path(__file__).parent / "weights" / "wishes.npz"

HINT_KINDS: Final[Mapping[str, tuple[str, ...]]] = {
    "highway": ("pass", "stay", "right", "faster", "slower", "hurry", "calm", "none", "else"),
    "intersection": ("go", "yield", "hurry", "calm", "none", "else"),
    "parking": ("park.nearest", "park.stadium", "park.exit", "faster", "slower", "none", "else"),
}
"""Possible meanings, by world. `none`: nothing that is for the driver; `else`: a wish of another kind, which has to be
read word by word."""

_ENDS: Final = (*".!?", "")
"""What was learned from ends so; who leaves the full stop out means the same."""
_BEHIND: Final = ("stay", "right", "slower", "faster")
"""What may be meant of who says outright that nobody is to be passed."""
_CHATS: Final = 0.6
"""From this share of `none` words are not even taken at their word: "pass the mints"."""

_SIDES: Final[Mapping[str, tuple[tuple[str, ...], ...]]] = {
    "highway": (("pass", "hurry", "faster"), ("stay", "right", "calm", "slower")),
    "intersection": (("go", "hurry"), ("yield", "calm")),
}
"""Kinds that speak for one another: who may be in a hurry, or after more speed, or past the car ahead, is not after
calm, however the likelihood of the first is split."""

_WANTS_NOTHING: Final = 2.0
"""Extra weight of `none` against whole sides: it has nothing that speaks for it, and who chats is to be left in
peace."""

_ALIKE: Final = {
    "pass": ("hurry", "faster"), "hurry": ("pass", "faster", "go"), "faster": ("hurry",), "go": ("hurry",),
    "stay": ("calm",), "calm": ("stay", "right", "slower", "yield"), "right": ("calm",), "slower": ("calm",),
    "yield": ("calm",),
}  # fmt: skip
"""Who meant the one may as well mean the other."""
_MOODS: Final = ("hurry", "calm")
_ALIKE_SHARE: Final = 0.4
_FADES: Final = 0.85
"""Weight of a trip against the one after it."""
_SAME_WORDS: Final = 0.6
"""From this similarity a wish counts as the same said again, and what it was told to mean holds."""
_SAME_WEIGHT: Final = 5.0
_COUNTS: Final = 2.0
"""What a trip adds to a kind's prior, of which nobody's history holds 1."""

_DEEDS: Final = ("pass", "right", "faster", "slower")
_READ_ALIKE: Final = 3.0
"""What makes a kind likelier that the language model read the same, if that is something to do: where it reads a mood,
or that all is to stay as it is, it has often not understood a hint."""


@dataclass(frozen=True, slots=True)
class Hint:
    """The likeliest wish behind a hint.

    Attributes:
        kind: One of the world's HINT_KINDS.
        share: How likely it is that or what speaks for it, 0..1, with what the person meant before.
        because: The trip that decided, a full sentence; empty where the words alone say it.
        outright: Whether it is no hint: it was said in so many words.
    """

    kind: str
    share: float
    because: str = ""
    outright: bool = False


def hint_of(wish: str, situation: Situation, history: History, read: str = "") -> Hint | None:
    """The likeliest wish behind words here; None on roads for which nothing was learned.

    Args:
        wish: The words.
        situation: Where the car is, and who is around it.
        history: What memory recalled of the person.
        read: The kind as which the language model read the words; empty where it did not.
    """
    kinds = _possible(situation)
    if not kinds:
        return None
    said = load_sorter(WEIGHTS).shares(wish if wish.rstrip()[-1:] in _ENDS else f"{wish.rstrip()}.", kinds)
    outright = told(wish) if "pass" in kinds and said.get("none", 0.0) < _CHATS else ""
    if outright == "pass":
        return Hint("pass", 1.0, outright=True)
    if outright == "stay":
        return Hint(max(_BEHIND, key=lambda kind: said.get(kind, 0.0)), 1.0, outright=True)
    before = meant_before(history, situation.world)
    weighed = {
        kind: share * (1.0 + _COUNTS * _weight(kind, before)) * (_READ_ALIKE if kind == read in _DEEDS else 1.0)
        for kind, share in said.items()
    }
    kind, share = _likeliest(weighed, situation.world)
    first, _ = _likeliest(said, situation.world)
    decided = next((one for one in before if one.kind == kind), None) if kind != first else None
    return Hint(kind, share, decided.because if decided is not None else "")


def _likeliest(shares: Mapping[str, float], world: str) -> tuple[str, float]:
    """The likeliest kind of the likeliest side, and the share of that side in all."""
    sides = _SIDES.get(world, ())
    on_sides = [kind for side in sides for kind in side]
    likely = {
        side: math.fsum(shares.get(kind, 0.0) for kind in side)
        for side in (*sides, *((kind,) for kind in shares if kind not in on_sides))
    }
    nothing = _WANTS_NOTHING if sides else 1.0
    side = max(likely, key=lambda each: likely[each] * (nothing if each == ("none",) else 1.0))
    return max(side, key=lambda kind: shares.get(kind, 0.0)), likely[side] / math.fsum(shares.values())


def goes_with(read: str, kind: str) -> bool:
    """True if words that were read as `read` may stand as they were read where a hint is of a kind: a mood holds what
    somebody in it is after."""
    return read == kind or (read in _MOODS and kind in _ALIKE[read])


def _weight(kind: str, before: tuple[Meant, ...]) -> float:
    total = 0.0
    for age, meant in enumerate(before):
        again = meant.corrected and meant.similarity >= _SAME_WORDS and meant.kind == kind
        total += _alike(meant.kind, kind) * (_SAME_WEIGHT if again else 1.0) * _FADES**age
    return total


def _alike(meant: str, kind: str) -> float:
    if meant.partition(".")[0] == kind.partition(".")[0]:
        return 1.0  # where to park depends on the day: who parked is likelier to park, and not at the same place
    return _ALIKE_SHARE if kind in _ALIKE.get(meant, ()) else 0.0


def _possible(situation: Situation) -> tuple[str, ...]:
    kinds = HINT_KINDS.get(situation.world, ())
    if situation.world != "highway":
        return kinds
    cannot = {
        "pass": situation.front is None or situation.lane_index == 0,
        "stay": situation.front is None,
        "right": situation.lane_index >= last_lane(situation),
    }
    return tuple(kind for kind in kinds if not cannot.get(kind))
