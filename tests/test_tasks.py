"""The pages do what they say: their files are written, their commands and cells run, in order, as they stand."""

from __future__ import annotations

import ast
import asyncio
import contextlib
import inspect
import io
import json
import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from chauffeur.cli.main import app
from chauffeur.driving.recording import read_trip
from chauffeur.programs.catalogue import apis_of, plugged_apis
from stage import NOTEBOOKS, notebook, tutorial

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
BLOCKS = re.compile(r"^(````?)(\w+)\n(.*?)^\1$", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"# ([\w./-]+\.(?:py|toml))\n")
STARTS_WITHIN_S = 60.0

pytestmark = pytest.mark.slow


class Reader:
    """Somebody who does what a page says, in a folder of theirs.

    Attributes:
        cells: Names that the page's Python has defined so far.
        said: What was printed since the last block that showed a print.
    """

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.cells: dict[str, Any] = {"__name__": "__page__"}
        self.said = ""
        self._folder = folder
        self._patch = patch
        self._servers: list[subprocess.Popen[bytes]] = []
        patch.chdir(folder)
        patch.setenv("COLUMNS", "200")
        patch.setenv("CHAUFFEUR_API_KEY", "none")

    def follow(self, page: Path, **instead: str) -> None:
        """Do every block in order. `output` is what the block before it prints; `text` does not run."""
        text = page.read_text(encoding="utf-8")
        for _, kind, found in BLOCKS.findall(text):
            block = found
            for old, new in instead.items():
                block = block.replace(old, new)
            named = NAMED.match(block)
            if kind in ("python", "toml") and named:
                path = self._folder / named.group(1)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(block, encoding="utf-8")
            elif kind == "python":
                self.cell(block)
            elif kind == "sh":
                for line in block.splitlines():
                    self.line(line)
            elif kind == "output":
                self.shown(block)

    def cell(self, code: str) -> None:
        """A cell of a notebook: `await` may stand at its top, and its last expression is shown."""
        printed = io.StringIO()
        tree = ast.parse(code)
        with contextlib.redirect_stdout(printed):
            flags = ast.PyCF_ALLOW_TOP_LEVEL_AWAIT
            run = eval(compile(tree, "<cell>", "exec", flags), self.cells)
            if inspect.iscoroutine(run):
                asyncio.run(run)
        self.said = printed.getvalue()

    def line(self, line: str) -> None:
        """A line of a shell: a command of ours, a server in the background, an installation."""
        words = shlex.split(line, comments=True)
        if not words:
            return
        if words[0] == "python" and words[-1] == "&":
            self._servers.append(subprocess.Popen([sys.executable, *words[1:-1]], cwd=self._folder))
        elif words[:3] == ["pip", "install", "-e"]:
            self._install(self._folder / words[3])
        else:
            assert words[0] == "chauffeur", line
            done = CliRunner().invoke(app, words[1:])
            assert done.exit_code == 0, f"{line}\n{done.output}\n{done.exception!r}"
            self.said = done.stdout

    def shown(self, block: str) -> None:
        """Each line that a page shows was printed; it may be the beginning or a part of a longer one."""
        said = " ".join(self.said.split())
        for line in block.splitlines():
            assert " ".join(line.split()) in said, f"{line}\n--- is not in\n{self.said}"

    def waits_for(self, port: int) -> None:
        """Until somebody listens there."""
        until_s = time.monotonic() + STARTS_WITHIN_S
        while True:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
                return
            assert time.monotonic() < until_s, f"nothing listens on {port}"
            time.sleep(0.05)

    def _install(self, package: Path) -> None:
        """Leave what an installer leaves."""
        project = tomllib.loads((package / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        info = package / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
        )
        points = [
            line
            for group, named in project["entry-points"].items()
            for line in (f"[{group}]", *(f"{name} = {at}" for name, at in named.items()))
        ]
        (info / "entry_points.txt").write_text("\n".join(points))
        self._patch.syspath_prepend(package)
        apis_of.cache_clear()
        plugged_apis.cache_clear()

    def close(self) -> None:
        """End what was started."""
        for server in self._servers:
            server.kill()
            server.wait()
        self._patch.undo()
        apis_of.cache_clear()
        plugged_apis.cache_clear()


@pytest.fixture
def reader(tmp_path: Path) -> Iterator[Reader]:
    """A reader in an empty folder."""
    one = Reader(tmp_path, pytest.MonkeyPatch())
    yield one
    one.close()


def needs_training() -> None:
    for library in ("torch", "onnxscript"):
        pytest.importorskip(library, reason=f"{library} is not installed: pip install 'chauffeur-lab[models]'")


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


@pytest.mark.server
def test_a_model_of_ones_own_is_evaluated(reader: Reader, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    port = free_port()
    line = Reader.line

    def waiting(self: Reader, text: str) -> None:
        line(self, text)
        if text.endswith("&"):
            self.waits_for(port)

    monkeypatch.setattr(Reader, "line", waiting)
    reader.follow(DOCS / "tutorials" / "your-llm.md", **{"8040": str(port)})
    trip = read_trip(tmp_path / "trips" / "first" / "trip.mcap").trip
    assert trip.plan.planner == "openai/stand-in" and trip.outcome == "success"
    assert (tmp_path / "runs" / "report" / "report.html").stat().st_size > 10_000


def test_a_wish_is_followed_line_by_line(reader: Reader) -> None:
    reader.follow(DOCS / "tutorials" / "a-wish.md")


def test_a_planner_and_a_driving_call_of_ones_own(reader: Reader, tmp_path: Path) -> None:
    reader.follow(DOCS / "tutorials" / "your-planner.md")
    plan = read_trip(tmp_path / "trips" / "mine" / "trip.mcap").trip.plan
    assert (plan.planner, plan.model, plan.thoughts.text) == ("mine", "mine-v1", "I drive at 22.0 m/s.")


def test_vilad_is_trained_and_drives(reader: Reader, tmp_path: Path) -> None:
    needs_training()
    reader.follow(DOCS / "tutorials" / "vilad.md")
    assert reader.cells["found"].passes >= 1.0
    trip = read_trip(tmp_path / "trips" / "charge" / "trip.mcap").trip
    assert trip.plan.planner == "vilad" and trip.plan.policy is not None


@pytest.mark.server
def test_a_voice_reaches_autoware(reader: Reader) -> None:
    for library in ("pocketsphinx", "cyclonedds"):
        pytest.importorskip(library, reason=f"{library} is not installed")
    if shutil.which("espeak-ng") is None:
        pytest.skip("espeak-ng is not installed")
    domain = str(110 + os.getpid() % 90)  # not another run's
    reader.follow(DOCS / "tutorials" / "voice-to-autoware.md", **{"= 47": f"= {domain}"})
    assert reader.cells["answer"].status == "delivered"


def test_a_vehicle_is_asked_without_one(reader: Reader) -> None:
    reader.follow(DOCS / "your-vehicle.md")


def test_a_suite_stands_in_for_dblv1(reader: Reader) -> None:
    reader.follow(DOCS / "dblv1.md")


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_notebooks_are_their_tutorials_and_run(name: str, reader: Reader) -> None:
    text = (DOCS / "notebooks" / f"{name}.ipynb").read_text(encoding="utf-8")
    assert text == notebook(tutorial(name)), "python docs/stage.py notebooks"
    if name == "vilad":
        needs_training()
    for one in json.loads(text)["cells"]:
        source = "".join(one["source"])
        if one["cell_type"] == "code" and source.startswith("!"):
            for line in source.splitlines():
                reader.line(line.removeprefix("!"))
        elif one["cell_type"] == "code":
            reader.cell(source)
