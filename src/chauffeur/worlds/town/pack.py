"""A map pack: everything of a town that does not change while one drives there.

On disk a folder: `pack.json`, the OpenDRIVE file, and the SUMO net built from it. All coordinates are in OpenDRIVE's
own frame (right-handed, m): x = x_carla, y = -y_carla, heading = -yaw_carla.
"""

from __future__ import annotations

import gzip
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final

from chauffeur.concept import DataError, Sign, Signal, SignalState
from chauffeur.concept.data import data_home, parse_json
from chauffeur.geometry import LaneId, RoadGraph
from chauffeur.geometry.opendrive import OpenDriveError, OpenDriveMap, parse_opendrive
from chauffeur.worlds.town.levels import Levels

Point = tuple[float, float]
Line = tuple[Point, Point]

BUILDER_VERSION: Final = "maps-v5"
"""Changes with whatever would build another pack from the same sources. Another builder's pack is refused."""
PACK_FILE: Final = "pack.json"


@dataclass(frozen=True, slots=True)
class SignalHead:
    """A traffic light as the drivers of its lanes meet it.

    Attributes:
        id: Stable; of CARLA's towns the number of the light in the table of cycles.
        lanes: Lanes of the road graph that it rules: those before the junction.
        stop_line_m: Ends of the stop line.
        stop_box_m: Corners of the ground in which a car is at the light.
    """

    id: str
    lanes: tuple[LaneId, ...]
    stop_line_m: Line
    stop_box_m: tuple[Point, ...]


@dataclass(frozen=True, slots=True)
class SignalPhase:
    """A part of a cycle: how long, and what each head of the group shows, in their order."""

    seconds: float
    states: tuple[SignalState, ...]


@dataclass(frozen=True)
class SignalGroup:
    """The lights of one junction, which change together.

    Attributes:
        id: Stable.
        junction: Name of the junction in the road graph.
        heads: Its lights.
        phases: One cycle, repeated for ever.
        offset_s: Where in the cycle it is at time 0.
    """

    id: str
    junction: str
    heads: tuple[SignalHead, ...]
    phases: tuple[SignalPhase, ...]
    offset_s: float = 0.0

    @property
    def cycle_s(self) -> float:
        """Length of the cycle."""
        return sum(phase.seconds for phase in self.phases)

    def phase_at(self, time_s: float) -> tuple[int, float]:
        """(index of the phase, seconds it still lasts) at a time."""
        left = (time_s + self.offset_s) % self.cycle_s
        for i, phase in enumerate(self.phases):
            if left < phase.seconds:
                return i, phase.seconds - left
            left -= phase.seconds
        return 0, self.phases[0].seconds

    def signals(self, time_s: float) -> tuple[Signal, ...]:
        """States of its heads at a time, and how long they last."""
        now, left = self.phase_at(time_s)
        states, after = self.phases[now].states, self._after[now]
        return tuple(
            Signal(head.id, state, head.lanes, head.stop_line_m, None if more is None else left + more)
            for head, state, more in zip(self.heads, states, after, strict=True)
        )

    @cached_property
    def _after(self) -> tuple[tuple[float | None, ...], ...]:
        """Of each phase, how long after it each head still shows the same, s; None for ever."""
        return tuple(
            tuple(self._lasts_s(head, now) for head in range(len(self.heads))) for now in range(len(self.phases))
        )

    def _lasts_s(self, head: int, now: int) -> float | None:
        lasts = 0.0
        for step in range(1, len(self.phases)):
            phase = self.phases[(now + step) % len(self.phases)]
            if phase.states[head] != self.phases[now].states[head]:
                return lasts
            lasts += phase.seconds
        return None


@dataclass(frozen=True, slots=True)
class Crossing:
    """A pedestrian crossing.

    Attributes:
        id: Stable.
        polygon_m: Its outline.
        centre_m: The way across it, from kerb to kerb.
        width_m: Across that way.
        lanes: Lanes of the road graph that it crosses.
        junction: Name of the junction that it belongs to, empty for one between junctions.
    """

    id: str
    polygon_m: tuple[Point, ...]
    centre_m: Line
    width_m: float
    lanes: tuple[LaneId, ...]
    junction: str = ""


