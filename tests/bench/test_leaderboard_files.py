"""Route files of other versions, and runs in which nothing can be driven."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.leaderboard.benchmark import LeaderboardBenchmark
from chauffeur.bench.leaderboard.routes import LeaderboardRoute, read_routes
from chauffeur.cli.main import app
from chauffeur.concept import DataError

OLD = '<waypoint x="{x}" y="{y}" z="0.0" pitch="0.0" roll="0.0" yaw="{yaw}"/>'
NEW = '<position x="{x}" y="{y}" z="0.0"/>'


def routes(tmp_path: Path, *inside: str) -> tuple[LeaderboardRoute, ...]:
    path = tmp_path / "routes.xml"
    path.write_text(f"<routes>{''.join(inside)}</routes>")
    return read_routes(path).routes


def run(path: Path, out: Path) -> Result:
    words = f"bench leaderboard --planner expert --routes {path} --scenarios none --seeds 1 --workers 1 --out {out}"
    return CliRunner().invoke(app, words.split())


def test_ways_of_leaderboard_2_are_read(tmp_path: Path) -> None:
    points = "".join(NEW.format(x=x, y=y) for x, y in ((0, 0), (30, 0), (30, 40)))
    extra = '<scenarios><scenario name="a"><trigger_point x="1" y="2" z="0" yaw="3"/></scenario></scenarios>'
    (found,) = routes(tmp_path, f'<route id="0" town="Town12"><waypoints>{points}</waypoints>{extra}</route>')
    assert not found.fault and not found.headed and found.town == "Town12"
    assert [(one.x_m, one.y_m) for one in found.keypoints] == [(0, 0), (30, 0), (30, -40)]
    assert [one.heading_rad for one in found.keypoints] == pytest.approx([0.0, -math.pi / 2, -math.pi / 2])


@pytest.mark.parametrize(
    ("attributes", "town"),
    [
        ('town="Town05"', "Town05"), ('map="Town05"', "Town05"), ('town="" map="Town05"', "Town05"),
        ('town="Carla/Maps/Town05"', "Town05"), ('town="/Game/Carla/Maps/Town05"', "Town05"),
        ('town="Town04" map="Town05"', "Town04"),
    ],
)  # fmt: skip
def test_the_town_is_found_where_it_is_written(tmp_path: Path, attributes: str, town: str) -> None:
    points = OLD.format(x=0, y=0, yaw=0) + OLD.format(x=9, y=0, yaw=90)
    (found,) = routes(tmp_path, f'<route id="0" {attributes}>{points}</route>')
    assert (found.town, found.fault, found.headed) == (town, "", True)
    assert found.keypoints[1].heading_rad == pytest.approx(-math.pi / 2)


@pytest.mark.parametrize(
    ("inside", "says"),
    [
        ("", "0 waypoints"),
        (NEW.format(x=0, y=0), "0 waypoints"),  # outside of <waypoints> it is none
        (OLD.format(x=0, y=0, yaw=0), "1 waypoints"),
        (OLD.format(x="nan", y=0, yaw=0) + OLD.format(x=0, y=0, yaw=0), "x='nan'"),
        (OLD.format(x="1e9", y=0, yaw=0) + OLD.format(x=0, y=0, yaw=0), "x='1e9'"),
        ('<waypoint x="0"/>' + OLD.format(x=0, y=0, yaw=0), "y is missing"),
        (f"<waypoints>{NEW.format(x='left', y=0)}</waypoints>", "x='left'"),
    ],
)
def test_a_way_that_is_none_is_a_fault_in_words(tmp_path: Path, inside: str, says: str) -> None:
    (found,) = routes(tmp_path, f'<route id="0" town="Town05">{inside}</route>')
    assert says in found.fault and not found.keypoints


def test_routes_without_an_id_of_their_own_keep_their_place(tmp_path: Path) -> None:
    points = OLD.format(x=0, y=0, yaw=0) + OLD.format(x=9, y=0, yaw=0)
    names = ('id="2"', 'id="2"', "")
    found = routes(tmp_path, *(f'<route {name} town="Town05">{points}</route>' for name in names))
    assert [bool(one.fault) for one in found] == [False, True, True]
    assert len({one.id for one in found}) == 3


@pytest.mark.parametrize(
    "content",
    [b"", b"[]", b"<a", b"<routes/>", b'<!DOCTYPE a [<!ENTITY b "c">]><routes/>',
     b'<?xml version="1.0" encoding="x"?><routes/>', b"\0" * 99, None],
)  # fmt: skip
def test_a_file_that_is_none_is_named(tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / "routes.xml").write_bytes(content)
    with pytest.raises(DataError, match=r"routes\.xml"):
        read_routes(tmp_path / "routes.xml")


@pytest.mark.parametrize("case", ["routes-leaderboard2", "routes-map-attribute"])
def test_files_from_the_field_are_driven(case: str, case_folder: Callable[[str], Path]) -> None:
    pytest.importorskip("libsumo", reason="needs the extra `town`")
    bench = LeaderboardBenchmark(str(case_folder(case) / "routes.xml"), "none", seeds=1)
    (item,) = bench.items()
    (row,) = bench.rows(ItemOutcome(item, None, "", bench.job(item, None).run()))
    assert row["rc"] > 90.0 and row["simulated_s"] > 0.0


def test_where_no_route_can_be_driven_there_is_no_score(tmp_path: Path) -> None:
    path = tmp_path / "routes.xml"
    path.write_text('<routes><route id="0" town="Gridford"/><route id="1"/><route id="2" town="Atlantis"/></routes>')
    result = run(path, tmp_path / "run")
    assert result.exit_code == 1, result.output
    said = " ".join(result.output.split())
    assert "None of the 3 items" in said and "0 waypoints" in said and "names no town" in said
    assert json.loads((tmp_path / "run" / "report.json").read_text())["tables"] == []
    assert "Not driven: 3 of 3 items (100 %)" in (tmp_path / "run" / "table.md").read_text()


def test_the_share_that_was_not_driven_is_said_beside_the_score(tmp_path: Path) -> None:
    pytest.importorskip("libsumo", reason="needs the extra `town`")
    points = "".join(NEW.format(x=x, y=0) for x in (0, 30))
    path = tmp_path / "routes.xml"
    good = f'<route id="0" town="Gridford"><waypoints>{points}</waypoints></route>'
    path.write_text(f'<routes>{good}<route id="1" town="Gridford"/></routes>')
    result = run(path, tmp_path / "run")
    assert result.exit_code == 0, result.output
    assert "Not driven: 1 of 2 items (50 %)" in (tmp_path / "run" / "table.md").read_text()
