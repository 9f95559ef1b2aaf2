"""A map from an OpenStreetMap file (`.osm.pbf`, `.osm.bz2`, `.osm`), read once, offline."""

from __future__ import annotations

import bz2
import gzip
import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from chauffeur.concept import DataError, MissingExtraError
from chauffeur.describe.services.outside import unix_time
from chauffeur.describe.services.road_map import RoadMap, geometry
from chauffeur.describe.services.ways import DRIVEABLE, way_of

if TYPE_CHECKING:
    import osmium

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
        MissingExtraError: pyosmium or shapely is not installed.
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
        raise MissingExtraError("Reading maps needs pyosmium.", extra="map") from error
    geometry()
    try:
        places: dict[int, tuple[float, float]] = {}
        processor, roads = _roads(path, *_marked_as_gone(path), places)
        _locate(path, roads, places)
        # Extracts end at a border: nodes beyond it are named in the way and missing in the file.
        drawn = (way_of(road.id, road.tags, (places[node] for node in road.nodes if node in places)) for road in roads)
        ways = tuple(way for way in drawn if way is not None)
        relations = 0 if roads else sum(1 for _ in osmium.FileProcessor(os.fspath(path), osmium.osm.RELATION))
    except (RuntimeError, ValueError, OSError, EOFError) as error:  # what libosmium makes of a broken file
        raise DataError(
            f"The map {path} cannot be read: it is not whole, or not what its name says.", hint="Fetch it again."
        ) from error
    if not ways:
        raise _no_roads(path, len(roads), relations)
    stamps = (unix_time(processor.header.get(name)) for name in ("osmosis_replication_timestamp", "timestamp"))
    as_of_s = next((stamp for stamp in stamps if stamp is not None), changed_s)
    return RoadMap(ways, source=f"OpenStreetMap file {path.name}", as_of_s=as_of_s)


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
    """A road as it stands in the file, its nodes by number."""

    id: int
    version: int
    tags: Mapping[str, str]
    nodes: tuple[int, ...]


def _roads(
    path: Path, gone: Collection[int], has_history: bool, places: dict[int, tuple[float, float]]
) -> tuple[osmium.FileProcessor, list[_Road]]:
    """The newest version of every road that is not marked as gone; fills in `places` of nodes that stand in ways."""
    import osmium
    import osmium.filter
    import osmium.osm

    # Filtered in C++: only ways come as far as Python.
    processor = osmium.FileProcessor(os.fspath(path), osmium.osm.WAY)
    if not has_history and not processor.header.has_multiple_object_versions:
        processor = processor.with_filter(osmium.filter.KeyFilter("highway"))
    newest: dict[int, _Road | int] = {}
    for item in processor:
        if not isinstance(item, osmium.osm.Way):
            continue
        # With `out geom` of Overpass, nodes stand in the ways themselves.
        places.update((node.ref, (node.lat, node.lon)) for node in item.nodes if node.location.valid())
        known = newest.get(item.id, 0)
        if item.version < (known if isinstance(known, int) else known.version):
            continue
        if item.deleted or not item.visible or item.id in gone or item.tags.get("highway") not in DRIVEABLE:
            newest[item.id] = item.version
            continue
        tags = {tag.k: tag.v for tag in item.tags}
        newest[item.id] = _Road(int(item.id), item.version, tags, tuple(node.ref for node in item.nodes))
    return processor, [road for road in newest.values() if isinstance(road, _Road)]


def _locate(path: Path, roads: Sequence[_Road], places: dict[int, tuple[float, float]]) -> None:
    """Fill in the places of the nodes of roads, which may stand before the roads or behind them."""
    import osmium
    import osmium.filter
    import osmium.osm

    wanted = {node for road in roads for node in road.nodes}
    if not wanted:
        return
    processor = osmium.FileProcessor(os.fspath(path), osmium.osm.NODE)
    if min(wanted) > 0:  # the filter knows no numbers below zero, which editors give to new nodes
        processor = processor.with_filter(osmium.filter.IdFilter(wanted))
    for item in processor:
        if isinstance(item, osmium.osm.Node) and item.id in wanted and item.visible and item.location.valid():
            places[item.id] = item.lat, item.lon


def _marked_as_gone(path: Path) -> tuple[frozenset[int], bool]:
    """What the text of an XML file says that libosmium passes over: (ways that an editor is about to delete, JOSM's
    `action`; whether versions are marked as gone, which have no tags to be found by).

    Raises:
        DataError: It unpacks to more than is read.
    """
    name = path.name.lower()
    if name.endswith(".pbf"):
        return frozenset(), False
    ways: set[int] = set()
    has_history, size, rest = False, 0, b""
    unpacked = gzip.open if name.endswith(".gz") else bz2.open if name.endswith(".bz2") else open
    with unpacked(path, "rb") as file:
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
    return frozenset(ways), has_history