@dataclass(frozen=True, slots=True)
class Place:
    """A landmark with a name, and where on the road one gets out for it.

    Attributes:
        name: E.g. "St. Mary's Church".
        kind: church, station, school, bakery, bus_stop ...
        x_m, y_m: Where it stands.
        lane, station_m: Where the road passes it.
    """

    name: str
    kind: str
    x_m: float
    y_m: float
    lane: LaneId
    station_m: float


_ARTICLES: Final = re.compile(r"^(?:the|a|an|my|our)\s+")
PLACE_WORDS: Final[Mapping[str, tuple[str, ...]]] = {
    "church": ("chapel", "cathedral", "kirk"),
    "station": ("train station", "railway station", "trains"),
    "school": ("primary", "kindergarten"),
    "bakery": ("baker", "baker's", "bakers"),
    "town_hall": ("city hall", "town council"),
    "hospital": ("clinic", "emergency room", "a and e", "accident and emergency", "er"),
    "pharmacy": ("chemist", "chemist's", "chemists", "drugstore", "drug store"),
    "supermarket": ("grocery store", "grocery", "groceries", "grocer", "food shop"),
    "hotel": ("inn", "guest house", "guesthouse"),
    "museum": ("gallery",),
    "post_office": ("post",),
    "bus_stop": ("bus station",),
}
"""Other names of a kind of place."""


def places_called(places: Sequence[Place], name: str) -> tuple[Place, ...]:
    """The places that words may mean: by their whole name or kind, else by a part of it."""
    wanted = _ARTICLES.sub("", name.strip().casefold())
    kinds = {one.kind: one.kind.casefold().replace("_", " ") for one in places}
    exact = tuple(one for one in places if wanted in (one.name.casefold(), one.kind.casefold(), kinds[one.kind]))
    if exact or not wanted:
        return exact
    return tuple(one for one in places if wanted in one.name.casefold() or kinds[one.kind] in wanted)


@dataclass(frozen=True, slots=True)
class SumoNet:
    """The SUMO network of a town; same frame as the road graph.

    Attributes:
        path: The `.net.xml` or `.net.xml.gz`; its traffic lights run the pack's cycles, `tls` names them.
        lanes: SUMO lanes of each lane of the road graph, in driving order (SUMO joins lane sections, and splits lanes
            at its junctions); empty where SUMO has none.
        graph_lanes: The other way round.
        links: SUMO's traffic light and link indices of each head: {head: (traffic light, (index, ...))}.
    """

    path: Path
    lanes: Mapping[LaneId, tuple[str, ...]]
    graph_lanes: Mapping[str, tuple[LaneId, ...]]
    links: Mapping[str, tuple[str, tuple[int, ...]]]


@dataclass(frozen=True)
class MapPack:
    """A town.

    Attributes:
        name: E.g. `Town02`.
        road: Its lanes.
        signals: Lights, grouped by junction.
        signs: Stop, yield and speed limit signs.
        stop_boxes: Of stop and yield signs, by id: corners of the ground in which a car is at the sign.
        crossings: Where people cross.
        places: Landmarks with names.
        sumo: Its SUMO network; None in a pack built without.
        xodr: The OpenDRIVE file, perhaps compressed: `xodr_text` reads it.
        source_hash: SHA-256 of everything that it was built from.
        notes: What its data lack or guess, for people.
    """

    name: str
    road: RoadGraph
    signals: tuple[SignalGroup, ...]
    signs: tuple[Sign, ...]
    stop_boxes: Mapping[str, tuple[Point, ...]]
    crossings: tuple[Crossing, ...]
    places: tuple[Place, ...]
    sumo: SumoNet | None
    xodr: Path
    source_hash: str
    notes: tuple[str, ...] = ()

    def xodr_text(self) -> str:
        """The OpenDRIVE file. Raises OSError."""
        return _read(self.xodr).decode()

    @cached_property
    def opendrive(self) -> OpenDriveMap:
        """The OpenDRIVE file, read: elevation, objects, editors' signals. Raises OpenDriveError, OSError."""
        return parse_opendrive(_read(self.xodr))

    @cached_property
    def levels(self) -> Levels:
        """Roads that lie over one another. Raises OpenDriveError, OSError."""
        return Levels(self.opendrive)

    @cached_property
    def group_of_lane(self) -> Mapping[LaneId, tuple[SignalGroup, int]]:
        """(group, index of its head) that rules a lane before a junction."""
        return {lane: (group, i) for group in self.signals for i, head in enumerate(group.heads) for lane in head.lanes}

    def signals_at(self, time_s: float) -> tuple[Signal, ...]:
        """All lights at a time, as their cycles say."""
        return tuple(signal for group in self.signals for signal in group.signals(time_s))


