"""Two packages from one repository: each file of `src` is in exactly one, and both fit together."""

from __future__ import annotations

import json
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

import chauffeur
from chauffeur.cli.lab.commands import mount
from chauffeur.cli.main import app
from chauffeur.concept import MissingExtraError
from chauffeur.concept.extras import LAB, LAB_EXTRAS, install_command
from chauffeur.concept.lab import LAB_COMMANDS
from chauffeur.version import __version__

ROOT = Path(__file__).resolve().parents[1]
PROJECTS = {name: tomllib.loads((folder / "pyproject.toml").read_text()) for name, folder in
            (("chauffeur", ROOT), (LAB, ROOT / "lab"))}  # fmt: skip
WEIGHT_MB = 100
"""Most that package indexes take without being asked."""


def held(folder: Path, target: str) -> dict[str, Path]:
    """Files of a wheel or source archive, by their place in it."""
    builders = pytest.importorskip(f"hatchling.builders.{target}", reason="hatchling is not installed: chauffeur[dev]")
    builder = getattr(builders, {"wheel": "WheelBuilder", "sdist": "SdistBuilder"}[target])(str(folder))
    return {file.distribution_path: Path(file.path).resolve() for file in builder.recurse_included_files()}


def sources() -> set[Path]:
    return {
        path
        for path in (ROOT / "src").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".pyc"
    }


def test_each_file_is_in_exactly_one_wheel() -> None:
    drives, measures = held(ROOT, "wheel"), held(ROOT / "lab", "wheel")
    assert not set(drives) & set(measures), "the second to be installed would overwrite the first"
    of_sources = {place: path for place, path in measures.items() if not place.startswith("chauffeur/data/")}
    assert {*drives.values(), *of_sources.values()} == sources()
    assert all(place == str(path.relative_to(ROOT / "src")) for place, path in {**drives, **of_sources}.items())
    assert {place.split("/")[1] for place in measures} == {"bench", "cli", "data", "models"}
    weight = sum(path.stat().st_size for path in drives.values())
    assert weight < WEIGHT_MB * 1e6


def test_an_archive_of_sources_holds_what_its_wheel_needs() -> None:
    for folder in (ROOT, ROOT / "lab"):
        assert set(held(folder, "wheel").values()) <= set(held(folder, "sdist").values())


def test_both_are_of_one_version_and_licence() -> None:
    for project in PROJECTS.values():
        assert project["project"]["version"] == __version__
        for field in ("requires-python", "license", "classifiers"):
            assert project["project"][field] == PROJECTS["chauffeur"]["project"][field]
    assert PROJECTS[LAB]["project"]["dependencies"] == [f"chauffeur=={__version__}"]
    assert (ROOT / "lab" / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_extras_are_told_apart() -> None:
    """A hint names the package whose extra it is; a library that both need is asked for in one version."""
    extras = {name: project["project"]["optional-dependencies"] for name, project in PROJECTS.items()}
    assert set(extras[LAB]) == LAB_EXTRAS
    assert not LAB_EXTRAS & set(extras["chauffeur"])
    assert set(extras["chauffeur"]["transformers"]) <= set(extras[LAB]["models"])


def test_entry_points_lead_into_their_own_package() -> None:
    def modules(project: dict[str, Any]) -> set[str]:
        points = project["project"].get("entry-points", {}).values()
        return {value.partition(":")[0] for group in points for value in group.values()}

    places = {name: held(folder, "wheel") for name, folder in (("chauffeur", ROOT), (LAB, ROOT / "lab"))}
    for name, project in PROJECTS.items():
        for module in modules(project):
            path = module.replace(".", "/")
            assert {f"{path}.py", f"{path}/__init__.py"} & set(places[name]), module


def test_the_contract_of_imports_names_every_room_that_drives() -> None:
    (contract,) = [
        one
        for one in PROJECTS["chauffeur"]["tool"]["importlinter"]["contracts"]
        if one["forbidden_modules" if one["type"] == "forbidden" else "layers"][0] == "chauffeur.bench"
    ]
    rooms = {path.name for path in (ROOT / "src" / "chauffeur").iterdir() if (path / "__init__.py").is_file()}
    named = {name.split(".")[1] for name in contract["source_modules"]}
    assert rooms - {"bench", "models"} <= named


@pytest.mark.parametrize(
    "command", ["bench lampilot", "bench --help", "report runs", "model train", "check benchmark x"]
)
def test_without_the_lab_its_commands_say_how_to_get_it(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "chauffeur.bench", None)
    result = CliRunner().invoke(app, command.split())
    assert result.exit_code == 2
    said = "".join(result.output.split())
    assert LAB in said and "".join(install_command().split()) in said


def test_the_labs_commands_are_known_where_it_is_not() -> None:
    there = typer.Typer()
    mount(there, look="", measure="", build="")
    assert set(LAB_COMMANDS) == set(typer.main.get_group(there).commands)


def test_without_the_lab_no_benchmark_is_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "chauffeur.bench", None)
    with pytest.raises(MissingExtraError, match=LAB):
        chauffeur.run_benchmark("passengers", out=tmp_path)


def test_what_is_missing_is_installed_from_where_this_came_from(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def came_from(url: str, **about: Any) -> None:
        known = SimpleNamespace(read_text=lambda name: json.dumps({"url": url, **about}))
        monkeypatch.setattr("chauffeur.concept.extras.distribution", lambda name: known)

    pip = f"{sys.executable} -m pip install"
    came_from("https://example.org/chauffeur.whl")
    assert install_command("town") == f'{pip} "chauffeur[town]"'
    assert (install_command(), install_command("models")) == (f'{pip} "{LAB}"', f'{pip} "{LAB}[models]"')
    came_from((tmp_path / "gone").as_uri(), dir_info={"editable": True})
    assert install_command("town") == f'{pip} "chauffeur[town]"', "sources that an image was built from are not in it"
    came_from(ROOT.as_uri(), dir_info={"editable": True})
    pins = f'-c "{ROOT / "constraints.txt"}" -e'
    assert install_command("town") == f'{pip} {pins} "{ROOT}[town]"'
    assert install_command() == f'{pip} {pins} "{ROOT / "lab"}"'
