"""Shapes of road users, signals and signs: parts of each kind, put at their poses all at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np

from chauffeur.camera.solids import (
    BLUE,
    CLASS,
    EMPTY,
    GLOW,
    INSTANCE,
    MATERIAL,
    PITCH,
    RED,
    SHIFT,
    SX,
    SY,
    SZ,
    TAPER_X,
    TAPER_Y,
    WIDTH,
    YAW,
    Material,
    SemanticClass,
    Shape,
    Solids,
    X,
    Y,
    Z,
    together,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.concept.scene import AgentKind

Colour = tuple[float, float, float]
BodyKind = Literal["car", "suv", "truck", "bus", "motorcycle", "bicycle", "pedestrian", "barrier", "cone"]

CLASSES: Final[dict[str, SemanticClass]] = {
    "car": SemanticClass.CAR,
    "suv": SemanticClass.CAR,
    "truck": SemanticClass.TRUCK,
    "bus": SemanticClass.BUS,
    "motorcycle": SemanticClass.MOTORCYCLE,
    "bicycle": SemanticClass.BICYCLE,
    "pedestrian": SemanticClass.PERSON,
    "barrier": SemanticClass.OBSTACLE,
    "cone": SemanticClass.OBSTACLE,
}
HEIGHTS_M: Final[dict[str, float]] = {
    "car": 1.48,
    "suv": 1.72,
    "truck": 3.7,
    "bus": 3.15,
    "motorcycle": 1.6,
    "bicycle": 1.75,
    "pedestrian": 1.76,
    "barrier": 1.05,
    "cone": 0.75,
}
PAINTS: Final[tuple[tuple[Colour, ...], ...]] = (
    (
        (0.86, 0.87, 0.88), (0.10, 0.11, 0.12), (0.55, 0.57, 0.60), (0.66, 0.08, 0.08), (0.10, 0.22, 0.48),
        (0.30, 0.31, 0.33), (0.92, 0.91, 0.86), (0.08, 0.28, 0.20), (0.72, 0.60, 0.20), (0.36, 0.18, 0.12),
    ),
    (
        (0.80, 0.78, 0.70), (0.20, 0.16, 0.18), (0.50, 0.20, 0.36), (0.85, 0.42, 0.10), (0.15, 0.40, 0.45),
        (0.42, 0.44, 0.38), (0.95, 0.90, 0.75), (0.30, 0.36, 0.16), (0.60, 0.12, 0.20), (0.24, 0.26, 0.40),
    ),
    (
        (0.70, 0.76, 0.84), (0.05, 0.06, 0.12), (0.40, 0.50, 0.62), (0.78, 0.10, 0.30), (0.05, 0.35, 0.70),
        (0.22, 0.26, 0.30), (0.85, 0.92, 0.96), (0.02, 0.40, 0.34), (0.90, 0.75, 0.10), (0.40, 0.10, 0.45),
    ),
)  # fmt: skip

_TYRE: Final[Colour] = (0.06, 0.06, 0.065)
_DARK: Final[Colour] = (0.10, 0.10, 0.11)
_GLASS: Final[Colour] = (0.13, 0.17, 0.20)
_RED: Final[Colour] = (0.55, 0.04, 0.03)
_WHITE: Final[Colour] = (0.93, 0.93, 0.90)
_AMBER: Final[Colour] = (0.75, 0.38, 0.04)

Lamp = Literal["", "tail", "head", "left", "right"]


class BodyPart(NamedTuple):
    """A part of a body: place and size in shares of its length and width, and in m of height.

    `colour` None is the body's paint. `size` of a wheel: (diameter m, share of width, diameter m).
    """

    shape: Shape
    at: tuple[float, float, float]
    size: tuple[float, float, float]
    colour: Colour | None
    taper: tuple[float, float] = (1.0, 1.0)
    shift: float = 0.0
    material: Material = Material.PAINT
    lamp: Lamp = ""
    pitch: float = 0.0
    swing: float = 0.0
    metric: bool = False
    near: bool = False


def _wheels(at: Sequence[float], diameter_m: float, share: float = 0.12) -> list[BodyPart]:
    return [
        BodyPart(
            Shape.WHEEL, (x, side * (0.5 - share / 2.0), diameter_m / 2.0), (diameter_m, share, diameter_m), _TYRE,
            metric=True,
        )
        for x in at
        for side in (-1.0, 1.0)
    ] + [
        BodyPart(
            Shape.WHEEL, (x, side * 0.489, diameter_m / 2.0), (diameter_m * 0.56, 0.026, diameter_m * 0.56),
            (0.55, 0.56, 0.58), metric=True, near=True,
        )
        for x in at
        for side in (-1.0, 1.0)
    ]  # fmt: skip


def _lamps(front: float, rear: float, z: float, wide: float, tall: float) -> list[BodyPart]:
    """Head, tail and indicator lamps at the ends; `wide` is a lamp's share of the width."""
    parts: list[BodyPart] = []
    for side, turn in ((-1.0, "right"), (1.0, "left")):
        y = side * (0.47 - wide / 2.0)
        parts += [
            BodyPart(Shape.BOX, (rear, y, z), (0.014, wide, tall), _RED, material=Material.LAMP, lamp="tail"),
            BodyPart(Shape.BOX, (front, y, z - 0.06), (0.014, wide, tall), _WHITE, material=Material.LAMP, lamp="head"),
        ]
        for x in (rear, front):
            parts.append(
                BodyPart(
                    Shape.BOX, (x, side * 0.475, z), (0.017, 0.05, tall), _AMBER, material=Material.LAMP,
                    lamp="left" if turn == "left" else "right",
                )
            )  # fmt: skip
    return parts


