"""Plan view of a road: the reference line as lines, arcs, spirals and cubics, evaluated at many stations at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from chauffeur.geometry.polyline import FloatArray

_STEP_M: Final = 0.5
"""Step of numeric integration along spirals and cubics."""
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(5)


class Cubics:
    """Piecewise cubic a + b·d + c·d² + d·d³ of the distance d from each piece's start; zero where there is no piece."""

    def __init__(self, pieces: Sequence[tuple[float, float, float, float, float]]) -> None:
        """Pieces (start, a, b, c, d); a later piece of the same start wins, as the standard says."""
        table = np.array(sorted(pieces, key=lambda piece: piece[0])).reshape(-1, 5)
        self._starts, self._factors = table[:, 0], table[:, 1:]

    @property
    def known(self) -> bool:
        """True if there is a piece at all."""
        return bool(len(self._starts))

    @property
    def straight(self) -> bool:
        """True if it is the same everywhere."""
        return not self._factors[:, 1:].any() and len({*self._factors[:, 0].tolist()}) <= 1

    def __call__(self, stations: FloatArray) -> FloatArray:
        """Values (n,) at stations (n,); before the first piece, that piece's."""
        if not len(self._starts):
            return np.zeros(len(stations))
        piece = np.clip(np.searchsorted(self._starts, stations, side="right") - 1, 0, None)
        a, b, c, d = self._factors[piece].T
        along = stations - self._starts[piece]
        return a + along * (b + along * (c + along * d))


@dataclass(frozen=True, slots=True)
class Piece:
    """One `<geometry>`: where it starts, and what it is.

    Attributes:
        start_m: Station on the reference line.
        x_m, y_m, heading_rad: Pose at its start.
        length_m: Length along the line.
        kind: line, arc, spiral, poly3 or paramPoly3.
        factors: arc (curvature), spiral (curvature at start, at end), poly3 (a, b, c, d), paramPoly3 (aU … dV).
        normalised: Of paramPoly3: its parameter runs from 0 to 1 instead of along the length.
    """

    start_m: float
    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    kind: str
    factors: tuple[float, ...] = ()
    normalised: bool = False

    def local(self, along: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(u, v, heading), each (n,), in the frame of its start, after distances (n,)."""
        if self.kind == "line":
            return along, np.zeros_like(along), np.zeros_like(along)
        if self.kind == "arc" and self.factors[0] != 0.0:
            curvature = self.factors[0]
            turned = along * curvature
            return np.sin(turned) / curvature, (1.0 - np.cos(turned)) / curvature, turned
        if self.kind in ("arc", "spiral"):
            return self._spiral(along)
        return self._cubic(along)

    def _spiral(self, along: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Clothoid: heading is a quadratic of the distance; the position its integral (Gauss-Legendre, five nodes)."""
        first, last = self.factors if self.kind == "spiral" else (self.factors[0], self.factors[0])
        growth = (last - first) / self.length_m if self.length_m else 0.0
        grid = np.unique(np.concatenate((np.arange(0.0, self.length_m + _STEP_M, _STEP_M), along)))
        half = np.diff(grid) / 2.0
        at = (grid[:-1] + half)[:, None] + half[:, None] * _GAUSS_NODES
        heading = at * (first + growth * at / 2.0)
        u = np.concatenate(((0.0,), np.cumsum(half * (np.cos(heading) @ _GAUSS_WEIGHTS))))
        v = np.concatenate(((0.0,), np.cumsum(half * (np.sin(heading) @ _GAUSS_WEIGHTS))))
        return np.interp(along, grid, u), np.interp(along, grid, v), along * (first + growth * along / 2.0)

    def _cubic(self, along: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Cubics of a parameter; where that is no distance, it is found from a table of arc lengths."""
        if self.kind == "poly3":
            us, vs = (0.0, 1.0, 0.0, 0.0), self.factors
            grid = np.linspace(0.0, self.length_m, max(2, int(self.length_m / 0.05)))
            slope = vs[1] + grid * (2.0 * vs[2] + grid * 3.0 * vs[3])
            speed = np.hypot(1.0, slope)
            lengths = np.concatenate(((0.0,), np.cumsum(np.diff(grid) * (speed[:-1] + speed[1:]) / 2.0)))
            p = np.interp(along, lengths, grid)
        else:
            us, vs = self.factors[:4], self.factors[4:]
            p = along / self.length_m if self.normalised and self.length_m else along
        u = us[0] + p * (us[1] + p * (us[2] + p * us[3]))
        v = vs[0] + p * (vs[1] + p * (vs[2] + p * vs[3]))
        du = us[1] + p * (2.0 * us[2] + p * 3.0 * us[3])
        dv = vs[1] + p * (2.0 * vs[2] + p * 3.0 * vs[3])
        return u, v, np.arctan2(dv, du)


@dataclass(frozen=True)
class ReferenceLine:
    """The `<planView>` of a road, its pieces in order."""

    pieces: tuple[Piece, ...]

    def __call__(self, stations: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(x, y, heading), each (n,), at stations (n,); beyond its ends the end pieces go on."""
        starts = np.array([piece.start_m for piece in self.pieces])
        owner = np.clip(np.searchsorted(starts, stations, side="right") - 1, 0, None)
        x, y, heading = np.empty(len(stations)), np.empty(len(stations)), np.empty(len(stations))
        for row in np.unique(owner).tolist():
            piece, mine = self.pieces[row], owner == row
            u, v, turned = piece.local(stations[mine] - piece.start_m)
            cos, sin = np.cos(piece.heading_rad), np.sin(piece.heading_rad)
            x[mine] = piece.x_m + u * cos - v * sin
            y[mine] = piece.y_m + u * sin + v * cos
            heading[mine] = piece.heading_rad + turned
        return x, y, heading