def maps_folder() -> Path:
    """Folder of built packs: `maps` in the user's data folder."""
    return data_home() / "maps"


def read_pack(folder: Path) -> MapPack:
    """Read the pack in a folder; the packs read last are kept until their files change.

    Raises:
        DataError: It cannot be read; says what to do.
    """
    try:
        return _unpacked(folder, _state(folder))
    except OSError as error:
        raise DataError(
            f"Cannot read the map pack {folder}: {error}.", hint="Build it again: chauffeur maps build."
        ) from error
    except (OpenDriveError, AttributeError, EOFError, LookupError, TypeError, ValueError, zlib.error) as error:
        raise DataError(
            f"The map pack {folder} is damaged: {error!r}.", hint="Build it again: chauffeur maps build."
        ) from error


def _read(path: Path) -> bytes:
    content = path.read_bytes()
    return gzip.decompress(content) if path.suffix == ".gz" else content


# On disk --------------------------------------------------------------------------------------------------------------


def save(pack: MapPack, folder: Path) -> None:
    """Write `pack.json` beside the files of a pack, which lie in the folder already. Raises OSError."""
    content: dict[str, Any] = {
        "builder": BUILDER_VERSION,
        "name": pack.name,
        "source_hash": pack.source_hash,
        "notes": pack.notes,
        "xodr": pack.xodr.name,
        "signals": [
            {
                "id": group.id,
                "junction": group.junction,
                "offset_s": group.offset_s,
                "heads": [
                    {"id": head.id, "lanes": head.lanes, "stop_line_m": head.stop_line_m, "stop_box_m": head.stop_box_m}
                    for head in group.heads
                ],
                "phases": [[phase.seconds, *phase.states] for phase in group.phases],
            }
            for group in pack.signals
        ],
        "signs": [
            {
                "id": sign.id,
                "kind": sign.kind,
                "lanes": sign.lanes,
                "at_m": (sign.x_m, sign.y_m),
                "stop_line_m": sign.stop_line_m,
                "stop_box_m": pack.stop_boxes.get(sign.id),
                "value": sign.value,
            }
            for sign in pack.signs
        ],
        "crossings": [
            {
                "id": one.id,
                "polygon_m": one.polygon_m,
                "centre_m": one.centre_m,
                "width_m": one.width_m,
                "lanes": one.lanes,
                "junction": one.junction,
            }
            for one in pack.crossings
        ],
        "places": [[one.name, one.kind, one.x_m, one.y_m, one.lane, one.station_m] for one in pack.places],
        "sumo": None
        if pack.sumo is None
        else {
            "net": pack.sumo.path.name,
            "lanes": dict(pack.sumo.lanes),
            "graph_lanes": dict(pack.sumo.graph_lanes),
            "links": dict(pack.sumo.links),
        },
    }
    (folder / PACK_FILE).write_text(json.dumps(_rounded(content), indent=None, separators=(",", ":")) + "\n")