def _car(height: float, cabin_at: float, cabin: float, hood_z: float) -> list[BodyPart]:
    roof = height - 0.05
    return [
        BodyPart(Shape.BOX, (0.0, 0.0, 0.47), (1.0, 0.98, 0.44), None, (0.985, 0.97)),
        BodyPart(Shape.BOX, (0.0, 0.0, (0.69 + hood_z) / 2.0), (0.985, 0.95, hood_z - 0.69), None, (0.94, 0.90)),
        BodyPart(Shape.BOX, (0.0, 0.0, 0.30), (0.96, 0.99, 0.2), _DARK),
        BodyPart(
            Shape.BOX, (cabin_at, 0.0, (hood_z + roof) / 2.0), (cabin, 0.86, roof - hood_z), _GLASS, (0.66, 0.80),
            -0.03, Material.GLASS,
        ),
        BodyPart(
            Shape.BOX, (cabin_at - 0.03 * cabin, 0.0, roof + 0.015), (cabin * 0.67, 0.70, 0.05), None, (0.94, 0.94),
        ),
        BodyPart(
            Shape.BOX, (cabin_at - 0.02 * cabin, 0.0, (hood_z + roof) / 2.0), (0.02, 0.868, roof - hood_z), None,
            (1.0, 0.80), near=True,
        ),
        *_wheels((-0.305, 0.315), 0.66),
        *_lamps(0.4935, -0.4935, 0.74, 0.24, 0.13),
        BodyPart(Shape.BOX, (-0.4955, 0.0, 0.62), (0.012, 0.27, 0.12), _WHITE, near=True),
        BodyPart(Shape.BOX, (0.497, 0.0, 0.50), (0.010, 0.55, 0.14), _DARK, near=True),
        BodyPart(Shape.BOX, (0.16, -0.51, 0.98), (0.035, 0.09, 0.13), None, near=True),
        BodyPart(Shape.BOX, (0.16, 0.51, 0.98), (0.035, 0.09, 0.13), None, near=True),
    ]  # fmt: skip


def _truck() -> list[BodyPart]:
    return [
        BodyPart(Shape.BOX, (-0.10, 0.0, 2.28), (0.79, 1.0, 2.84), (0.83, 0.84, 0.83)),
        BodyPart(Shape.BOX, (-0.10, 0.0, 2.28), (0.78, 1.006, 0.5), None),
        BodyPart(Shape.BOX, (0.0, 0.0, 0.72), (0.98, 0.72, 0.3), _DARK),
        BodyPart(Shape.BOX, (0.405, 0.0, 1.55), (0.18, 0.96, 2.1), None, (0.90, 0.95), -0.05),
        BodyPart(Shape.BOX, (0.412, 0.0, 2.0), (0.172, 0.90, 0.72), _GLASS, (0.96, 0.99), -0.04, Material.GLASS),
        *_wheels((-0.40, -0.28, 0.38), 1.0, 0.14),
        *_lamps(0.495, -0.497, 0.85, 0.14, 0.2),
        BodyPart(Shape.BOX, (-0.497, 0.0, 2.28), (0.008, 0.03, 2.7), _DARK, near=True),
        BodyPart(Shape.BOX, (-0.498, 0.0, 0.62), (0.012, 0.9, 0.12), _RED, near=True),
    ]


