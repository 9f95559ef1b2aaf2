"""A polyline with stations along it: the one place that projects points onto lines."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final, Self

from chauffeur.geometry.pose import Pose

if TYPE_CHECKING:  # the command line says hello without NumPy
    import numpy as np
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

SAME_M: Final = 1e-6
"""Points that are closer together than this are one."""


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
        stations = self.stations_m
        low = self._leg(station_m)
        (ax, ay), (bx, by) = self.points_m[low], self.points_m[low + 1]
        share = (station_m - stations[low]) / (stations[low + 1] - stations[low])
        return Pose(ax + share * (bx - ax), ay + share * (by - ay), math.atan2(by - ay, bx - ax))

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
        for i in range(self._leg(low_m), self._leg(high_m) + 1):
            (ax, ay), (bx, by) = self.points_m[i], self.points_m[i + 1]
            start, end = self.stations_m[i], self.stations_m[i + 1]
            least = max(low_m, start if i else -math.inf)
            most = min(high_m, end if i < last else math.inf)
            length = end - start
            ux, uy = (bx - ax) / length, (by - ay) / length
            along = max(least, min(most, start + (x_m - ax) * ux + (y_m - ay) * uy))
            px, py = ax + (along - start) * ux, ay + (along - start) * uy
            distance = (x_m - px) ** 2 + (y_m - py) ** 2
            if distance < best:
                best, found = distance, along
        return found

    def offset(self, x_m: float, y_m: float, station_m: float) -> float:
        """How far left of the polyline a place lies at a station, m; negative to its right."""
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
        """Where two polylines cross or touch: (own station, the other's), in the order of the own ones."""
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
        return max(0, min(bisect_right(self.stations_m, station_m), len(self.stations_m) - 1) - 1)


def joined(lines: Sequence[Polyline]) -> Polyline:
    """Polylines one after the other as one. Raises ValueError for none."""
    return Polyline.of(point for line in lines for point in line.points_m)
