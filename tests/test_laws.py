"""The house's laws, held by reading its source."""

from __future__ import annotations

import ast
from pathlib import Path

import chauffeur

SOURCE = Path(chauffeur.__file__).parent

STEPS_A_WORLD = {"drive/actuate.py"}
"""Law 1: the only module that hands a command to a world."""

STEPS_ITS_OWN = {"worlds/highway/gym.py", "worlds/highway/provoked.py"}
"""Inside a world: its disturbed twin, and its gymnasium face."""

STEPS_AN_OPTIMISER = {"models/onboard/training.py", "models/onboard/adapting.py"}


def _calls(path: Path, attribute: str) -> list[int]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == attribute
    ]


def test_one_door_to_the_actuator() -> None:
    doors = {str(p.relative_to(SOURCE)) for p in SOURCE.rglob("*.py") if _calls(p, "step")}
    assert doors - STEPS_AN_OPTIMISER == STEPS_A_WORLD | STEPS_ITS_OWN
    assert len(_calls(SOURCE / "drive" / "actuate.py", "step")) == 1
    hands = {str(p.relative_to(SOURCE)) for p in SOURCE.rglob("*.py") if "drive.actuate import" in p.read_text("utf-8")}
    # Trips in simulated time, in real time, and a judge who replays what was commanded.
    assert hands == {"drive/episode.py", "drive/live/control.py", "bench/chaos/judge.py"}


def test_the_compiled_core_is_the_highway_worlds_own() -> None:
    for path in SOURCE.rglob("*.py"):
        if (SOURCE / "worlds" / "highway") not in path.parents:
            assert "highway.core" not in path.read_text(encoding="utf-8"), f"{path}: ask the world, not its core"


def test_nothing_runs_model_text_in_this_interpreter() -> None:
    for path in SOURCE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                reason = "model text never runs in this interpreter: use chauffeur.programs.sandbox"
                assert node.func.id not in {"exec", "eval", "compile", "__import__"}, f"{path}:{node.lineno}: {reason}"
            if isinstance(node, ast.keyword) and node.arg == "shell":
                raise AssertionError(f"{path}:{node.value.lineno}: no shell; Talk2Drive's model text reached one")


def test_the_loop_fits_on_a_page() -> None:
    assert len((SOURCE / "drive" / "loop.py").read_text(encoding="utf-8").splitlines()) < 100


def test_package_files_hand_names_on_and_define_nothing() -> None:
    for path in SOURCE.rglob("__init__.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            defined = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
            assert not defined, f"{path}:{node.lineno} defines {getattr(node, 'name', '')}"