def _bus() -> list[BodyPart]:
    return [
        BodyPart(Shape.BOX, (0.0, 0.0, 1.72), (1.0, 1.0, 2.76), None, (0.99, 0.97)),
        BodyPart(Shape.BOX, (0.0, 0.0, 2.08), (1.002, 1.006, 0.98), _GLASS, (0.995, 0.985), material=Material.GLASS),
        BodyPart(Shape.BOX, (0.0, 0.0, 0.48), (0.985, 1.004, 0.3), _DARK),
        *[
            BodyPart(Shape.BOX, (x, 0.0, 2.08), (0.012, 1.01, 1.0), None, near=True)
            for x in (-0.38, -0.22, -0.06, 0.1, 0.26, 0.4)
        ],
        BodyPart(Shape.BOX, (0.0, 0.0, 3.14), (0.8, 0.7, 0.1), (0.75, 0.76, 0.76)),
        *_wheels((-0.28, 0.30), 0.96, 0.12),
        *_lamps(0.499, -0.499, 1.0, 0.14, 0.22),
        BodyPart(Shape.BOX, (0.501, 0.0, 2.75), (0.004, 0.6, 0.22), (0.9, 0.6, 0.1), material=Material.LAMP, near=True),
    ]


def _rider(at_x: float, seat_z: float, lean: float) -> list[BodyPart]:
    """A person on two wheels; metric in x."""
    return [
        BodyPart(
            Shape.BOX, (at_x, 0.0, seat_z + 0.30), (0.24, 0.52, 0.58), (0.20, 0.22, 0.30), (0.9, 1.0), 0.0, pitch=lean
        ),
        BodyPart(Shape.BALL, (at_x + 0.10, 0.0, seat_z + 0.74), (0.26, 0.3, 0.28), (0.75, 0.75, 0.72)),
        BodyPart(Shape.BOX, (at_x + 0.16, -0.22, seat_z - 0.18), (0.15, 0.16, 0.6), (0.12, 0.12, 0.16), pitch=-0.5),
        BodyPart(Shape.BOX, (at_x + 0.16, 0.22, seat_z - 0.18), (0.15, 0.16, 0.6), (0.12, 0.12, 0.16), pitch=-0.2),
        BodyPart(
            Shape.BOX, (at_x + 0.32, -0.36, seat_z + 0.36), (0.5, 0.1, 0.1), (0.20, 0.22, 0.30), pitch=0.35, near=True
        ),
        BodyPart(
            Shape.BOX, (at_x + 0.32, 0.36, seat_z + 0.36), (0.5, 0.1, 0.1), (0.20, 0.22, 0.30), pitch=0.35, near=True
        ),
    ]


def _metric(parts: list[BodyPart], length_m: float) -> list[BodyPart]:
    """Parts whose x is in m, as shares of a nominal length."""
    return [
        p._replace(at=(p.at[0] / length_m, *p.at[1:]), size=(p.size[0] / (1.0 if p.metric else length_m), *p.size[1:]))
        for p in parts
    ]


def _motorcycle() -> list[BodyPart]:
    wheel = (0.62, 0.20, 0.62)
    return _metric(
        [
            BodyPart(Shape.WHEEL, (-0.72, 0.0, 0.31), wheel, _TYRE, metric=True),
            BodyPart(Shape.WHEEL, (0.72, 0.0, 0.31), wheel, _TYRE, metric=True),
            BodyPart(Shape.BOX, (0.0, 0.0, 0.62), (1.15, 0.36, 0.42), None, (0.8, 0.8)),
            BodyPart(Shape.BOX, (0.55, 0.0, 0.95), (0.10, 0.85, 0.08), _DARK),
            BodyPart(Shape.BOX, (-0.95, 0.0, 0.72), (0.06, 0.3, 0.10), _RED, material=Material.LAMP, lamp="tail"),
            BodyPart(Shape.BOX, (0.85, 0.0, 0.82), (0.08, 0.3, 0.16), _WHITE, material=Material.LAMP, lamp="head"),
            *_rider(-0.15, 0.82, 0.12),
        ],
        2.2,
    )


