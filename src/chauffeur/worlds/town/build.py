"""Building a map pack: OpenDRIVE, tables of stop lines and light cycles, and the SUMO net that goes with them."""

from __future__ import annotations

import hashlib
import shutil
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from chauffeur.concept import DataError, Sign
from chauffeur.concept.data import parse_json
from chauffeur.geometry import LaneId, RoadGraph
from chauffeur.geometry.opendrive import OpenDriveError, OpenDriveMap, read_opendrive
from chauffeur.worlds.town.pack import (
    BUILDER_VERSION,
    PACK_FILE,
    Crossing,
    MapPack,
    Point,
    SignalGroup,
    SumoNet,
    maps_folder,
    read_pack,
    save,
)
from chauffeur.worlds.town.roadside import (
    crossings_of,
    guessed_group,
    lit_junctions,
    net_junctions,
    places_of,
    signs_of,
)
from chauffeur.worlds.town.signals import carla_tables, junction_of
from chauffeur.worlds.town.sumo_net import ReshapedNet, convert, reshape

_LOOK_BACK, _LOOK_BACK_M = 8, 40.0
"""A stop line lies at most so many lane sections, each no longer than this, before the junction of its light."""


@dataclass(frozen=True)
class MapSources:
    """Sources of a map pack.

    Attributes:
        xodr: OpenDRIVE file.
        stop_lines: Stop lines of lights and signs, in CARLA's frame (JSON list).
        cycles: Light cycles (JSON list of groups).
        lights: A SUMO network of the town that says which junctions have lights, where no table does.
        note: What it is, of a map whose lights and signs are as they are meant to be.
    """

    xodr: Path
    stop_lines: Path | None = None
    cycles: Path | None = None
    lights: Path | None = None
    note: str = ""

    @property
    def hash(self) -> str:
        """SHA-256 of all of it. Raises OSError."""
        digest = hashlib.sha256(BUILDER_VERSION.encode())
        for path in (self.xodr, self.stop_lines, self.cycles, self.lights):
            digest.update(b"\0" if path is None else hashlib.sha256(path.read_bytes()).digest())
        digest.update(self.note.encode())
        return digest.hexdigest()


def sources_of(xodr: Path) -> MapSources:
    """A file with the tables that lie beside it, or in a folder `signals` beside its own, by the name of the town."""

    def beside(suffix: str) -> Path | None:
        names = [xodr.with_name(f"carla_{xodr.stem}_{suffix}.json")]
        names.append(xodr.parent.parent / "signals" / names[0].name)
        return next((path for path in names if path.is_file()), None)

    net = xodr.with_suffix(".net.xml")
    return MapSources(xodr, beside("stoplines"), beside("traffic_light_controller"), net if net.is_file() else None)


def build(sources: MapSources, name: str = "", folder: Path | None = None) -> MapPack:
    """A pack from its sources, into a folder (by default the user's maps folder); not again what is there already.

    Raises:
        DataError: A source cannot be read, or netconvert refuses it.
        MissingExtraError: netconvert is not installed.
    """
    name = name or sources.xodr.stem
    folder = folder if folder is not None else maps_folder() / name
    try:
        source_hash = sources.hash
        if (folder / PACK_FILE).is_file() and _hash_of(folder) == source_hash:
            return read_pack(folder)
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{name}-", dir=folder.parent) as scratch:
            made = Path(scratch) / "pack"
            made.mkdir()
            _build(sources, name, made, source_hash)
            if folder.exists():
                shutil.rmtree(folder)
            made.rename(folder)
    except OSError as error:
        raise DataError(f"Cannot build the map {name} into {folder}: {error}.") from error
    return read_pack(folder)


def build_own(name: str, seed: int | None = None, folder: Path | None = None) -> MapPack:
    """One of our own towns, drawn from its recipe; another seed is another town, named with it.

    Raises:
        DataError: There is no such recipe.
        MissingExtraError: scenariogeneration or netconvert is not installed.
    """
    from chauffeur.worlds.town.opendrive_writer import draw
    from chauffeur.worlds.town.recipes import TOWNS, plan_of

    if name not in TOWNS:
        raise DataError(f"There is no town {name!r} of ours.", hint=f"There are {', '.join(TOWNS)}.")
    plan = plan_of(name, seed)
    full = name if seed is None or seed == TOWNS[name][1] else f"{name}-{seed}"
    with tempfile.TemporaryDirectory(prefix="chauffeur-town-") as scratch:
        xodr = Path(scratch) / f"{full}.xodr"
        xodr.write_bytes(draw(plan))
        return build(MapSources(xodr, note=f"Invented: recipe {name}, seed {plan.seed}."), full, folder)


def _hash_of(folder: Path) -> str:
    try:
        return str(parse_json((folder / PACK_FILE).read_text()).get("source_hash", ""))
    except ValueError:
        return ""


def _build(sources: MapSources, name: str, folder: Path, source_hash: str) -> None:
    try:
        parsed = read_opendrive(sources.xodr)
    except OpenDriveError as error:
        raise DataError(f"{sources.xodr} is no OpenDRIVE file that can be read: {error}") from error
    left = sum(one.left_hand for one in parsed.document.roads.values())
    if left:
        raise DataError(
            f"{sources.xodr} has {left} roads that keep left (rule LHT).",
            hint="A town's traffic and driver keep right; `parse_opendrive` reads such roads.",
        )
    road = parsed.road
    crossings = crossings_of(parsed)
    groups, signs, boxes, notes = _lights_and_signs(sources, parsed, crossings)
    notes = (*notes, *parsed.remarks)
    net = folder / "map.net.xml"
    # A group may stand at two junctions, where a street is crossed in two steps.
    lit = {junction_of(road, head.lanes) for group in groups for head in group.heads}
    convert(sources.xodr, parsed, net, sorted(lit & road.junctions.keys()))
    made = reshape(net, road)
    links = _light(made, road, groups)
    if groups and (inside := sum(head.id not in links for group in groups for head in group.heads)):
        notes = (*notes, f"{inside} lights stand inside junctions, where SUMO's traffic cannot stop for them.")
    ET.ElementTree(made.root).write(net, encoding="UTF-8", xml_declaration=True)
    shutil.copyfile(sources.xodr, folder / "map.xodr")
    save(
        MapPack(
            name,
            road,
            groups,
            signs,
            boxes,
            crossings,
            places_of(parsed),
            SumoNet(
                net,
                {lane: tuple(many) for lane, many in made.lanes.items()},
                {lane: tuple(many) for lane, many in made.graph_lanes.items()},
                links,
            ),
            folder / "map.xodr",
            source_hash,
            notes,
        ),
        folder,
    )


def _lights_and_signs(
    sources: MapSources, parsed: OpenDriveMap, crossings: Sequence[Crossing]
) -> tuple[tuple[SignalGroup, ...], tuple[Sign, ...], dict[str, tuple[Point, ...]], tuple[str, ...]]:
    """(lights, signs, stop boxes, notes): tables know more than the file; without them the cycles are a guess."""
    signs, boxes = signs_of(parsed)
    if sources.stop_lines is not None and sources.cycles is not None:
        groups, told, told_boxes = carla_tables(parsed.road, _table(sources.stop_lines), _table(sources.cycles))
        kept = tuple(sign for sign in signs if sign.kind == "speed_limit")
        return groups, (*told, *kept), told_boxes, ()
    lit = dict.fromkeys(lit_junctions(parsed))
    if sources.lights is not None:
        lit.update(dict.fromkeys(net_junctions(parsed.road, sources.lights)))
    groups = tuple(group for one in lit if (group := guessed_group(parsed.road, one, crossings)) is not None)
    if sources.note:
        return groups, signs, boxes, (sources.note,)
    notes = (
        [f"The cycles of its {len(groups)} traffic lights are a guess: no table came with the map."] if groups else []
    )
    if not any(sign.kind == "stop" for sign in signs):
        notes.append("The map says nothing of stop signs.")
    return groups, signs, boxes, tuple(notes)


def _table(path: Path) -> list[Any]:
    try:
        content = parse_json(path.read_text())
    except ValueError as error:
        raise DataError(f"{path} is no JSON: {error}.") from error
    if not isinstance(content, list):
        raise DataError(f"{path} is no list.")
    return content  # pyright: ignore[reportUnknownVariableType]


def _ruling(
    lanes: Sequence[LaneId], heads_of: Mapping[LaneId, list[tuple[SignalGroup, int]]], road: RoadGraph
) -> list[tuple[SignalGroup, int]]:
    """The heads that rule who comes along some lanes: at them, or a little before; seldom two over one lane."""
    rim, seen = list(reversed(lanes)), set[LaneId]()
    while rim and len(seen) < _LOOK_BACK:
        lane = rim.pop(0)
        if lane in heads_of:
            return heads_of[lane]
        if lane not in seen:
            seen.add(lane)
            if road[lane].length_m < _LOOK_BACK_M:
                before = road.predecessors(lane)
                rim += [one.id for one in before if not one.junction or one.id in heads_of]
    return []


def _light(
    made: ReshapedNet, road: RoadGraph, groups: tuple[SignalGroup, ...]
) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Replace SUMO's programs by the pack's cycles; the links that each head switches."""
    heads_of: dict[LaneId, list[tuple[SignalGroup, int]]] = {}
    for group in groups:
        for i, head in enumerate(group.heads):
            for lane in head.lanes:
                heads_of.setdefault(lane, []).append((group, i))
    links: dict[str, dict[int, list[tuple[SignalGroup, int]]]] = {}
    protected: dict[str, dict[int, bool]] = {}
    for link in made.root.findall("connection"):
        tls = link.get("tl")
        if tls is None:
            continue
        before = made.graph_lanes.get(f"{link.get('from')}_{link.get('fromLane')}", ())
        ruled = _ruling(before, heads_of, road)
        index = int(link.get("linkIndex", "0"))
        protected.setdefault(tls, {})[index] = link.get("state") == "O"
        if ruled:
            links.setdefault(tls, {})[index] = ruled
    found: dict[str, tuple[str, list[int]]] = {}
    for program in made.root.findall("tlLogic"):
        tls = program.get("id", "")
        ruled_links = links.get(tls, {})
        for old in list(program):
            program.remove(old)
        owners = Counter(heads[0][0].id for heads in ruled_links.values()).most_common(1)
        group = next((heads[0][0] for heads in ruled_links.values() if heads[0][0].id == owners[0][0]), None)
        count = max(protected.get(tls, {0: False})) + 1
        if group is None:
            ET.SubElement(program, "phase", duration="86400", state="O" * count)
            continue
        program.set("offset", f"{-group.offset_s:g}")
        for phase in group.phases:
            state = ""
            for index in range(count):
                own = [head for owner, head in ruled_links.get(index, ()) if owner is group]
                green = "G" if protected[tls].get(index) else "g"
                letters = {"red": "r", "yellow": "y", "green": green, "off": "o"}
                state += letters[phase.states[own[0]]] if own else "o"
            ET.SubElement(program, "phase", duration=f"{phase.seconds:g}", state=state)
        for index, heads in ruled_links.items():
            for owner, head in heads:
                if owner is group:
                    found.setdefault(group.heads[head].id, (tls, []))[1].append(index)
    return {head: (tls, tuple(sorted(many))) for head, (tls, many) in found.items()}
