"""`chauffeur maps`."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from chauffeur.cli.main import app
from chauffeur.drive.scenarios import find
from chauffeur.drive.session import make_world

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