def _bicycle() -> list[BodyPart]:
    wheel = (0.68, 0.10, 0.68)
    return _metric(
        [
            BodyPart(Shape.WHEEL, (-0.52, 0.0, 0.34), wheel, (0.12, 0.12, 0.12), metric=True),
            BodyPart(Shape.WHEEL, (0.52, 0.0, 0.34), wheel, (0.12, 0.12, 0.12), metric=True),
            BodyPart(Shape.BOX, (0.0, 0.0, 0.66), (0.95, 0.09, 0.07), None, pitch=-0.15),
            BodyPart(Shape.BOX, (-0.1, 0.0, 0.5), (0.07, 0.09, 0.5), None, pitch=0.3),
            BodyPart(Shape.BOX, (0.42, 0.0, 0.72), (0.06, 0.09, 0.7), None, pitch=-0.3),
            BodyPart(Shape.BOX, (0.38, 0.0, 1.04), (0.07, 0.85, 0.06), _DARK),
            BodyPart(Shape.BOX, (-0.6, 0.0, 0.78), (0.04, 0.12, 0.06), _RED, material=Material.LAMP, lamp="tail"),
            *_rider(-0.16, 0.95, 0.25),
        ],
        1.8,
    )


def _pedestrian() -> list[BodyPart]:
    """Metric: x and y are shares of a body 0.6 m deep and 0.6 m wide."""
    skin, trousers = (0.72, 0.53, 0.42), (0.16, 0.18, 0.26)
    return [
        BodyPart(Shape.BOX, (0.0, -0.17, 0.42), (0.26, 0.24, 0.86), trousers, (1.15, 1.05), swing=0.42),
        BodyPart(Shape.BOX, (0.0, 0.17, 0.42), (0.26, 0.24, 0.86), trousers, (1.15, 1.05), swing=-0.42),
        BodyPart(Shape.BOX, (0.0, 0.0, 1.15), (0.36, 0.66, 0.62), None, (1.0, 1.1)),
        BodyPart(Shape.BOX, (0.0, -0.42, 1.12), (0.18, 0.15, 0.62), None, swing=-0.35),
        BodyPart(Shape.BOX, (0.0, 0.42, 1.12), (0.18, 0.15, 0.62), None, swing=0.35),
        BodyPart(Shape.BALL, (0.02, 0.0, 1.62), (0.36, 0.34, 0.28), skin),
        BodyPart(Shape.BALL, (-0.04, 0.0, 1.67), (0.37, 0.36, 0.22), (0.14, 0.09, 0.06)),
    ]


_PARTS: Final = {
    "car": lambda: _car(1.48, -0.055, 0.58, 0.93),
    "suv": lambda: _car(1.72, -0.12, 0.72, 1.02),
    "truck": _truck,
    "bus": _bus,
    "motorcycle": _motorcycle,
    "bicycle": _bicycle,
    "pedestrian": _pedestrian,
    "barrier": lambda: [
        BodyPart(
            Shape.BOX, (0.0, 0.0, 0.52), (1.0, 1.0, 1.04), (1.0, 0.45, 0.05), (0.8, 0.8), material=Material.STRIPES
        )
    ],
    "cone": lambda: [
        BodyPart(
            Shape.CYLINDER, (0.0, 0.0, 0.4), (0.7, 0.7, 0.7), (1.0, 0.4, 0.05), (0.2, 0.2), material=Material.STRIPES
        ),
        BodyPart(Shape.BOX, (0.0, 0.0, 0.03), (1.0, 1.0, 0.06), (0.9, 0.35, 0.05)),
    ],
}


@dataclass(frozen=True)
class _Template:
    rows: NDArray[np.float32]
    shapes: NDArray[np.uint8]
    painted: NDArray[np.bool_]
    metric: NDArray[np.bool_]
    lamps: NDArray[np.int8]
    swings: NDArray[np.float32]
    near: NDArray[np.bool_]


_LAMPS: Final = {"": 0, "tail": 1, "head": 2, "left": 3, "right": 4}


