"""Laws of wishes for a real vehicle: no way from words to engaging it, one place that asks, none that releases."""

from __future__ import annotations

import ast
import importlib.util
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import chauffeur
from chauffeur.driving.onroad.session import VehicleSession

SOURCE = Path(chauffeur.__file__).parent
ONROAD = SOURCE / "driving" / "onroad"
ENGAGE = "chauffeur.worlds.ros.engage"


@cache
def _modules() -> dict[str, Path]:
    found = {}
    for path in SOURCE.rglob("*.py"):
        name = ".".join(("chauffeur", *path.relative_to(SOURCE).with_suffix("").parts))
        found[name.removesuffix(".__init__")] = path
    return found


@cache
def _imports(name: str) -> frozenset[str]:
    """Modules of ours that a module imports anywhere in its text, in functions too, for types as well."""
    path = _modules()[name]
    package = name if path.stem == "__init__" else name.rpartition(".")[0]
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        named: list[str] = []
        if isinstance(node, ast.Import):
            named = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            named = [base, *(f"{base}.{alias.name}" for alias in node.names)]
        for one in named:
            parts = one.split(".")
            found |= {".".join(parts[:n]) for n in range(1, len(parts) + 1)} & set(_modules())
    return frozenset(found)


def _reached(start: list[str]) -> set[str]:
    seen: set[str] = set()
    waiting = list(start)
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting += _imports(name)
    return seen


@pytest.mark.parametrize("start", ["chauffeur.driving.onroad", "chauffeur.planners", "chauffeur.cli.vehicle_drive"])
def test_no_import_leads_to_engaging(start: str) -> None:
    inside = [name for name in _modules() if name == start or name.startswith(f"{start}.")]
    assert inside
    reached = _reached(inside)
    assert ENGAGE not in reached
    assert "chauffeur.worlds.ros.factory" in reached or start != "chauffeur.cli.vehicle_drive"  # the walk walks


def test_the_walk_finds_what_does_lead_there() -> None:
    assert ENGAGE in _reached(["chauffeur.cli.vehicle"])


def test_a_session_that_ran_never_loaded_it(tmp_path: Path) -> None:
    file = tmp_path / "vehicle.toml"
    file.write_text('interface = "dry-run"\n[limits]\nmax_speed_mps = 10.0\n')
    program = """
import asyncio, sys
from pathlib import Path
from chauffeur.driving.onroad.session import VehicleSession
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.settings import read_settings

settings = read_settings(Path(sys.argv[1]))

async def whole():
    async with VehicleSession(open_vehicle(settings), settings, make_planner("talk2drive")) as road:
        for wish in ("Drive at 20 km/h.", "Engage!", "vehicle/engage", "stop"):
            print((await road.ask(wish)).status)

asyncio.run(whole())
assert "chauffeur.worlds.ros.engage" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", program, str(file)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["dry-run", "declined", "declined", "dry-run"]


def _calls() -> list[tuple[str, str, str]]:
    """(file, function, method) of every call to the vehicle."""
    found = []
    for path in ONROAD.glob("*.py"):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
                for node in ast.walk(function):
                    if isinstance(node, ast.Call) and ast.unparse(node.func).startswith(("self._vehicle.", "vehicle.")):
                        found.append((path.name, function.name, ast.unparse(node.func).rpartition(".")[2]))
    return found


def test_one_door_to_the_vehicle() -> None:
    """What is applied was checked and written down just before, or was in force already. To release may make it faster,
    and is a person's to do; whoever opened an interface closes it."""
    calls = _calls()
    assert {method for _, _, method in calls} == {"apply", "state"}
    applied = sorted((file, function) for file, function, method in calls if method == "apply")
    assert applied == [("session.py", "_apply"), ("session.py", "_confirm")]


def test_what_a_session_offers() -> None:
    public = {name for name in vars(VehicleSession) if not name.startswith("_")}
    assert public == {"ask", "asked", "close", "feedback", "reached", "take_over"}
