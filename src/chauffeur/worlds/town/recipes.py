"""Recipes of our own towns: streets and crossroads as a plan, drawn from a seed; `drawing` makes OpenDRIVE of it.

Every name, place and street is invented; the towns exist nowhere.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

Control = Literal["lights", "stop", "yield", "none"]


@dataclass(frozen=True, slots=True)
class Crossroads:
    """A junction of streets. `radius_m` is kept free of streets; `control` rules the minor ones (lights: all)."""

    x_m: float
    y_m: float
    control: Control = "none"
    radius_m: float = 15.0


@dataclass(frozen=True, slots=True)
class Landmark:
    """A building or stop beside a street: at a share of its length, on the right of who drives along or against it."""

    name: str
    kind: str
    share: float
    along: bool = True


@dataclass(frozen=True, slots=True)
class TownStreet:
    """A street between two crossroads.

    Attributes:
        a, b: The crossroads (numbers) where it begins and ends.
        name: Of the street.
        lanes: Each way.
        speed_kmh: Limit.
        one_way: Only from a to b (a ring).
        leaves_rad, arrives_rad: Headings at its ends; None for straight on.
        crossings: Whether people cross at its ends that lights rule, and in its middle.
        landmarks: What stands beside it.
    """

    a: int
    b: int
    name: str
    lanes: int = 1
    speed_kmh: int = 50
    one_way: bool = False
    leaves_rad: float | None = None
    arrives_rad: float | None = None
    middle_crossing: bool = False
    landmarks: tuple[Landmark, ...] = ()


@dataclass(frozen=True, slots=True)
class TownPlan:
    """A town: crossroads by number, and the streets between them."""

    name: str
    seed: int
    crossroads: Mapping[int, Crossroads]
    streets: tuple[TownStreet, ...]


def _gridford(draw: random.Random) -> TownPlan:
    """A grid of four by three, its middle row an arterial of two lanes each way, with bus stops."""
    nodes = {
        row * 4 + column: Crossroads(
            110.0 * column,
            95.0 * row,
            "lights" if row == 1 or column in (1, 2) else "none",
            20.0 if row == 1 else 16.0,
        )
        for row in range(3)
        for column in range(4)
    }
    across, along = (
        ["Mill Lane", "High Street", "Orchard Road"],
        ["West Street", "Abbey Road", "Park Road", "East Street"],
    )
    streets = [
        TownStreet(row * 4 + c, row * 4 + c + 1, across[row], 2 if row == 1 else 1, 50 if row == 1 else 30)
        for row in range(3)
        for c in range(3)
    ]
    streets += [TownStreet(row * 4 + c, row * 4 + c + 4, along[c], 1, 40) for row in range(2) for c in range(4)]
    return _furnished("Gridford", 11, nodes, streets, draw)


def _oldbridge(draw: random.Random) -> TownPlan:
    """An old town: crossroads off the grid, bent streets, T-junctions where streets were never built."""
    nodes = {
        row * 4 + column: Crossroads(
            125.0 * column + draw.uniform(-14.0, 14.0), 115.0 * row + draw.uniform(-14.0, 14.0), radius_m=17.0
        )
        for row in range(4)
        for column in range(4)
    }
    pairs = [(r * 4 + c, r * 4 + c + 1) for r in range(4) for c in range(3)]
    pairs += [(r * 4 + c, r * 4 + c + 4) for r in range(3) for c in range(4)]
    for gone in ((5, 6), (8, 9), (6, 10), (10, 14)):
        pairs.remove(gone)
    names = draw.sample(_STREETS, len(pairs))
    streets = [
        _bent(TownStreet(a, b, name, 1, draw.choice((30, 40, 50))), nodes, draw.uniform(-0.25, 0.25))
        for (a, b), name in zip(pairs, names, strict=True)
    ]
    return _furnished("Oldbridge", 12, _ruled(nodes, streets, draw, 0.5), streets, draw)


def _northport(draw: random.Random) -> TownPlan:
    """A harbour town along an arterial of two lanes each way, side streets ending at it in T-junctions."""
    nodes = {i: Crossroads(130.0 * i, 12.0 * math.sin(1.1 * i), "lights" if i % 2 else "stop", 20.0) for i in range(6)}
    streets = [TownStreet(i, i + 1, "Harbour Road", 2, 60) for i in range(5)]
    for i in range(6):
        side = 1.0 if i % 2 else -1.0
        nodes[10 + i] = Crossroads(130.0 * i + draw.uniform(-10.0, 10.0), side * 120.0, "none", 15.0)
        streets.append(TownStreet(i, 10 + i, _NORTH[i], 1, 40))
    for row in ((11, 13, 15), (10, 12, 14)):
        streets += [
            TownStreet(row[k], row[k + 1], "Chandler Street" if row[0] == 11 else "Quay Lane", 1, 30) for k in (0, 1)
        ]
    streets += [TownStreet(0, 11, "Lighthouse Way", 1, 40), TownStreet(14, 5, "Customs Row", 1, 40)]
    return _furnished("Northport", 13, nodes, streets, draw)


def _ringstead(draw: random.Random) -> TownPlan:
    """A roundabout in the middle of a ring of streets with lights."""
    nodes: dict[int, Crossroads] = {}
    streets: list[TownStreet] = []
    ring, far = 26.0, 170.0
    for i in range(4):
        angle = i * math.pi / 2.0
        nodes[i] = Crossroads(ring * math.cos(angle), ring * math.sin(angle), "yield", 11.0)
        nodes[10 + i] = Crossroads(far * math.cos(angle), far * math.sin(angle), "lights", 17.0)
        corner = angle + math.pi / 4.0
        nodes[20 + i] = Crossroads(far * 1.35 * math.cos(corner), far * 1.35 * math.sin(corner), "none", 15.0)
        streets.append(TownStreet(i, 10 + i, ("East Gate", "North Gate", "West Gate", "South Gate")[i], 1, 50))
    for i in range(4):
        angle, after = i * math.pi / 2.0, (i + 1) * math.pi / 2.0
        streets.append(
            TownStreet(i, (i + 1) % 4, "Kings Circus", 1, 30, True, angle + math.pi / 2.0, after + math.pi / 2.0)
        )
        names = draw.sample(_STREETS, 2)
        streets.append(TownStreet(10 + i, 20 + i, names[0], 1, 40))
        streets.append(TownStreet(20 + i, 10 + (i + 1) % 4, names[1], 1, 40))
    return _furnished("Ringstead", 14, nodes, streets, draw)


def _hillcrest(draw: random.Random) -> TownPlan:
    """A suburb: quiet bent streets with stop signs, a school, an avenue of two lanes each way with lights."""
    nodes = {
        row * 5 + column: Crossroads(
            105.0 * column + draw.uniform(-10.0, 10.0), 100.0 * row + draw.uniform(-10.0, 10.0), radius_m=17.0
        )
        for row in range(3)
        for column in range(5)
    }
    streets: list[TownStreet] = []
    for row in range(3):
        for c in range(4):
            wide = row == 1
            street = TownStreet(row * 5 + c, row * 5 + c + 1, ("Hill Road", "Queens Avenue", "Meadow Way")[row])
            street = replace(street, lanes=2 if wide else 1, speed_kmh=50 if wide else 30)
            streets.append(_bent(street, nodes, 0.0 if wide else draw.uniform(-0.2, 0.2)))
    for row in range(2):
        for c in range(5):
            if (row, c) not in ((0, 1), (1, 3)):
                name = ("Birch Close", "Cedar Close", "Elm Grove", "Maple Drive", "Willow Walk")[c]
                streets.append(
                    _bent(TownStreet(row * 5 + c, row * 5 + c + 5, name, 1, 30), nodes, draw.uniform(-0.2, 0.2))
                )
    ruled = {
        number: replace(
            node, control="lights" if number in (5, 7, 9) else "stop", radius_m=20.0 if 5 <= number < 10 else 17.0
        )
        for number, node in nodes.items()
    }
    return _furnished("Hillcrest", 15, ruled, streets, draw)


TOWNS: Final[Mapping[str, tuple[Callable[[random.Random], TownPlan], int]]] = {
    "Gridford": (_gridford, 11),
    "Oldbridge": (_oldbridge, 12),
    "Northport": (_northport, 13),
    "Ringstead": (_ringstead, 14),
    "Hillcrest": (_hillcrest, 15),
}
"""Our towns: recipe and seed."""


def plan_of(name: str, seed: int | None = None) -> TownPlan:
    """The plan of one of `TOWNS`; another seed draws another town by the same recipe. Raises KeyError."""
    recipe, own = TOWNS[name]
    return replace(recipe(random.Random(own if seed is None else seed)), seed=own if seed is None else seed)  # noqa: S311


# What recipes share ---------------------------------------------------------------------------------------------------


def _bent(street: TownStreet, nodes: Mapping[int, Crossroads], bend_rad: float) -> TownStreet:
    """A street that leaves to one side of the straight line and arrives from it."""
    a, b = nodes[street.a], nodes[street.b]
    heading = math.atan2(b.y_m - a.y_m, b.x_m - a.x_m)
    return replace(street, leaves_rad=heading + bend_rad, arrives_rad=heading - bend_rad)


def _ruled(
    nodes: Mapping[int, Crossroads], streets: list[TownStreet], draw: random.Random, lit: float
) -> dict[int, Crossroads]:
    """Lights at some crossroads of more than two streets, stop signs at the others."""
    found: dict[int, Crossroads] = {}
    for number, node in nodes.items():
        ways = sum(number in (street.a, street.b) for street in streets)
        control: Control = "none" if ways < 3 else "lights" if draw.random() < lit or ways == 4 else "stop"
        found[number] = replace(node, control=control)
    return found


def _furnished(
    name: str, seed: int, nodes: Mapping[int, Crossroads], streets: list[TownStreet], draw: random.Random
) -> TownPlan:
    """Landmarks along the streets, bus stops on the wide ones, a crossing in the middle of some."""
    marks = [Landmark(text, kind, 0.5) for text, kind in _LANDMARKS]
    draw.shuffle(marks)
    free = [i for i, street in enumerate(streets) if not street.one_way]
    draw.shuffle(free)
    furnished = list(streets)
    for mark, i in zip(marks, free, strict=False):
        street = furnished[i]
        own = replace(mark, share=round(draw.uniform(0.35, 0.65), 2), along=draw.random() < 0.5)
        furnished[i] = replace(street, landmarks=(*street.landmarks, own), middle_crossing=mark.kind == "school")
    stops = iter(draw.sample(_STOPS, len(_STOPS)))
    for i, street in enumerate(furnished):
        if street.lanes > 1:
            stop = Landmark(next(stops), "bus_stop", 0.7, along=i % 2 == 0)
            furnished[i] = replace(street, landmarks=(*street.landmarks, stop))
    return TownPlan(name, seed, nodes, tuple(furnished))


_LANDMARKS: Final = (
    ("St. Mary's Church", "church"), ("Central Station", "station"), ("Primary School", "school"),
    ("Miller's Bakery", "bakery"), ("Town Hall", "town_hall"), ("Rose Hospital", "hospital"),
    ("Old Library", "library"), ("Corner Pharmacy", "pharmacy"), ("Green Market", "supermarket"),
    ("Lion Hotel", "hotel"), ("City Museum", "museum"), ("Post Office", "post_office"),
)  # fmt: skip
PLACE_KINDS: Final = (*(kind for _, kind in _LANDMARKS), "bus_stop")
"""Places in our own towns."""
_STREETS: Final = [
    "Bridge Street", "Castle Street", "Chapel Lane", "Church Street", "Cooper Street", "Elm Street", "Ferry Lane",
    "Garden Street", "George Street", "Grove Road", "Hazel Lane", "Hope Street", "Ivy Lane", "Kiln Lane",
    "Linden Street",
    "Market Street", "Nelson Street", "Oak Street", "Pine Street", "Priory Road", "River Street", "School Lane",
    "Smith Street", "Spring Road", "Station Road", "Temple Street", "Tower Street", "Union Street", "Vine Street",
    "Weaver Lane",
]  # fmt: skip
_NORTH: Final = ["Anchor Street", "Beacon Street", "Compass Street", "Dock Street", "Ebb Lane", "Fisher Street"]
_STOPS: Final = [
    "Market Square",
    "Riverside",
    "Town Park",
    "Old Gate",
    "Stadium",
    "University",
    "Theatre",
    "Waterfront",
]