def compress(folder: Path) -> None:
    """Compress a pack where it lies, to the same bytes every time. Raises OSError."""
    content = json.loads((folder / PACK_FILE).read_text())
    content["xodr"] += ".gz"
    if content["sumo"] is not None:
        content["sumo"]["net"] += ".gz"
    (folder / PACK_FILE).write_text(json.dumps(content, separators=(",", ":")) + "\n")
    for path in sorted(folder.iterdir()):
        path.with_name(path.name + ".gz").write_bytes(gzip.compress(path.read_bytes(), 9, mtime=0))
        path.unlink()


def _rounded(content: Any) -> Any:
    """Millimetres are enough."""
    if isinstance(content, float):
        return round(content, 3)
    if isinstance(content, Mapping):
        return {key: _rounded(one) for key, one in content.items()}  # pyright: ignore[reportUnknownVariableType]
    return [_rounded(one) for one in content] if isinstance(content, list | tuple) else content  # pyright: ignore


def _state(folder: Path) -> tuple[tuple[str, int, int], ...]:
    """Files of a pack with their modification times."""
    files = [(path.name, path.stat()) for path in folder.iterdir()]
    return tuple(sorted((name, found.st_size, found.st_mtime_ns) for name, found in files))


@lru_cache(maxsize=8)
def _unpacked(folder: Path, state: tuple[tuple[str, int, int], ...]) -> MapPack:
    del state  # read anew when it is another
    written = folder / PACK_FILE
    content = parse_json(_read(written if written.is_file() else folder / (PACK_FILE + ".gz")))
    if not isinstance(content, dict):
        raise TypeError(f"{PACK_FILE} holds no fields")
    if (builder := content.get("builder", "an older one")) != BUILDER_VERSION:
        raise DataError(
            f"The map pack {folder} was built by {builder}, and this Chauffeur builds {BUILDER_VERSION}.",
            hint="Build it again from its file: chauffeur maps build FILE.xodr. "
            "A public town of CARLA's: chauffeur maps pull NAME. One of ours: chauffeur maps build NAME.",
        )
    xodr = folder / content["xodr"]
    parsed = parse_opendrive(_read(xodr))
    sumo = content["sumo"]
    pack = MapPack(
        name=content["name"],
        road=parsed.road,
        signals=tuple(_group(one) for one in content["signals"]),
        signs=tuple(_sign(one) for one in content["signs"]),
        stop_boxes={one["id"]: _points(one["stop_box_m"]) for one in content["signs"] if one["stop_box_m"]},
        crossings=tuple(
            Crossing(
                one["id"],
                _points(one["polygon_m"]),
                _line(one["centre_m"]),
                one["width_m"],
                tuple(one["lanes"]),
                one["junction"],
            )
            for one in content["crossings"]
        ),
        places=tuple(Place(*one) for one in content["places"]),
        sumo=None
        if sumo is None
        else SumoNet(
            folder / sumo["net"],
            {lane: tuple(many) for lane, many in sumo["lanes"].items()},
            {lane: tuple(many) for lane, many in sumo["graph_lanes"].items()},
            {head: (tls, tuple(links)) for head, (tls, links) in sumo["links"].items()},
        ),
        xodr=xodr,
        source_hash=content["source_hash"],
        notes=tuple(content["notes"]),
    )
    pack.__dict__["opendrive"] = parsed
    return pack


def _points(content: list[list[float]]) -> tuple[Point, ...]:
    return tuple((float(x), float(y)) for x, y in content)


def _line(content: list[list[float]]) -> Line:
    first, last = _points(content)
    return first, last


def _group(content: dict[str, Any]) -> SignalGroup:
    return SignalGroup(
        content["id"],
        content["junction"],
        tuple(
            SignalHead(one["id"], tuple(one["lanes"]), _line(one["stop_line_m"]), _points(one["stop_box_m"]))
            for one in content["heads"]
        ),
        tuple(SignalPhase(float(seconds), tuple(states)) for seconds, *states in content["phases"]),
        content["offset_s"],
    )


def _sign(content: dict[str, Any]) -> Sign:
    x, y = content["at_m"]
    line = content["stop_line_m"]
    return Sign(
        content["id"], content["kind"], tuple(content["lanes"]), x, y, _line(line) if line else None, content["value"]
    )
