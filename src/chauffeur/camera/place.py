"""Surroundings of a road: buildings, vegetation, street lamps, guardrails; a function of road graph and seed."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from chauffeur.camera.ground import FAST_MPS, Edge, PavedMesh, pave
from chauffeur.camera.lane_field import LaneField
from chauffeur.camera.solids import Material, Pile, SemanticClass, Shape, Solids
from chauffeur.geometry import Box, RoadGraph, overlap

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

Surroundings = Literal["country", "town", "lot"]

FACADES: Final = (
    ((0.62, 0.42, 0.34), (0.74, 0.70, 0.62), (0.56, 0.56, 0.58), (0.80, 0.76, 0.70),
     (0.50, 0.34, 0.28), (0.66, 0.60, 0.50)),
    ((0.44, 0.50, 0.46), (0.86, 0.74, 0.60), (0.70, 0.50, 0.44), (0.48, 0.44, 0.52),
     (0.80, 0.82, 0.80), (0.58, 0.46, 0.30)),
    ((0.42, 0.46, 0.54), (0.60, 0.64, 0.70), (0.82, 0.84, 0.88), (0.34, 0.36, 0.42),
     (0.70, 0.62, 0.56), (0.52, 0.56, 0.52)),
)  # fmt: skip
LEAVES: Final = (
    ((0.20, 0.36, 0.13), (0.26, 0.42, 0.16), (0.15, 0.29, 0.13), (0.32, 0.42, 0.15)),
    ((0.44, 0.40, 0.14), (0.52, 0.33, 0.12), (0.34, 0.36, 0.12), (0.48, 0.26, 0.12)),
    ((0.12, 0.34, 0.22), (0.16, 0.40, 0.26), (0.10, 0.26, 0.20), (0.22, 0.38, 0.30)),
)
"""By palette: summer, autumn, and a bluish green."""


@dataclass(frozen=True)
class CameraPlace:
    """A road and what stands along it, in the frame of the road graph.

    Attributes:
        road: The lanes.
        field: Their samples.
        ground: Their triangles.
        solids: Buildings, vegetation, poles.
        lamps_m: Street lamps (n, 3).
        surroundings: Kind of neighbourhood.
    """

    road: RoadGraph
    field: LaneField
    ground: PavedMesh
    solids: Solids
    lamps_m: FloatArray
    surroundings: Surroundings


def place_of(road: RoadGraph, seed: int, palette: int = 0) -> CameraPlace:
    """The place of a road graph; same seed, same place, whoever looks from where."""
    field = LaneField(road)
    ground = pave(road, field)
    kinds = {lane.kind for lane in road.lanes}
    if kinds & {"aisle", "parking"} and "driving" not in kinds:
        surroundings: Surroundings = "lot"
    elif max(lane.speed_limit_mps for lane in road.lanes) > FAST_MPS:
        surroundings = "country"
    else:
        surroundings = "town"
    builder = _Builder(road, field, seed, palette)
    for edge in ground.edges:
        builder.along(edge, surroundings)
    builder.build()
    builder.plant()
    lamps = np.array(builder.lamps, float).reshape(-1, 3)
    return CameraPlace(road, field, ground, builder.pile.solids(), lamps, surroundings)


class _Builder:
    def __init__(self, road: RoadGraph, field: LaneField, seed: int, palette: int) -> None:
        self.pile = Pile()
        self.lamps: list[tuple[float, float, float]] = []
        self._road, self._field, self._seed, self._palette = road, field, seed, palette
        self._houses: dict[tuple[int, int], list[Box]] = {}
        self._plots: list[tuple[Box, int, FloatArray]] = []
        self._trees: list[tuple[float, float, float, int]] = []
        self._posts: list[tuple[float, float, float]] = []

    def along(self, edge: Edge, surroundings: Surroundings) -> None:
        """Surroundings along one edge of the road."""
        lane = self._road.lanes[edge.lane]
        if lane.kind == "parking" or not edge.open.any():
            return
        rng = np.random.default_rng([self._seed, zlib.crc32(lane.id.encode()), edge.side + 1])
        steps = np.linalg.norm(np.diff(edge.places, axis=0), axis=1)
        stations = np.concatenate([[0.0], np.cumsum(steps)])
        length = float(stations[-1])
        fast = lane.speed_limit_mps >= FAST_MPS
        if not lane.junction:
            self._lamp_posts(edge, stations, length, rng, 55.0 if fast else 32.0)
            if fast:
                self._guardrail(edge, stations, length)
        if surroundings == "town" and not lane.junction:
            self._row_of_houses(edge, stations, length, rng)
        elif surroundings == "lot":
            self._row_of_houses(edge, stations, length, rng, setback_m=14.0, often=0.5)
        else:
            self._scattered_houses(edge, stations, length, rng)
        self._row_of_trees(edge, stations, length, rng, surroundings)

    def _at(self, edge: Edge, stations: FloatArray, station: float, out_m: float) -> tuple[float, float, float] | None:
        """(x, y, heading of the road) so far off an edge; None where the road goes on there."""
        i = min(int(np.searchsorted(stations, station)), len(stations) - 1)
        if not edge.open[i]:
            return None
        x = float(np.interp(station, stations, edge.places[:, 0]))
        y = float(np.interp(station, stations, edge.places[:, 1]))
        away = float(edge.outward[i])
        return x + out_m * math.cos(away), y + out_m * math.sin(away), away - edge.side * math.pi / 2.0

    def _free(self, places: list[tuple[float, float]], need_m: list[float]) -> NDArray[np.bool_]:
        if not places:
            return np.zeros(0, bool)
        return self._field.clearance(np.array(places)) >= np.minimum(np.array(need_m), 15.9)

    # Buildings --------------------------------------------------------------------------------------------------------

    def _row_of_houses(
        self, edge: Edge, stations: FloatArray, length: float, rng: np.random.Generator,
        setback_m: float = 4.2, often: float = 0.86,
    ) -> None:  # fmt: skip
        station = float(rng.uniform(0.0, 6.0))
        while station < length:
            front, deep = float(rng.uniform(10.0, 24.0)), float(rng.uniform(9.0, 15.0))
            floors = int(rng.choice([1, 2, 3, 4, 5, 7], p=[0.10, 0.27, 0.25, 0.2, 0.12, 0.06]))
            back = setback_m + float(rng.uniform(0.0, 3.5))
            kept, draw = rng.random() < often, rng.random(4)
            at = self._at(edge, stations, min(station + front / 2.0, length), back + deep / 2.0)
            station += front + (float(rng.uniform(0.5, 2.0)) if rng.random() < 0.6 else float(rng.uniform(5.0, 14.0)))
            if kept and at is not None:
                self._house(Box(*at, front, deep), floors, draw)

    def _scattered_houses(self, edge: Edge, stations: FloatArray, length: float, rng: np.random.Generator) -> None:
        station = float(rng.uniform(0.0, 90.0))
        while station < length:
            front, deep, out = (float(rng.uniform(*bounds)) for bounds in ((10.0, 22.0), (9.0, 16.0), (28.0, 75.0)))
            floors, draw = int(rng.integers(1, 4)), rng.random(4)
            at = self._at(edge, stations, station, out)
            if at is not None:
                self._house(Box(at[0], at[1], at[2] + float(rng.uniform(-0.5, 0.5)), front, deep), floors, draw)
            station += float(rng.uniform(40.0, 150.0))

    def _house(self, box: Box, floors: int, draw: FloatArray) -> None:
        self._plots.append((box, floors, draw))

    def build(self) -> None:
        """Put the houses down that stand neither on a lane nor in another."""
        rings = [_ring(box) for box, _, _ in self._plots]
        clear = self._free([place for ring in rings for place in ring], [2.8] * (9 * len(rings)))
        free: list[bool] = [bool(one.all()) for one in clear.reshape(-1, 9)]
        for ok, plot in zip(free, self._plots, strict=True):
            if ok:
                self._put_house(*plot)

    def _put_house(self, box: Box, floors: int, draw: FloatArray) -> None:
        cell = math.floor(box.x_m / 40.0), math.floor(box.y_m / 40.0)
        near = [
            one for dx in (-1, 0, 1) for dy in (-1, 0, 1) for one in self._houses.get((cell[0] + dx, cell[1] + dy), [])
        ]
        if any(overlap(box, one) for one in near):
            return
        self._houses.setdefault(cell, []).append(box)
        colours = FACADES[self._palette % len(FACADES)]
        colour = colours[int(draw[0] * len(colours))]
        shade = 0.88 + 0.24 * float(draw[1])
        colour = (colour[0] * shade, colour[1] * shade, colour[2] * shade)
        height = 3.3 * floors + 0.8
        label = SemanticClass.BUILDING
        self.pile.add(
            Shape.BOX, (box.x_m, box.y_m, height / 2.0), (box.length_m, box.width_m, height), colour,
            yaw=box.heading_rad, material=Material.FACADE, glow=float(draw[2]), label=label,
        )  # fmt: skip
        if floors <= 3 and draw[3] < 0.7:
            roof = (0.34, 0.20, 0.16) if draw[2] < 0.5 else (0.25, 0.25, 0.27)
            self.pile.add(
                Shape.BOX, (box.x_m, box.y_m, height + 1.3), (box.length_m + 0.6, box.width_m + 0.8, 2.6), roof,
                yaw=box.heading_rad, taper=(0.82, 0.05), label=label,
            )  # fmt: skip
        else:
            self.pile.add(
                Shape.BOX, (box.x_m, box.y_m, height + 0.25), (box.length_m + 0.3, box.width_m + 0.3, 0.5),
                (0.40, 0.40, 0.41), yaw=box.heading_rad, label=label,
            )  # fmt: skip

    # Posts and rails --------------------------------------------------------------------------------------------------

    def _lamp_posts(
        self, edge: Edge, stations: FloatArray, length: float, rng: np.random.Generator, apart_m: float
    ) -> None:
        station = float(rng.uniform(4.0, apart_m))
        tall = 9.0 if apart_m > 40.0 else 6.5
        spots = [
            self._at(edge, stations, at, 1.6 if tall < 8.0 else 3.4)
            for at in np.arange(station, length, apart_m).tolist()
        ]
        posts = [at for at in spots if at is not None]
        for ok, at in zip(self._free([at[:2] for at in posts], [0.9] * len(posts)).tolist(), posts, strict=True):
            if not ok:
                continue
            if any(math.dist(at[:2], post[:2]) < apart_m * 0.45 for post in self._posts[-60:]):
                continue
            self._posts.append((*at[:2], 0.3))
            inward = at[2] - edge.side * math.pi / 2.0
            grey, label = (0.42, 0.43, 0.45), SemanticClass.POLE
            reach = 2.4
            cx, cy = math.cos(inward), math.sin(inward)
            self.pile.add(
                Shape.CYLINDER, (at[0], at[1], tall / 2.0), (0.2, 0.2, tall), grey, taper=(0.6, 0.6), label=label
            )
            self.pile.add(
                Shape.BOX, (at[0] + cx * reach / 2.0, at[1] + cy * reach / 2.0, tall), (reach, 0.1, 0.1), grey,
                yaw=inward, label=label,
            )  # fmt: skip
            end = at[0] + cx * reach, at[1] + cy * reach
            self.pile.add(
                Shape.BOX, (*end, tall - 0.05), (0.7, 0.28, 0.14), (0.9, 0.86, 0.75), yaw=inward,
                material=Material.LAMP, glow=-1.0, label=label,
            )  # fmt: skip
            self.lamps.append((*end, tall - 0.1))

    def _guardrail(self, edge: Edge, stations: FloatArray, length: float) -> None:
        places = [self._at(edge, stations, s, 2.6) for s in np.arange(0.0, length + 8.0, 8.0).tolist()]
        found = [at for at in places if at is not None]
        free = iter(self._free([at[:2] for at in found], [1.2] * len(found)).tolist())
        kept = [at if at is not None and next(free) else None for at in places]
        for a, b in pairwise(kept):
            if a is None or b is None:
                continue
            middle = (a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0
            run, yaw = math.dist(a[:2], b[:2]), math.atan2(b[1] - a[1], b[0] - a[0])
            if run < 0.5 or run > 12.0:
                continue
            label = SemanticClass.GUARDRAIL
            self.pile.add(Shape.BOX, (*middle, 0.62), (run, 0.1, 0.32), (0.66, 0.68, 0.70), yaw=yaw, label=label)
            self.pile.add(Shape.BOX, (*a[:2], 0.38), (0.12, 0.12, 0.76), (0.5, 0.5, 0.52), yaw=yaw, label=label)

    # Vegetation -------------------------------------------------------------------------------------------------------

    def _row_of_trees(
        self, edge: Edge, stations: FloatArray, length: float, rng: np.random.Generator, surroundings: Surroundings
    ) -> None:
        every, near, far = {"town": (15.0, 2.6, 3.4), "lot": (11.0, 4.0, 13.0), "country": (5.0, 7.0, 60.0)}[
            surroundings
        ]
        station = float(rng.uniform(0.0, every))
        while station < length:
            out = near + (far - near) * float(rng.random()) ** 1.6
            at = self._at(edge, stations, station, out)
            size, kind = float(rng.uniform(0.75, 1.35)), int(rng.integers(0, 8))
            station += every * float(rng.uniform(0.5, 1.6))
            if at is not None:
                self._trees.append((at[0], at[1], size, kind))

    def plant(self) -> None:
        """Put the trees down that stand neither on a lane nor in a house."""
        free = self._free([tree[:2] for tree in self._trees], [1.4 + 1.2 * (tree[3] > 3) for tree in self._trees])
        for ok, (x, y, size, kind) in zip(free.tolist(), self._trees, strict=True):
            cell = math.floor(x / 40.0), math.floor(y / 40.0)
            near = [
                one
                for dx in (-1, 0, 1)
                for dy in (-1, 0, 1)
                for one in self._houses.get((cell[0] + dx, cell[1] + dy), [])
            ]
            if not ok or any(box.grown(0.8).holds(x, y) for box in near):
                continue
            leaves = LEAVES[self._palette % len(LEAVES)]
            self._tree(x, y, size, kind, leaves[kind % len(leaves)])

    def _tree(self, x: float, y: float, size: float, kind: int, leaf: tuple[float, float, float]) -> None:
        label, bark = SemanticClass.VEGETATION, (0.28, 0.21, 0.15)
        if kind == 7:  # a bush
            self.pile.add(
                Shape.BALL, (x, y, 0.55 * size), (2.0 * size, 1.7 * size, 1.5 * size), leaf,
                material=Material.FOLIAGE, label=label,
            )  # fmt: skip
            return
        trunk = 2.0 * size
        self.pile.add(Shape.CYLINDER, (x, y, trunk / 2.0), (0.32 * size, 0.32 * size, trunk), bark, label=label)
        if kind in (2, 5):  # a conifer
            dark = (leaf[0] * 0.7, leaf[1] * 0.75, leaf[2] * 0.9)
            for low, wide, tall in ((0.9, 3.4, 3.4), (3.0, 2.5, 3.0)):
                self.pile.add(
                    Shape.CYLINDER, (x, y, (low + tall / 2.0) * size), (wide * size, wide * size, tall * size), dark,
                    taper=(0.06, 0.06), material=Material.FOLIAGE, label=label,
                )  # fmt: skip
            return
        wide = (2.9 + 0.4 * (kind % 3)) * size
        self.pile.add(
            Shape.BALL, (x, y, trunk + 0.42 * wide), (wide, wide, wide * 0.95), leaf, yaw=kind * 1.3,
            material=Material.FOLIAGE, label=label,
        )  # fmt: skip
        self.pile.add(
            Shape.BALL, (x + 0.3 * wide, y - 0.2 * wide, trunk + 0.75 * wide), (wide * 0.7, wide * 0.7, wide * 0.62),
            (leaf[0] * 1.12, leaf[1] * 1.1, leaf[2]), yaw=kind * 0.7, material=Material.FOLIAGE, label=label,
        )  # fmt: skip


def _ring(box: Box) -> list[tuple[float, float]]:
    """Corners, middles of the sides, and the middle of a box."""
    corners = box.corners()
    sides = zip(corners, corners[1:] + corners[:1], strict=True)
    return [*corners, *(((a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0) for a, b in sides), (box.x_m, box.y_m)]
