"""Waypoints as tokens: one token a waypoint, from a codebook; the fixed pattern that holds them.

A token stands for a displacement from where own motion and command alone would lead (`frames_baselines`), so that a
few dozen of them tell what a picture adds, at any speed. One token a quantity cannot contradict itself, as digits that
are unmasked in one step do (MVLAD-AD, 2026, went the same way from ViLaD's digit strings). What is read out of a slot
is not its likeliest token but the geometric median of its distribution: the point of least expected L2 error.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.bench.openloop.extrapolation import constant_velocity
from chauffeur.foreign.waypoints import FUTURE
from chauffeur.planners.vilad.template import ActionSlot, ActionTemplate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

CODES: Final = 64
_ROUNDS: Final = 25
_MEDIAN_ROUNDS: Final = 12


@dataclass(frozen=True)
class WaypointCodebook:
    """Displacements from an expected path.

    Attributes:
        centres: (FUTURE, codes, 2), m, ego frame.
    """

    centres: Array

    @property
    def codes(self) -> int:
        """Tokens of a slot."""
        return self.centres.shape[1]

    @cached_property
    def template(self) -> ActionTemplate:
        """`w0 , w1 , ... , w5 .`: 12 tokens, six of them decided; the same words in every slot."""
        words = tuple(f"#{i}" for i in range(self.codes))
        pieces: list[str | ActionSlot] = []
        for i in range(FUTURE):
            pieces += [ActionSlot(f"w{i}", words), "," if i + 1 < FUTURE else "."]
        return ActionTemplate(tuple(pieces))

    @cached_property
    def first(self) -> int:
        """Token id of the first code; the others follow."""
        return self.template.ids["#0"]

    def nearest(self, off: Array) -> NDArray[np.int64]:
        """Codes (n, FUTURE) of displacements (n, FUTURE, 2) of the true waypoints from the expected ones."""
        return np.linalg.norm(off[:, :, None] - self.centres[None], axis=-1).argmin(axis=-1)

    def waypoints(self, expected: Array, shares: Array) -> Array:
        """Waypoints (FUTURE, 2) round expected ones, of each slot's distribution over the codes (FUTURE, codes)."""
        return expected + np.stack([geometric_median(*pair) for pair in zip(self.centres, shares, strict=True)])


def displacements(histories: Array, futures: Array) -> Array:
    """Of waypoints from constant velocity, (n, FUTURE, 2)."""
    return futures - np.stack([constant_velocity(one) for one in histories])


def geometric_median(points: Array, weights: Array) -> Array:
    """The point (2,) of least weighted sum of distances to points (n, 2): Weiszfeld's iteration from their mean."""
    at = weights @ points / weights.sum()
    for _ in range(_MEDIAN_ROUNDS):
        pull = weights / np.maximum(np.linalg.norm(points - at, axis=1), 1e-3)
        at = pull @ points / pull.sum()
    return at


def codebook(off: Array, codes: int = CODES, seed: int = 0) -> WaypointCodebook:
    """The codebook of a training split: k-means of each waypoint's displacement, by Lloyd's rounds.

    Args:
        off: Of the true waypoints from the expected ones, (n, FUTURE, 2).
        codes: Tokens of a slot.
        seed: Of the first centres.
    """
    rng = np.random.default_rng([seed, 17])
    centres = np.zeros((FUTURE, codes, 2))
    for slot in range(FUTURE):
        own = off[:, slot]
        found = own[_spread(own, codes, rng)]
        for _ in range(_ROUNDS):
            label = np.linalg.norm(own[:, None] - found[None], axis=-1).argmin(axis=1)
            for code in range(codes):
                mine = own[label == code]
                if len(mine):
                    found[code] = mine.mean(axis=0)
        centres[slot] = found
    return WaypointCodebook(centres)


def _spread(points: Array, many: int, rng: np.random.Generator) -> list[int]:
    """First centres far apart (k-means++, Arthur and Vassilvitskii 2007), by distance instead of its square: with the
    square the rarest manoeuvres would take most codes."""
    chosen = [int(rng.integers(len(points)))]
    near = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < many:
        total = near.sum()
        chosen.append(int(rng.choice(len(points), p=near / total)) if total > 0.0 else int(rng.integers(len(points))))
        near = np.minimum(near, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen
