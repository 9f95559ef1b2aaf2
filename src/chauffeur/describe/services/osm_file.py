"""A map from an OpenStreetMap file (`.osm.pbf`, `.osm.bz2`, `.osm`), read once, offline."""

from __future__ import annotations

import bz2
import gzip
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final

from chauffeur.concept import DataError, MissingExtraError
from chauffeur.describe.services.road_map import RoadMap
from chauffeur.describe.services.ways import DRIVEABLE, way_of

if TYPE_CHECKING:
    import osmium.io

MAX_BYTES: Final = 300_000_000
"""A larger file is not read: its roads would take tens of gigabytes of memory."""
_MOST_UNPACKED_BYTES: Final = 20 * MAX_BYTES
"""XML packs some twelve times smaller."""
_BLOCK_BYTES: Final = 1 << 20
_MOST_TAG_BYTES: Final = 4096
_INVISIBLE: Final = re.compile(rb"""visible=["']false["']""")
_WAY: Final = re.compile(rb"""<way [^<>]{0,2000}""")
_DELETED: Final = re.compile(rb"""[ ]action=["']delete["']""")
_NUMBER: Final = re.compile(rb"""[ ]id=["'](-?[0-9]{1,19})["']""")
_ENDINGS: Final = (".osm.pbf", ".pbf", ".osm.bz2", ".osm.gz", ".osm")


def load_road_map(path: Path) -> RoadMap:
    """The roads of an OpenStreetMap file.

    Args:
        path: The file. Some 60 000 ways take about two seconds.

    Raises:
        DataError: It cannot be read, is too large, or has no roads.
        MissingExtraError: pyosmium is not installed.
    """
    if not path.name.lower().endswith(_ENDINGS):
        raise DataError(f"{path} is not a map.", hint=f"Give an OpenStreetMap file: {', '.join(_ENDINGS)}.")
    try:
        size, changed_s = path.stat().st_size, path.stat().st_mtime
    except OSError as error:
        raise DataError(f"The map {path} cannot be read ({error.strerror}).", hint="Check the path.") from error
    if size > MAX_BYTES:
        raise DataError(
            f"The map {path} has {size / 1e6:.0f} MB; at most {MAX_BYTES / 1e6:.0f} MB are read.",
            hint="Cut out your area: osmium extract --bbox WEST,SOUTH,EAST,NORTH map.osm.pbf -o area.osm.pbf",
        )
    try:
        import osmium
        import osmium.osm
    except ImportError as error:
        raise MissingExtraError("Reading maps needs pyosmium.", hint="Run: pip install 'chauffeur[map]'") from error
    try:
        gone = _marked_as_gone(path)
        header, roads = _roads(path, gone)
        located = _located(path, header, roads)
        ways = tuple(way for road in roads if (way := way_of(road.id, road.tags, _points(road, located))) is not None)
        as_of_s = _as_of(header)
        others = 0 if roads else sum(1 for _ in osmium.FileProcessor(os.fspath(path), osmium.osm.RELATION))
    except DataError:
        raise
    except (RuntimeError, ValueError, OSError, EOFError) as error:  # what libosmium makes of a broken file
        raise DataError(
            f"The map {path} cannot be read: it is not whole, or not what its name says.", hint="Fetch it again."
        ) from error
    if not ways:
        raise _no_roads(path, len(roads), others)
    return RoadMap(ways, source=f"OpenStreetMap file {path.name}", as_of_s=changed_s if as_of_s is None else as_of_s)


def _no_roads(path: Path, unplaced: int, relations: int) -> DataError:
    asked = "Ask Overpass for the nodes as well: (._;>;); out;"
    if unplaced:
        return DataError(f"The map {path} has {unplaced} roads, and not the places of their nodes.", hint=asked)
    if relations:
        return DataError(f"The map {path} has {relations} relations, and none of the roads in them.", hint=asked)
    return DataError(
        f"The map {path} has no roads that are there today.",
        hint="Take a file with ways (highway=*), which was not filtered down to other things.",
    )


@dataclass(frozen=True, slots=True)
class _Road:
    """A road as it stands in the file: its nodes by number, with their places as far as they stood before it."""

    id: int
    version: int
    tags: Mapping[str, str]
    nodes: tuple[tuple[int, tuple[float, float] | None], ...]


def _roads(path: Path, gone: _Gone) -> tuple[osmium.io.Header, list[_Road]]:
    """The newest version of every road that is not marked as gone."""
    import osmium
    import osmium.filter
    import osmium.osm

    # Filtered in C++: only roads come as far as Python, and nodes only as places of their points.
    processor = osmium.FileProcessor(os.fspath(path)).with_locations()
    processor = processor.with_filter(osmium.filter.EntityFilter(osmium.osm.WAY))
    if not gone.has_history and not processor.header.has_multiple_object_versions:
        processor = processor.with_filter(osmium.filter.KeyFilter("highway"))
    newest: dict[int, _Road | int] = {}
    for item in processor:
        if not isinstance(item, osmium.osm.Way):
            continue
        known = newest.get(item.id)
        version = known if isinstance(known, int) else 0 if known is None else known.version
        if item.version < version:
            continue
        if item.deleted or not item.visible or item.id in gone.ways or item.tags.get("highway") not in DRIVEABLE:
            newest[item.id] = item.version
            continue
        nodes = tuple((node.ref, (node.lat, node.lon) if node.location.valid() else None) for node in item.nodes)
        newest[item.id] = _Road(int(item.id), item.version, {tag.k: tag.v for tag in item.tags}, nodes)
    return processor.header, [road for road in newest.values() if isinstance(road, _Road)]


def _located(path: Path, header: osmium.io.Header, roads: Iterable[_Road]) -> dict[int, tuple[float, float]]:
    """Places of nodes that stand behind their roads in the file or in them, as Overpass writes it, or have new numbers.

    Not looked for in a file that says of itself that it is sorted.
    """
    import osmium
    import osmium.filter
    import osmium.osm

    wanted = {ref for road in roads for ref, place in road.nodes if place is None}
    if not wanted or header.get("sorting") == "Type_then_ID":
        return {}
    processor = osmium.FileProcessor(os.fspath(path), osmium.osm.NODE)
    if min(wanted) > 0:
        processor = processor.with_filter(osmium.filter.IdFilter(wanted))
    found: dict[int, tuple[float, float]] = {}
    for item in processor:
        if isinstance(item, osmium.osm.Node) and item.id in wanted and item.visible and item.location.valid():
            found[item.id] = item.lat, item.lon
    if len(found) < len(wanted):  # with `out geom` they stand in the roads themselves
        for item in osmium.FileProcessor(os.fspath(path), osmium.osm.WAY):
            if isinstance(item, osmium.osm.Way):
                inside = ((node.ref, node) for node in item.nodes if node.ref in wanted and node.location.valid())
                found.update((ref, (node.lat, node.lon)) for ref, node in inside)
    return found


def _points(road: _Road, located: Mapping[int, tuple[float, float]]) -> list[tuple[float, float]]:
    # Extracts end at a border: nodes beyond it are named in the way and missing in the file.
    places = (place if place is not None else located.get(ref) for ref, place in road.nodes)
    return [place for place in places if place is not None]


@dataclass(frozen=True, slots=True)
class _Gone:
    """What the text of a file says that libosmium passes over.

    Attributes:
        ways: Ways that an editor is about to delete (JOSM's `action`).
        has_history: Whether some versions are marked as gone, which have no tags to be found by.
    """

    ways: frozenset[int] = frozenset()
    has_history: bool = False


def _marked_as_gone(path: Path) -> _Gone:
    """Look through an XML file for marks of deletion. Raises DataError where it unpacks to more than is read."""
    name = path.name.lower()
    if name.endswith(".pbf"):
        return _Gone()
    ways: set[int] = set()
    has_history, size, rest = False, 0, b""
    with (
        gzip.open(path)
        if name.endswith(".gz")
        else bz2.open(path)
        if name.endswith(".bz2")
        else path.open("rb") as file
    ):
        while block := file.read(_BLOCK_BYTES):
            size += len(block)
            if size > _MOST_UNPACKED_BYTES:
                raise DataError(
                    f"The map {path} unpacks to more than {_MOST_UNPACKED_BYTES / 1e9:g} GB.", hint="Cut out your area."
                )
            text = rest + block
            rest = text[text.rfind(b"<") :][-_MOST_TAG_BYTES:]
            has_history |= b"visible" in text and _INVISIBLE.search(text) is not None
            if b"action" in text:
                for tag in _WAY.findall(text):
                    if _DELETED.search(tag) and (found := _NUMBER.search(tag)):
                        ways.add(int(found[1]))
    return _Gone(frozenset(ways), has_history)


def _as_of(header: osmium.io.Header) -> float | None:
    """Unix time of the data, where whoever cut the file wrote it down."""
    for name in ("osmosis_replication_timestamp", "timestamp"):
        said = header.get(name)
        if said:
            try:
                return datetime.fromisoformat(said.replace("Z", "+00:00")).timestamp()
            except ValueError:
                continue
    return None
