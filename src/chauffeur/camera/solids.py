"""Solids of a scene: boxes, cylinders, wheels and balls, as rows of numbers that one draw call takes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]
    RowArray = NDArray[np.float32]

WIDTH: Final = 18
"""Numbers a solid: x y z of its centre, yaw, pitch, size x y z, red green blue, taper of its top in x and in y, shift
of its top in x (share of its length), material, glow, instance, class."""

X, Y, Z, YAW, PITCH, SX, SY, SZ, RED, GREEN, BLUE, TAPER_X, TAPER_Y, SHIFT, MATERIAL, GLOW, INSTANCE, CLASS = range(
    WIDTH
)


class Shape(IntEnum):
    """Unit meshes, each within +-0.5: a box, a cylinder along z, a cylinder along y, a ball."""

    BOX = 0
    CYLINDER = 1
    WHEEL = 2
    BALL = 3


class Material(IntEnum):
    """Material of a solid."""

    PAINT = 0
    FACADE = 1
    FOLIAGE = 2
    GLASS = 3
    LAMP = 4
    STRIPES = 5
    SIGN = 6


class SemanticClass(IntEnum):
    """Values of the semantic mask; names as in Cityscapes where it has them."""

    SKY = 0
    TERRAIN = 1
    ROAD = 2
    LANE_MARKING = 3
    CROSSWALK = 4
    SIDEWALK = 5
    BUILDING = 6
    VEGETATION = 7
    POLE = 8
    TRAFFIC_LIGHT = 9
    TRAFFIC_SIGN = 10
    GUARDRAIL = 11
    CAR = 12
    TRUCK = 13
    BUS = 14
    MOTORCYCLE = 15
    BICYCLE = 16
    PERSON = 17
    OBSTACLE = 18


@dataclass(frozen=True)
class Solids:
    """Solids of one kind of mesh after the other: rows (n, 18) and the shape of each (n,)."""

    rows: RowArray
    shapes: NDArray[np.uint8]

    def __len__(self) -> int:
        """Number of solids."""
        return len(self.rows)

    def chosen(self, which: NDArray[np.bool_]) -> Solids:
        """Some of them."""
        return Solids(self.rows[which], self.shapes[which])

    @property
    def radii(self) -> RowArray:
        """Of balls that hold each of them, m, (n,)."""
        return np.linalg.norm(self.rows[:, SX : SZ + 1], axis=1) * 0.5


EMPTY: Final = Solids(np.zeros((0, WIDTH), np.float32), np.zeros(0, np.uint8))


def together(parts: list[Solids]) -> Solids:
    """All of them."""
    kept = [part for part in parts if len(part)]
    if not kept:
        return EMPTY
    return Solids(np.concatenate([part.rows for part in kept]), np.concatenate([part.shapes for part in kept]))


class Pile:
    """Solids as they are put down one by one."""

    def __init__(self) -> None:
        """Begins empty."""
        self._rows: list[list[float]] = []
        self._shapes: list[int] = []

    def add(
        self,
        shape: Shape,
        at: tuple[float, float, float],
        size: tuple[float, float, float],
        colour: tuple[float, float, float],
        *,
        yaw: float = 0.0,
        pitch: float = 0.0,
        taper: tuple[float, float] = (1.0, 1.0),
        shift: float = 0.0,
        material: Material = Material.PAINT,
        glow: float = 0.0,
        instance: int = 0,
        label: SemanticClass = SemanticClass.OBSTACLE,
    ) -> None:
        """Put one down; `at` is its centre."""
        self._rows.append([*at, yaw, pitch, *size, *colour, *taper, shift, material, glow, instance, label])
        self._shapes.append(shape)

    def take(self, other: Pile, dx_m: float, dy_m: float) -> None:
        """Take what another has, moved."""
        self._rows += [[row[0] + dx_m, row[1] + dy_m, *row[2:]] for row in other._rows]
        self._shapes += other._shapes

    def solids(self) -> Solids:
        """The solids collected."""
        if not self._rows:
            return EMPTY
        return Solids(np.array(self._rows, np.float32), np.array(self._shapes, np.uint8))


def mesh_of(shape: Shape) -> tuple[FloatArray, NDArray[np.int32]]:
    """Vertices (n, 6), place and normal, and triangles (k, 3) of a unit shape, counter-clockwise from outside."""
    if shape is Shape.BOX:
        return _box()
    if shape is Shape.BALL:
        return _ball()
    vertices, triangles = _cylinder(8 if shape is Shape.CYLINDER else 10)
    if shape is Shape.WHEEL:  # (x, y, z) -> (x, -z, y): a rotation, so triangles keep their side
        turned = vertices.copy()
        for at in (0, 3):
            turned[:, at + 1], turned[:, at + 2] = -vertices[:, at + 2], vertices[:, at + 1]
        vertices = turned
    return vertices, triangles


def _box() -> tuple[FloatArray, NDArray[np.int32]]:
    vertices: list[list[float]] = []
    triangles: list[list[int]] = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            first = len(vertices)
            for a, b in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
                place, normal = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
                place[axis], place[u], place[v] = side * 0.5, a * side, b
                normal[axis] = side
                vertices.append([*place, *normal])
            triangles += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    return np.array(vertices), np.array(triangles, np.int32)


def _cylinder(sides: int) -> tuple[FloatArray, NDArray[np.int32]]:
    vertices: list[list[float]] = []
    triangles: list[list[int]] = []
    ring = [2.0 * math.pi * (i + 0.5) / sides for i in range(sides + 1)]
    for angle in ring:
        c, s = math.cos(angle), math.sin(angle)
        vertices += [[0.5 * c, 0.5 * s, z, c, s, 0.0] for z in (-0.5, 0.5)]
    for i in range(sides):
        a = 2 * i
        triangles += [[a, a + 2, a + 3], [a, a + 3, a + 1]]
    for z in (-0.5, 0.5):
        first = len(vertices)
        vertices += [[0.5 * math.cos(a), 0.5 * math.sin(a), z, 0.0, 0.0, math.copysign(1.0, z)] for a in ring[:-1]]
        for i in range(1, sides - 1):
            fan = [first, first + i, first + i + 1]
            triangles.append(fan if z > 0.0 else fan[::-1])
    return np.array(vertices), np.array(triangles, np.int32)


def _ball(rows: int = 4, sides: int = 8) -> tuple[FloatArray, NDArray[np.int32]]:
    vertices: list[list[float]] = []
    triangles: list[list[int]] = []
    for i in range(rows + 1):
        up = math.pi * (i / rows - 0.5)
        for j in range(sides + 1):
            angle = 2.0 * math.pi * j / sides
            n = [math.cos(up) * math.cos(angle), math.cos(up) * math.sin(angle), math.sin(up)]
            vertices.append([0.5 * n[0], 0.5 * n[1], 0.5 * n[2], *n])
    for i in range(rows):
        for j in range(sides):
            a, b = i * (sides + 1) + j, (i + 1) * (sides + 1) + j
            triangles += [[a, a + 1, b + 1], [a, b + 1, b]]
    return np.array(vertices), np.array(triangles, np.int32)