@cache
def _template(kind: BodyKind) -> _Template:
    parts: list[BodyPart] = _PARTS[kind]()
    rows = np.zeros((len(parts), WIDTH), np.float32)
    for row, part in zip(rows, parts, strict=True):
        row[X : Z + 1] = part.at
        row[SX : SZ + 1] = part.size
        row[RED : BLUE + 1] = part.colour or (1.0, 1.0, 1.0)
        row[TAPER_X], row[TAPER_Y] = part.taper
        row[SHIFT], row[MATERIAL], row[PITCH] = part.shift, part.material, part.pitch
        row[CLASS] = CLASSES[kind]
    return _Template(
        rows,
        np.array([part.shape for part in parts], np.uint8),
        np.array([part.colour is None for part in parts]),
        np.array([part.metric for part in parts]),
        np.array([_LAMPS[part.lamp] for part in parts], np.int8),
        np.array([part.swing for part in parts], np.float32),
        np.array([part.near for part in parts]),
    )


@dataclass(frozen=True, slots=True)
class BodyShape:
    """One road user or object to draw, in the scene's frame."""

    kind: BodyKind
    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    width_m: float
    paint: Colour
    instance: int
    braking: bool = False
    lamps_on: bool = False
    indicator: Literal["", "left", "right", "both"] = ""
    phase: float = 0.0
    detailed: bool = True

    @property
    def height_m(self) -> float:
        """Height, m."""
        return HEIGHTS_M[self.kind]


def kind_of(kind: AgentKind, number: int, length_m: float) -> BodyKind | None:
    """The body of a road user; None for what is drawn as a sign. Cars of even number are saloons, odd ones SUVs."""
    if kind == "stop_sign":
        return None
    if kind == "car":
        return "suv" if number % 3 == 1 else "car"
    if kind in ("static", "obstacle"):
        return "cone" if length_m < 0.8 else "barrier"
    return kind


def bodies(all_of: Sequence[BodyShape]) -> Solids:
    """Solids of road users and objects."""
    kinds: dict[tuple[BodyKind, bool], list[BodyShape]] = {}
    for body in all_of:
        kinds.setdefault((body.kind, body.detailed), []).append(body)
    return together([_of_kind(kind, detailed, same) for (kind, detailed), same in kinds.items()]) if kinds else EMPTY


def _of_kind(kind: BodyKind, detailed: bool, same: list[BodyShape]) -> Solids:
    template = _template(kind)
    chosen = np.ones(len(template.rows), bool) if detailed else ~template.near
    base, metric = template.rows[chosen], template.metric[chosen]
    lamps, swings, painted = template.lamps[chosen], template.swings[chosen], template.painted[chosen]
    given = np.array([(b.x_m, b.y_m, b.heading_rad, b.length_m, b.width_m, b.instance, b.phase) for b in same])
    rows = np.repeat(base[None], len(same), axis=0)
    length, width = given[:, 3:4], given[:, 4:5]
    along, across = base[None, :, X] * length, base[None, :, Y] * width
    c, s = np.cos(given[:, 2:3]), np.sin(given[:, 2:3])
    rows[..., X] = given[:, 0:1] + c * along - s * across
    rows[..., Y] = given[:, 1:2] + s * along + c * across
    rows[..., YAW] = given[:, 2:3]
    rows[..., SX] = np.where(metric, base[None, :, SX], base[None, :, SX] * length)
    rows[..., SY] = base[None, :, SY] * width
    rows[..., PITCH] += swings * np.sin(given[:, 6:7])
    paints = np.array([b.paint for b in same], np.float32)
    rows[..., RED : BLUE + 1] = np.where(painted[None, :, None], paints[:, None], rows[..., RED : BLUE + 1])
    rows[..., INSTANCE] = given[:, 5:6]
    glow = np.array([_glow(b) for b in same], np.float32)
    rows[..., GLOW] = glow[:, lamps]
    shapes = np.tile(template.shapes[chosen], len(same))
    return Solids(rows.reshape(-1, WIDTH), shapes)


def _glow(body: BodyShape) -> tuple[float, float, float, float, float]:
    """Of (what is no lamp, tail, head, left and right indicator)."""
    tail = 1.0 if body.braking else 0.35 if body.lamps_on else 0.0
    left = 1.0 if body.indicator in ("left", "both") else 0.0
    right = 1.0 if body.indicator in ("right", "both") else 0.0
    return 0.0, tail, 1.0 if body.lamps_on else 0.0, left, right


def gait(x_m: float, y_m: float) -> float:
    """Phase of a walker's step from how far it has come: a stride every 1.4 m."""
    return 2.0 * math.pi * ((x_m + y_m) / 1.4 % 1.0)
