"""OpenStreetMap files as tools write them: nodes behind their ways, roads that are gone, relations alone."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import pytest

from chauffeur.concept import DataError

pytest.importorskip("osmium", reason="needs the extra `map`")

from chauffeur.describe.services import load_road_map
from chauffeur.describe.services.road_map import RoadMap

PLACES = ((11, 48.1, 11.5), (12, 48.1, 11.501), (13, 48.1, 11.502))
EACH = [f'<node id="{name}" lat="{lat}" lon="{lon}" version="1"/>' for name, lat, lon in PLACES]
NODES = "".join(EACH)
REFS = "".join(f'<nd ref="{name}"/>' for name, _, _ in PLACES)
PLACED = "".join(f'<nd ref="{name}" lat="{lat}" lon="{lon}"/>' for name, lat, lon in PLACES)


def way(name: str, *, number: int = 1, attributes: str = 'version="1"', refs: str = REFS, tags: bool = True) -> str:
    told = f'<tag k="highway" v="residential"/><tag k="name" v="{name}"/>' if tags else ""
    return f'<way id="{number}" {attributes}>{refs}{told}</way>'


def read(tmp_path: Path, *inside: str, name: str = "map.osm", root: str = "osm") -> RoadMap:
    text = f'<?xml version="1.0"?><{root} version="0.6" generator="x">{"".join(inside)}</{root}>'.encode()
    (tmp_path / name).write_bytes(gzip.compress(text) if name.endswith(".gz") else text)
    return load_road_map(tmp_path / name)


def names(found: RoadMap) -> list[str]:
    return sorted(one.name for one in found.ways)


VERSION_1, VERSION_2 = (f'version="{number}" visible="true"' for number in (1, 2))
GONE_2 = 'version="2" visible="false"'
NEGATIVE = NODES.replace('id="1', 'id="-1')
NEGATIVE_REFS = REFS.replace('ref="1', 'ref="-1')


@pytest.mark.parametrize("name", ["map.osm", "map.osm.gz"])
@pytest.mark.parametrize(
    "inside",
    [
        (NODES, way("A")),
        (way("A"), NODES),
        (EACH[0], way("A"), *EACH[1:]),
        (way("A", refs=PLACED),),
        (way("A", refs="<bounds minlat='48' minlon='11' maxlat='49' maxlon='12'/>" + PLACED),),
        (way("A", number=-5, attributes="action='modify'", refs=NEGATIVE_REFS), NEGATIVE),
        (NEGATIVE, way("A", number=-5, attributes="", refs=NEGATIVE_REFS)),
    ],
)
def test_in_whatever_order_roads_and_nodes_come_the_roads_are_there(
    tmp_path: Path, inside: tuple[str, ...], name: str
) -> None:
    found = read(tmp_path, *inside, name=name)
    assert names(found) == ["A"] and len(found.ways[0].points) == 3
    assert found.ways[0].points[0] == pytest.approx((48.1, 11.5))


@pytest.mark.parametrize(
    ("ways", "kept"),
    [
        ([way("Gone", attributes="action='delete'"), way("B", number=2)], ["B"]),
        ([way("Gone", attributes="visible='false' version='2'"), way("B", number=2)], ["B"]),
        ([way("Gone", attributes='version="3" visible="false"'), way("B", number=2)], ["B"]),
        ([way("Gone", attributes="visible='true' action='delete'"), way("B", number=2)], ["B"]),
        ([way("Old", attributes=VERSION_1), way("New", attributes=VERSION_2)], ["New"]),
        ([way("New", attributes='version="2"'), way("Old", attributes='version="1"')], ["New"]),
        (
            [way("Was", attributes=VERSION_1), way("", attributes=GONE_2, tags=False), way("B", number=2)],
            ["B"],
        ),
        ([way("Kept", attributes="action='modify'"), way("B", number=2)], ["B", "Kept"]),
        ([way("action='delete'"), way("B", number=2)], ["B", "action='delete'"]),
    ],
)  # fmt: skip
def test_what_is_marked_as_gone_is_not_there(tmp_path: Path, ways: list[str], kept: list[str]) -> None:
    assert names(read(tmp_path, NODES, *ways)) == kept


@pytest.mark.parametrize(
    ("inside", "says"),
    [
        ((way("A"),), "places of their nodes"),
        ((way("A"), EACH[0]), "places of their nodes"),
        (('<relation id="1"><member type="way" ref="1" role=""/><tag k="type" v="route"/></relation>',), "relations"),
        ((NODES, way("A", attributes="action='delete'")), "no roads that are there"),
        ((NODES, way("A", tags=False)), "no roads"),
        ((), "no roads"),
    ],
)
def test_where_no_road_is_left_it_is_said_why(tmp_path: Path, inside: tuple[str, ...], says: str) -> None:
    with pytest.raises(DataError, match=says):
        read(tmp_path, *inside)


def test_files_from_the_field(case_folder: Callable[[str], Path]) -> None:
    for path in sorted(case_folder("osm-ways-first").glob("*.osm")):
        assert names(load_road_map(path)) == ["Test Street"]
    assert names(load_road_map(case_folder("osm-deleted-ways") / "map.osm")) == ["New Street"]
