"""Choice of a free spot: the criteria, the features of spots, the pattern of the answer, and the optimum.

The answer says first how the words were understood, a token for each thing that can be asked for, and then points at
the spot. Both are decided by one network in one pattern, so the reasons R and the policy P come from the same pass, and
whether they agree can be computed: `best` knows the optimal spots for what was understood.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from chauffeur.concept import ParkingLot
from chauffeur.planners.vilad.template import MASK, ActionSlot, ActionTemplate
from chauffeur.planners.vilad.unmasking import Decided, Predict

Array = np.ndarray[Any, Any]

LANDMARKS: Final = ("lift", "stairs", "machine", "gate", "exit", "entrance")
"""Places that a spot can be near to or far from: the last two are where cars leave and enter, `gate` is the building's
door for people, `machine` where one pays."""
BAYS: Final = ("plain", "ev", "accessible", "family")
"""Kinds of spots. Whoever asks for none gets a plain one: the others are kept for those who need them."""
ROWS: Final = tuple("ABCDEFGHIJKL")
NONE: Final = "-"

TEMPLATE: Final = ActionTemplate(
    (
        *(piece for name in LANDMARKS for piece in (name, ActionSlot(name, (NONE, "near", "far")))),
        "soon",
        ActionSlot("soon", (NONE, "yes")),
        "apart",
        ActionSlot("apart", (NONE, "yes")),
        "bay",
        ActionSlot("bay", BAYS),
        "covered",
        ActionSlot("covered", (NONE, "yes")),
        "end",
        ActionSlot("end", (NONE, "yes")),
        ";",
        "row",
        ActionSlot("row", (NONE, *ROWS)),
        "spot",
        ActionSlot("spot", pointer=True),
        ".",
    )
)
"""13 decisions among 28 tokens. Candidate 0 of `spot` says that no free spot is what is asked for."""
CRITERIA: Final = tuple(slot.name for slot in TEMPLATE.slots if slot.name not in ("row", "spot"))
NOTHING: Final[Mapping[str, str]] = {name: "plain" if name == "bay" else NONE for name in CRITERIA}
"""Default when nothing is asked for."""

WIDTH: Final = len(LANDMARKS) + 2 + len(BAYS) + 2 + 1 + len(ROWS)
"""Numbers by which a candidate is described."""
SCALE_M: Final = 50.0
NEIGHBOUR_M: Final = 20.0
"""Walking that is as bad as one neighbour, to somebody who wants none."""
TIE_M: Final = 2.0
"""Spots that differ by less are equally good."""


@dataclass(frozen=True, slots=True)
class Spots:
    """Free spots as the car sees them.

    Attributes:
        x_m, y_m: Centres in the ego frame, (n,).
        row: Index into `ROWS`, (n,).
        neighbours: Cars directly beside it, 0 to 2, (n,).
        bay: Index into `BAYS`, (n,).
        covered: Under a roof, (n,).
        end: First or last of its row, (n,).
        landmarks_m: Where each of `LANDMARKS` is in the ego frame, NaN where there is none, (6, 2).
    """

    x_m: Array
    y_m: Array
    row: Array
    neighbours: Array
    bay: Array
    covered: Array
    end: Array
    landmarks_m: Array

    def __len__(self) -> int:
        return len(self.x_m)

    @property
    def walks_m(self) -> Array:
        """From each spot to each landmark, (n, 6); 0 to those that are not there."""
        dx = self.x_m[:, None] - self.landmarks_m[None, :, 0]
        dy = self.y_m[:, None] - self.landmarks_m[None, :, 1]
        return np.nan_to_num(np.hypot(dx, dy), nan=0.0)

    @property
    def drives_m(self) -> Array:
        """From the car to each spot along rows and aisles, (n,)."""
        return np.abs(self.x_m) + np.abs(self.y_m)

    def features(self) -> Array:
        """Candidates for the network, (1 + n, WIDTH), float32; the first is "no spot"."""
        count = len(self)
        found = np.zeros((1 + count, WIDTH), np.float32)
        columns = (
            self.walks_m / SCALE_M,
            self.drives_m[:, None] / SCALE_M,
            self.neighbours[:, None] / 2.0,
            np.eye(len(BAYS))[self.bay],
            self.covered[:, None],
            self.end[:, None],
            np.zeros((count, 1)),
            np.eye(len(ROWS))[self.row],
        )
        found[1:] = np.concatenate([np.asarray(part, np.float32) for part in columns], axis=1)
        found[0, WIDTH - len(ROWS) - 1] = 1.0
        return found


def free_spots(lot: ParkingLot, names: Sequence[str] = ()) -> tuple[Spots, tuple[str, ...]]:
    """(the free spots of a lot in the ego frame, their names).

    Args:
        lot: As a context has it.
        names: Only these are looked at; all where there are none.
    """
    found = [spot for spot in lot.spots if spot.free and spot.name[0] in ROWS and (not names or spot.name in names)]
    where = {name: (x, y) for name, x, y in lot.landmarks}
    nowhere = (math.nan, math.nan)
    spots = Spots(
        np.array([spot.x_m for spot in found]),
        np.array([spot.y_m for spot in found]),
        np.array([ROWS.index(spot.name[0]) for spot in found], np.int64),
        np.array([spot.neighbours for spot in found], np.int64),
        np.array([BAYS.index(spot.kind) for spot in found], np.int64),
        np.array([spot.covered for spot in found], np.bool_),
        np.array([spot.row_end for spot in found], np.bool_),
        np.array([where.get(name, nowhere) for name in LANDMARKS]),
    )
    return spots, tuple(spot.name for spot in found)


def costs_m(spots: Spots, asked: Mapping[str, str]) -> Array:
    """Cost of each spot in metres of walking, (n,); infinite where it does not fit.

    Near and far count the walk, `soon` the drive, `apart` 20 m a neighbour. A kind of bay, cover and the end of a row
    are conditions. Somebody who asks for none of the former gets the spot that is reached first.
    """
    walks = spots.walks_m
    total = np.zeros(len(spots))
    wished = False
    for place, name in enumerate(LANDMARKS):
        if asked[name] != NONE:
            total += walks[:, place] if asked[name] == "near" else -walks[:, place]
            wished = True
    if asked["apart"] == "yes":
        total += NEIGHBOUR_M * spots.neighbours
        wished = True
    if asked["soon"] == "yes" or not wished:
        total += spots.drives_m
    fits = spots.bay == BAYS.index(asked["bay"])
    if asked["covered"] == "yes":
        fits = fits & spots.covered
    if asked["end"] == "yes":
        fits = fits & spots.end
    return np.where(fits, total, np.inf)


def best(spots: Spots, asked: Mapping[str, str]) -> tuple[int, Array]:
    """(the best candidate, which candidates are as good), the latter bool (1 + n,)."""
    costs = costs_m(spots, asked)
    good = np.zeros(len(spots) + 1, np.bool_)
    if not np.isfinite(costs).any():
        good[0] = True
        return 0, good
    good[1:] = costs <= costs.min() + TIE_M
    return 1 + int(costs.argmin()), good


def answer(spots: Spots, asked: Mapping[str, str], candidate: int) -> dict[str, str | int]:
    """Values of the template's slots."""
    row = NONE if candidate == 0 else ROWS[int(spots.row[candidate - 1])]
    return {**asked, "row": row, "spot": candidate}


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement between the parts of an answer.

    Attributes:
        row: The named row is that of the spot.
        spot: The spot is among the best for what was understood: P does what R says.
    """

    row: bool
    spot: bool


def agreement(spots: Spots, values: Mapping[str, str | int]) -> Agreement:
    """Internal consistency of an answer."""
    asked = {name: str(values[name]) for name in CRITERIA}
    candidate = int(values["spot"])
    row = answer(spots, asked, candidate)["row"] == values["row"]
    return Agreement(row, bool(best(spots, asked)[1][candidate]))


def verified(predict: Predict, spots: Spots, decided: Decided) -> Decided:
    """A decision whose spot is among the best for what it says it understood.

    Where it is not, row and spot are masked again and decided among the best alone, which costs one pass more.
    """
    values = TEMPLATE.decode(decided.row)
    agrees = agreement(spots, values)
    if agrees.spot and agrees.row:
        return decided
    asked = asked_of(values)
    row = decided.row.copy()
    for name in ("row", "spot"):
        row[TEMPLATE.places[name]] = MASK
    scores = predict(row)[TEMPLATE.places["spot"], TEMPLATE.size :]
    candidate = int(np.where(best(spots, asked)[1], scores, -np.inf).argmax())
    return replace(decided, row=TEMPLATE.encode(answer(spots, asked, candidate)), passes=decided.passes + 1)


def asked_of(values: Mapping[str, str | int]) -> dict[str, str]:
    """The criteria among an answer's values."""
    return {name: str(values[name]) for name in CRITERIA}


_SAID: Final[Mapping[str, str]] = {
    "lift": "the lift",
    "stairs": "the stairs",
    "machine": "the pay machine",
    "gate": "the building",
    "exit": "the exit",
    "entrance": "the entrance",
}
_KINDS: Final[Mapping[str, str]] = {
    "ev": "with a charger",
    "accessible": "for disabled people",
    "family": "for families",
}


def in_words(asked: Mapping[str, str]) -> str:
    """The criteria as a phrase that follows "a spot"."""
    said = [f"near {_SAID[name]}" for name in LANDMARKS if asked[name] == "near"]
    said += [f"far from {_SAID[name]}" for name in LANDMARKS if asked[name] == "far"]
    said += ["away from other cars"] if asked["apart"] == "yes" else []
    said += [_KINDS[asked["bay"]]] if asked["bay"] in _KINDS else []
    said += ["under a roof"] if asked["covered"] == "yes" else []
    said += ["at the end of a row"] if asked["end"] == "yes" else []
    said += ["that is reached soon"] if asked["soon"] == "yes" or not said else []
    return _listed(said)


def _listed(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
