"""A polyline with stations along it: the one place that projects points onto lines."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple, Self

from chauffeur.geometry.pose import Pose

if TYPE_CHECKING:  # the command line says hello without NumPy
    import numpy as np
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

SAME_M: Final = 1e-6
"""Points that are closer together than this are one."""
_MANY_LEGS: Final = 40
"""From so many legs on those that may be the closest are chosen all at once."""


class _Leg(NamedTuple):
    """Cached quantities of a leg: start, vector, stations, direction."""

    x_m: float
    y_m: float
    dx_m: float
    dy_m: float
    start_m: float
    end_m: float
    length_m: float
    cos: float
    sin: float
    heading_rad: float


@dataclass(frozen=True)
class Polyline:
    """Straight legs through points. Beyond its ends it goes on straight.

    Attributes:
        points_m: Its corners (x, y), no two neighbours the same.
        stations_m: Distance along it to each corner.
    """

    points_m: tuple[tuple[float, float], ...]
    stations_m: tuple[float, ...]

    @classmethod
    def of(cls, points_m: Iterable[tuple[float, float]]) -> Self:
        """A polyline through points. Raises ValueError for fewer than two different ones, or one that is no number."""
        corners: list[tuple[float, float]] = []
        stations: list[float] = []
        for x, y in points_m:
            if not (math.isfinite(x) and math.isfinite(y)):
                raise ValueError(f"A polyline cannot pass through ({x}, {y}).")
            step = math.dist((x, y), corners[-1]) if corners else math.inf
            if step > SAME_M:
                stations.append(stations[-1] + step if corners else 0.0)
                corners.append((x, y))
        if len(corners) < 2:
            raise ValueError("A polyline needs two different points.")
        return cls(tuple(corners), tuple(stations))

    @property
    def length_m(self) -> float:
        """Distance from its first point to its last."""
        return self.stations_m[-1]

    @cached_property
    def points(self) -> FloatArray:
        """Its corners, (n, 2)."""
        import numpy as np

        return np.array(self.points_m)

    @cached_property
    def stations(self) -> FloatArray:
        """Distance along it to each corner, (n,)."""
        import numpy as np

        return np.array(self.stations_m)

    @cached_property
    def headings(self) -> FloatArray:
        """Heading of each leg, rad, (n - 1,)."""
        import numpy as np

        return np.array([math.atan2(dy, dx) for dx, dy in np.diff(self.points, axis=0).tolist()])

    def at(self, station_m: float) -> Pose:
        """The pose of who drives it, after a distance."""
        leg = self._legs[self._leg(station_m)]
        share = (station_m - leg.start_m) / leg.length_m
        return Pose(leg.x_m + share * leg.dx_m, leg.y_m + share * leg.dy_m, leg.heading_rad)

    def poses(self, stations_m: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(x, y, heading), each (k,), at (k,) stations: `at` of all of them at once."""
        import numpy as np

        leg = np.clip(np.searchsorted(self.stations, stations_m, side="right"), 1, len(self.stations) - 1) - 1
        here, step = self.points[leg], np.diff(self.points, axis=0)
        share = (stations_m - self.stations[leg]) / (self.stations[leg + 1] - self.stations[leg])
        return here[:, 0] + share * step[leg, 0], here[:, 1] + share * step[leg, 1], self.headings[leg]

    def every(self, step_m: float) -> FloatArray:
        """Stations from the first point on, so far apart, the last point included."""
        import numpy as np

        count = max(2, math.ceil(self.length_m / step_m) + 1)
        return np.minimum(np.arange(count) * step_m, self.length_m)

    def nearest(self, x_m: float, y_m: float, low_m: float = -math.inf, high_m: float = math.inf) -> float:
        """Station of the point closest to a place, looked for between two stations; may lie beyond the ends."""
        best, found = math.inf, low_m
        last = len(self.points_m) - 2
        first = 0 if low_m == -math.inf else self._leg(low_m)
        legs: Sequence[int] = range(first, (last if high_m == math.inf else self._leg(high_m)) + 1)
        if len(legs) > _MANY_LEGS:
            legs = self._closest_legs(x_m, y_m, legs[0], legs[-1])
        for i in legs:
            ax, ay, _, _, start, end, _, ux, uy, _ = self._legs[i]
            least = max(low_m, start) if i else low_m
            most = min(high_m, end) if i < last else high_m
            along = max(least, min(most, start + (x_m - ax) * ux + (y_m - ay) * uy))
            px, py = ax + (along - start) * ux, ay + (along - start) * uy
            distance = (x_m - px) ** 2 + (y_m - py) ** 2
            if distance < best:
                best, found = distance, along
        return found

    @cached_property
    def _legs(self) -> tuple[_Leg, ...]:
        """All of its legs."""
        legs: list[_Leg] = []
        for (ax, ay), (bx, by), start, end in zip(
            self.points_m, self.points_m[1:], self.stations_m, self.stations_m[1:], strict=False
        ):
            dx, dy, length = bx - ax, by - ay, end - start
            legs.append(_Leg(ax, ay, dx, dy, start, end, length, dx / length, dy / length, math.atan2(dy, dx)))
        return tuple(legs)

    def _closest_legs(self, x_m: float, y_m: float, first: int, last: int) -> list[int]:
        """Of many legs those that may be the closest: no other can, and the ends, which go on straight."""
        import numpy as np

        x, y, reach = self._middles
        away = np.hypot(x[first : last + 1] - x_m, y[first : last + 1] - y_m)
        near = np.flatnonzero(away - reach[first : last + 1] <= (away + reach[first : last + 1]).min() + SAME_M)
        return sorted({first, *(first + near).tolist(), last})

    @cached_property
    def _middles(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(x, y) of the middle of each leg, and half its length."""
        import numpy as np

        middle = (self.points[:-1] + self.points[1:]) / 2.0
        return middle[:, 0], middle[:, 1], np.diff(self.stations) / 2.0

    def offset(self, x_m: float, y_m: float, station_m: float) -> float:
        """Lateral offset of a place at a station, m; left is positive."""
        return self.at(station_m).sees(x_m, y_m)[1]

    def project(self, x_m: float, y_m: float) -> tuple[float, float]:
        """(station, leftward offset), m, of a place."""
        station = self.nearest(x_m, y_m)
        return station, self.offset(x_m, y_m, station)

    def curvature(self, station_m: float, span_m: float) -> float:
        """Mean curvature, 1/m, over a span ahead of a station; positive where it bends to the left."""
        turned = self.at(station_m + span_m).heading_rad - self.at(station_m).heading_rad
        return ((turned + math.pi) % (2.0 * math.pi) - math.pi) / span_m

    def between(self, low_m: float, high_m: float) -> Polyline:
        """The part between two stations. Raises ValueError where that is no part."""
        inside = [p for p, s in zip(self.points_m, self.stations_m, strict=True) if low_m < s < high_m]
        first, last = self.at(low_m), self.at(high_m)
        return Polyline.of([(first.x_m, first.y_m), *inside, (last.x_m, last.y_m)])

    def reversed(self) -> Polyline:
        """The same line, driven the other way."""
        return Polyline.of(self.points_m[::-1])

    def crossings(self, other: Polyline) -> list[tuple[float, float]]:
        """Points where two polylines cross or touch: (own station, the other's), in the order of the own ones."""
        import numpy as np

        a, b = self.points[:-1], np.diff(self.points, axis=0)
        c, d = other.points[:-1], np.diff(other.points, axis=0)
        across = b[:, None, 0] * d[None, :, 1] - b[:, None, 1] * d[None, :, 0]
        delta = c[None, :, :] - a[:, None, :]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (delta[..., 0] * d[None, :, 1] - delta[..., 1] * d[None, :, 0]) / across
            u = (delta[..., 0] * b[:, None, 1] - delta[..., 1] * b[:, None, 0]) / across
        rows, columns = np.nonzero((across != 0.0) & (t >= 0.0) & (t <= 1.0) & (u >= 0.0) & (u <= 1.0))
        own = self.stations[rows] + t[rows, columns] * np.diff(self.stations)[rows]
        others = other.stations[columns] + u[rows, columns] * np.diff(other.stations)[columns]
        return sorted(zip(own.tolist(), others.tolist(), strict=True))

    def _leg(self, station_m: float) -> int:
        """Index of the leg that a station lies on."""
        if len(self.stations_m) == 2:
            return 0
        return max(0, min(bisect_right(self.stations_m, station_m), len(self.stations_m) - 1) - 1)


def joined(lines: Sequence[Polyline]) -> Polyline:
    """Polylines one after the other as one. Raises ValueError for none."""
    return Polyline.of(point for line in lines for point in line.points_m)


def smooth(points: FloatArray, parts: int = 8) -> FloatArray:
    """Catmull-Rom through points, (n, 2) -> (m, 2): continuous headings, through every point, `parts` to a leg."""
    import numpy as np

    if len(points) == 2:
        return points
    padded = np.vstack([2.0 * points[0] - points[1], points, 2.0 * points[-1] - points[-2]])
    t = np.linspace(0.0, 1.0, parts, endpoint=False)[:, None]
    legs = [
        0.5 * (2.0 * b + (c - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d) * t**2 + (3.0 * b - a - 3.0 * c + d) * t**3)
        for a, b, c, d in zip(padded[:-3], padded[1:-2], padded[2:-1], padded[3:], strict=True)
    ]
    return np.vstack([*legs, points[-1:]])
