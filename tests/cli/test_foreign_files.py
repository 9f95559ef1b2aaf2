"""Every command that reads a file meets files of every wrong kind: it names what is wrong, and none ends in a crash."""

from __future__ import annotations

import gzip
import json
import random
from pathlib import Path
from typing import Final

import pytest
from typer.testing import CliRunner

from chauffeur.cli.main import app

_NOISE: Final = random.Random(7).randbytes(4_000)
KINDS: Final[dict[str, bytes | None]] = {
    "nothing": None,
    "a folder": b"",
    "an empty file": b"",
    "noise": _NOISE,
    "zeros": bytes(5_000),
    "words": "Überhol ihn!\n".encode() * 20,
    "latin-1": "Überhol ihn!\n".encode("latin-1") * 20,
    "a page": b"<!DOCTYPE html><html><body>404 not found</body></html>",
    "JSON null": b"null",
    "a JSON number": b"12345",
    "a JSON text": b'"trip"',
    "a JSON list": b"[1, null, []]",
    "JSON of another shape": json.dumps({"a": {"b": [1, {"c": None}]}, "token": 3}).encode(),
    "rows of another shape": json.dumps([{"token": "t", "x": 1}, {"token": None}, {"token": ["t"]}]).encode(),
    "huge numbers": b'{"version": 1' + b"0" * 5_000 + b', "x": 1e999, "y": -1e999, "n": NaN}',
    "deep nesting": b"[" * 50_000,
    "a deep tree": b"<a>" * 50_000,
    "XML that breaks off": b'<?xml version="1.0"?><OpenDRIVE><road id="1"',
    "XML of another kind": b'<?xml version="1.0"?><kml><Document id="x"/></kml>',
    "XML in an unknown encoding": b'<?xml version="1.0" encoding="klingon"?><routes/>',
    "an entity bomb": b'<!DOCTYPE a [<!ENTITY b "'
    + b"x" * 100
    + b'">'
    + b"".join(b'<!ENTITY c%d "%s">' % (i, (b"&b;" if i == 0 else b"&c%d;" % (i - 1)) * 20) for i in range(8))
    + b"]><a>&c7;</a>",
    "a pickle": b"\x80\x04\x95\x1a\x00\x00\x00\x00\x00\x00\x00\x8c\x05posix\x94\x8c\x06system\x94\x93\x94.",
    "a packed file": gzip.compress(bytes(200_000)),
    "TOML of another shape": b'[limits]\nmax_speed = "fast"\n[[vehicle]]\nx = 1\n',
    "a line of a table": b"id,x,y\n1,2,3\n",
    "git's pointer": b"version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 1\n",
}

FILES: Final = (
    "replay {in}.mcap",
    "show page {in}.mcap --out {out}.html",
    "maps build {in}.xodr --out {out}",
    "show context --at 48.1,11.5 --map {in}.osm",
    "show context --at 48.1,11.5 --map {in}.osm.pbf",
    "show context --at 48.1,11.5 --map {in}.osm.gz",
    "show speech {in}.wav --button command",
    "bench leaderboard --routes {in}.xml --scenarios none --seeds 1 --out {out} --workers 1",
    "audit verify {in}",
    "vehicle check {in}.toml --wait 0",
    "vehicle apply {in}.toml --speed 3 --dry-run",
    "vehicle release {in}.toml",
    "check world highway --config {in}.json",
    "drive Hello --planner replay/{in}",
)
FOLDERS: Final = (
    ("bench lampilot --data {in} --planner keyword --out {out} --workers 1", ("tasks.json", "acc/tasks.json")),
    ("bench scenes check {in} --workers 1", ("tasks.json", "manifest.json")),
    ("bench scenes stats {in}", ("tasks.json", "manifest.json")),
    ("show scenarios --data {in}", ("tasks.json",)),
    ("bench scenes sft {in} --out {out}", tuple(f"v1.0-mini/{one}.json" for one in (
        "scene", "sample", "sample_data", "ego_pose", "calibrated_sensor", "sensor", "openloop"))),
    ("bench openloop --data {in} --instructions {in}", ("a.csv",)),
    ("bench nuplanqa --data {in} --planner keyword --out {out}", ("questions.json", "metadata.json")),
    ("report {in}", ("plan.json", "results.jsonl", "provenance.json", "rollout.jsonl", "generate.jsonl")),
    ("bench merge {out} {in}", ("plan.json", "results.jsonl", "generate.jsonl")),
    ("show policies {in}", ("policies.jsonl", "policies.json", "a.json", "index.json")),
    ("model policies describe {in} overtake words", ("policies.jsonl", "a.json")),
    ("model policies add {out} {in}", ("policies.jsonl", "a.json")),
    ("maps show {in} --out {out}.png", ("pack.json", "map.xodr")),
)  # fmt: skip


def invoke(command: str, source: Path, out: Path) -> None:
    """Run it; what it must not do is raise anything but its own exit."""
    words = [word.replace("{in}", str(source)).replace("{out}", str(out)) for word in command.split()]
    result = CliRunner().invoke(app, words)
    crash = result.exception
    assert crash is None or isinstance(crash, SystemExit), f"{type(crash).__name__}: {crash}"
    assert result.exit_code in (0, 1, 2, 3)
    assert "Traceback" not in result.output and "itself failed" not in result.output
    assert not result.exit_code or len(result.output) > 20, "a failure says why"


def put(path: Path, kind: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    content = KINDS[kind]
    if kind == "a folder":
        path.mkdir()
    elif content is not None:
        path.write_bytes(content)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("command", FILES)
def test_a_file_of_a_wrong_kind_is_told_in_words(tmp_path: Path, command: str, kind: str) -> None:
    ending = command.partition("{in}")[2].partition(" ")[0]
    put(tmp_path / f"given{ending}", kind)
    invoke(command, tmp_path / "given", tmp_path / "out")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("command", "names"), FOLDERS)
def test_a_folder_of_wrong_files_is_told_in_words(
    tmp_path: Path, command: str, names: tuple[str, ...], kind: str
) -> None:
    for name in names:
        put(tmp_path / "given" / name, kind)
    invoke(command, tmp_path / "given", tmp_path / "out")


@pytest.mark.parametrize("command", [command for command, _ in FOLDERS])
def test_a_folder_too_high_or_none_is_told_in_words(tmp_path: Path, command: str) -> None:
    (tmp_path / "high" / "below").mkdir(parents=True)
    (tmp_path / "high" / "below" / "tasks.json").write_text("[]")
    (tmp_path / "file").write_text("x")
    for given in ("high", "none", "file"):
        invoke(command, tmp_path / given, tmp_path / "out")
