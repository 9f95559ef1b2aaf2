"""A map from an OpenStreetMap file (`.osm.pbf`, `.osm.bz2`, `.osm`), read once, offline."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final

from chauffeur.concept import DataError, MissingExtraError
from chauffeur.describe.services.road_map import RoadMap
from chauffeur.describe.services.ways import DRIVEABLE, ServiceWay, way_of

if TYPE_CHECKING:
    import osmium.io

MAX_BYTES: Final = 300_000_000
"""A larger file is not read: its roads would take tens of gigabytes of memory."""
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
        import osmium.filter
        import osmium.osm
    except ImportError as error:
        raise MissingExtraError("Reading maps needs pyosmium.", extra="map") from error
    try:
        # Filtered in C++: only roads come as far as Python, and nodes only as places of their points.
        processor = (
            osmium.FileProcessor(os.fspath(path))
            .with_locations()
            .with_filter(osmium.filter.EntityFilter(osmium.osm.WAY))
            .with_filter(osmium.filter.KeyFilter("highway"))
        )
        ways = tuple(_ways(processor))
        as_of_s = _as_of(processor.header)
    except (RuntimeError, ValueError, OSError) as error:  # what libosmium makes of a broken file
        raise DataError(
            f"The map {path} cannot be read: it is not whole, or not what its name says.", hint="Fetch it again."
        ) from error
    if not ways:
        raise DataError(f"The map {path} has no roads.", hint="Take a file that was not filtered down to other things.")
    return RoadMap(ways, source=f"OpenStreetMap file {path.name}", as_of_s=changed_s if as_of_s is None else as_of_s)


def _ways(items: Iterable[object]) -> Iterator[ServiceWay]:
    import osmium.osm

    for item in items:
        if not isinstance(item, osmium.osm.Way) or item.tags.get("highway") not in DRIVEABLE:
            continue
        # Extracts end at a border: nodes beyond it are named in the way and missing in the file.
        points = [(node.lat, node.lon) for node in item.nodes if node.location.valid()]
        way = way_of(int(item.id), {tag.k: tag.v for tag in item.tags}, points)
        if way is not None:
            yield way


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
