"""Lanes as samples in a grid: what lies on a lane, and how far a place is from all of them, for many places at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.geometry import RoadGraph

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]

STEP_M: Final = 2.0
CELL_M: Final = 16.0
"""Places farther than this from every lane count as so far."""


class LaneField:
    """Samples of all lanes of a road graph, every `STEP_M`.

    Attributes:
        places: (n, 2), m.
        headings: (n,), rad.
        halves: Half widths (n,), m.
        lanes: Row of the lane in the graph (n,).
    """

    def __init__(self, road: RoadGraph) -> None:
        """Args: the road."""
        xs: list[FloatArray] = []
        ys: list[FloatArray] = []
        headings: list[FloatArray] = []
        rows: list[IntArray] = []
        for row, lane in enumerate(road.lanes):
            x, y, heading = lane.centre.poses(lane.centre.every(STEP_M))
            xs.append(x)
            ys.append(y)
            headings.append(heading)
            rows.append(np.full(len(x), row))
        self.places = np.stack([np.concatenate(xs), np.concatenate(ys)], axis=1)
        self.headings = np.concatenate(headings)
        self.lanes = np.concatenate(rows)
        self.halves = np.array([lane.width_m / 2.0 for lane in road.lanes])[self.lanes]
        cells = np.floor(self.places / CELL_M).astype(np.int64)
        self._low = cells.min(axis=0) - 1
        self._wide = int(np.ptp(cells[:, 1])) + 3
        keys = self._keys(cells)
        self._order = np.argsort(keys, kind="stable")
        self._sorted = keys[self._order]

    def _keys(self, cells: IntArray) -> IntArray:
        inside = cells - self._low
        keys = inside[:, 0] * self._wide + inside[:, 1]
        return np.where((inside[:, 0] < 0) | (inside[:, 1] < 0) | (inside[:, 1] >= self._wide), -1, keys)

    def pairs(self, places: FloatArray) -> tuple[IntArray, IntArray]:
        """(query, sample) rows of all samples in the cell of each place and the eight round it."""
        cells = np.floor(places / CELL_M).astype(np.int64)
        round_ = np.array([(dx, dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)])
        keys = self._keys((cells[:, None] + round_).reshape(-1, 2))
        low = np.searchsorted(self._sorted, keys, "left")
        count = np.where(keys < 0, 0, np.searchsorted(self._sorted, keys, "right") - low)
        first = np.cumsum(count) - count
        samples = self._order[np.arange(int(count.sum())) - np.repeat(first, count) + np.repeat(low, count)]
        return np.repeat(np.repeat(np.arange(len(places)), 9), count), samples

    def clearance(self, places: FloatArray) -> FloatArray:
        """Distance of each place from the edge of the nearest lane, m, (n,); `CELL_M` at most; negative on a lane."""
        queries, samples = self.pairs(places)
        away = np.linalg.norm(places[queries] - self.places[samples], axis=1) - self.halves[samples]
        found = np.full(len(places), CELL_M)
        np.minimum.at(found, queries, away)
        return found

    def covering(self, places: FloatArray, margin_m: float = 0.3) -> IntArray:
        """Row of the sample whose lane a place lies on, -1 for none, (n,)."""
        queries, samples = self.pairs(places)
        delta = places[queries] - self.places[samples]
        c, s = np.cos(self.headings[samples]), np.sin(self.headings[samples])
        along, across = c * delta[:, 0] + s * delta[:, 1], c * delta[:, 1] - s * delta[:, 0]
        on = (np.abs(along) <= STEP_M * 0.75) & (np.abs(across) <= self.halves[samples] + margin_m)
        found = np.full(len(places), -1)
        # Of several the one whose middle is nearest: written last.
        order = np.argsort(-np.abs(across[on]), kind="stable")
        found[queries[on][order]] = samples[on][order]
        return found
