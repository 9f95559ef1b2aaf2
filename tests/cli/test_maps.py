"""`chauffeur maps`."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from chauffeur.cli.main import app
from chauffeur.driving.episode import make_world
from chauffeur.driving.scenarios import find

run = CliRunner()


def test_what_there_is_is_listed_and_drawn(tmp_path: Path) -> None:
    from PIL import Image

    said = run.invoke(app, ["maps", "list"])
    assert said.exit_code == 0
    assert "Gridford" in said.output
    for name in ("map.svg", "map.png"):
        assert run.invoke(app, ["maps", "show", "Gridford", "--out", str(tmp_path / name)]).exit_code == 0
    texts = {node.text for node in ET.parse(tmp_path / "map.svg").iter("{http://www.w3.org/2000/svg}text")}
    assert {"High Street", "St. Mary's Church"} <= texts
    with Image.open(tmp_path / "map.png") as picture:
        assert max(picture.size) == 1600
        assert len(picture.getcolors(1 << 24) or ()) > 50


def test_a_town_is_built_and_found_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("sumo")
    pytest.importorskip("scenariogeneration")
    monkeypatch.setenv("CHAUFFEUR_HOME", str(tmp_path))
    said = run.invoke(app, ["maps", "build", "Ringstead", "--seed", "3"])
    assert said.exit_code == 0, said.output
    assert "seed 3" in said.output
    assert "Ringstead-3" in run.invoke(app, ["maps", "list"]).output
    assert "--scenario Ringstead-3" in " ".join(said.output.split())
    monkeypatch.chdir(tmp_path)
    for name in ("Ringstead-3", str(tmp_path / "maps" / "Ringstead-3")):
        place = find(name)
        assert make_world(place).reset(place).kind == "town"
    driven = run.invoke(app, ["drive", "Turn right at the next junction.", "--scenario", "Ringstead-3", "--quiet"])
    assert driven.exit_code == 0, driven.output
    near = run.invoke(app, ["drive", "Turn right.", "--scenario", "Ringstead-4"])
    assert "Ringstead-3" in near.output


def test_what_is_no_town_is_said(tmp_path: Path) -> None:
    (tmp_path / "bad.xodr").write_text("<osm/>")
    for arguments, says in (
        (["show", "Atlantis"], "maps build"),
        (["show", "Gridford", "--out", "map.gif"], ".gif"),
        (["build", str(tmp_path / "bad.xodr")], "<osm>"),
        (["build", str(tmp_path / "none.xodr")], "none.xodr"),
        (["build", "Atlantis"], "Gridford"),
    ):
        said = run.invoke(app, ["maps", *arguments])
        assert said.exit_code != 0
        assert says in "".join(said.output.split("\n")) or says in str(said.exception)


def test_a_file_with_odd_records_is_built_and_they_are_listed(tmp_path: Path) -> None:
    """What this reader leaves out, netconvert does not meet either."""
    pytest.importorskip("sumo", reason="needs the extra `maps`")
    lanes = "".join(
        f'<lane id="{number}" type="driving"><link><predecessor/><successor id="none"/></link>'
        f'<border sOffset="0" a="{3.5 * number}" b="0" c="0" d="0"/>'
        '<roadMark sOffset="0" type="broken" laneChange="perhaps"/></lane>'
        for number in (-1, -2)
    )
    path = tmp_path / "odd.xodr"
    path.write_text(
        '<OpenDRIVE xmlns="http://code.asam.net/simulation/standard/opendrive_schema">'
        '<header revMajor="1" revMinor="8"/>'
        '<road id="1" length="200" junction="-1"><link><predecessor/></link>'
        '<type s="0" type="town"><speed max="50" unit="KPH"/></type><type s="9" type="town"><speed max="a lot"/></type>'
        '<planView><geometry s="0" x="0" y="0" hdg="0" length="200"><line/></geometry></planView>'
        '<lanes><laneSection s="0"><center><lane id="0" type="none"/></center>'
        f"<right>{lanes}</right></laneSection></lanes>"
        '<signals><signal s="5" t="-9" id="7" type="274" value="none"/></signals></road></OpenDRIVE>'
    )
    result = run.invoke(app, ["maps", "build", str(path), "--out", str(tmp_path / "pack")])
    assert result.exit_code == 0, result.output
    said = " ".join(result.output.split())
    assert "signal '7'" in said and "'a lot'" in said and "'perhaps'" in said and "'none'" in said


def test_traffic_on_the_left_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "left.xodr"
    path.write_text(
        '<OpenDRIVE><header/><road id="1" length="90" rule="LHT"><planView>'
        '<geometry s="0" x="0" y="0" hdg="0" length="90"><line/></geometry></planView>'
        '<lanes><laneSection s="0"><left><lane id="1" type="driving">'
        '<width sOffset="0" a="3" b="0" c="0" d="0"/></lane></left></laneSection></lanes></road></OpenDRIVE>'
    )
    result = run.invoke(app, ["maps", "build", str(path), "--out", str(tmp_path / "pack")])
    assert result.exit_code == 2 and "keep left" in result.output
