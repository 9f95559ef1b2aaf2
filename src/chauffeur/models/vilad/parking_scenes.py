"""Parking lots without end: fresh scenes for commands, in the geometry of the parking world, each from its number."""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import numpy as np

from chauffeur.planners.vilad.parking import BAYS, LANDMARKS, Spots
from chauffeur.worlds.parking.lot import build_lot

Array = np.ndarray[Any, Any]

FEWEST: Final = 4
MOST: Final = 24
"""Free spots of a scene."""


@cache
def _ground(aisles: int, spots_a_row: int) -> tuple[Array, Array, Array, Array]:
    """(centres (n, 2), row (n,), number within the row (n,), (min, max) of the ground (2, 2))."""
    lot = build_lot(aisles, spots_a_row)
    centres = np.array([(spot.box.x_m, -spot.box.y_m) for spot in lot.spots.values()])  # y to the south: draws stay
    rows = np.array([ord(name[0]) - ord("A") for name in lot.spots])
    numbers = np.array([int(name[1:]) - 1 for name in lot.spots])
    return centres, rows, numbers, np.array([centres.min(axis=0) - 8.0, centres.max(axis=0) + 8.0])


def scene(rng: np.random.Generator, free: int) -> Spots:
    """A lot with so many free spots: size, bays, roofs, landmarks, who stands where and the car's place are drawn."""
    while True:
        aisles, a_row = int(rng.integers(1, 5)), int(rng.integers(3, 15))
        if 2 * aisles * a_row > free:
            break
    centres, rows, numbers, ground = _ground(aisles, a_row)
    count = len(centres)
    bay = np.zeros(count, np.int64)
    for kind in range(1, len(BAYS)):
        if rng.random() < 0.85:  # a block of neighbouring spots
            row, first, many = int(rng.integers(2 * aisles)), int(rng.integers(a_row)), int(rng.integers(2, 7))
            bay[(rows == row) & (numbers >= first) & (numbers < first + many)] = kind
    covered = np.zeros(count, np.bool_)
    if rng.random() < 0.8:
        x0, x1 = np.sort(rng.uniform(ground[0, 0], ground[1, 0], 2))
        covered = (centres[:, 0] >= x0) & (centres[:, 0] <= x1)
    end = (numbers == 0) | (numbers == a_row - 1)
    empty = _who_stays_free(rng, free, bay, covered, end)
    index = np.full((2 * aisles, a_row + 2), -1)
    index[rows, numbers + 1] = np.arange(count)
    taken = np.append(~empty, False)  # beyond the ends nobody stands
    neighbours = taken[index[rows, numbers]].astype(np.int64) + taken[index[rows, numbers + 2]]
    landmarks = rng.uniform(ground[0], ground[1], (len(LANDMARKS), 2))
    landmarks[rng.random(len(LANDMARKS)) < 0.12] = np.nan
    landmarks[LANDMARKS.index("exit")] = _edge(rng, ground)
    landmarks[LANDMARKS.index("entrance")] = _edge(rng, ground)
    ego = landmarks[LANDMARKS.index("entrance")] if rng.random() < 0.6 else rng.uniform(ground[0], ground[1])
    heading = float(rng.integers(4)) * np.pi / 2.0
    turn = np.array(((np.cos(heading), np.sin(heading)), (-np.sin(heading), np.cos(heading))))
    at = (centres - ego) @ turn.T
    chosen = np.flatnonzero(empty)
    return Spots(
        at[chosen, 0],
        at[chosen, 1],
        rows[chosen],
        neighbours[chosen],
        bay[chosen],
        covered[chosen],
        end[chosen],
        (landmarks - ego) @ turn.T,
    )


def _who_stays_free(rng: np.random.Generator, free: int, bay: Array, covered: Array, end: Array) -> Array:
    """Kept spots and ends are free more often than chance would leave them: that is what is asked about."""
    weight = rng.random(len(bay)) ** (1.0 / np.where(bay > 0, 3.0, np.where(end | covered, 1.5, 1.0)))
    empty = np.zeros(len(bay), np.bool_)
    empty[np.argsort(-weight)[:free]] = True
    return empty


def _edge(rng: np.random.Generator, ground: Array) -> Array:
    place = rng.uniform(ground[0], ground[1])
    axis, side = int(rng.integers(2)), int(rng.integers(2))
    place[axis] = ground[side, axis]
    return place
