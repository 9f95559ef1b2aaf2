"""The house's laws, held by reading its source."""

from __future__ import annotations

import ast
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import chauffeur

SOURCE = Path(chauffeur.__file__).parent

STEPS_A_WORLD = {"drive/actuate.py"}
"""Law 1: the only module that hands a command to a world."""

STEPS_ITS_OWN = {
    "bench/leaderboard/staging.py",
    "worlds/conformance.py",
    "worlds/highway/gym.py",
    "worlds/highway/provoked.py",
    "worlds/town/world.py",
}
"""Among worlds: what tests them, the highway's disturbed twin, its gymnasium face, a town with its scenarios on stage,
and the town that steps SUMO and the people in it."""

STEPS_AN_EXECUTOR = {
    "drive/conformance.py", "drive/episode.py", "drive/live/control.py", "drive/live/policy.py",
}  # fmt: skip
"""Ask an executor for its command, and hand it to the one door; the policy process, which goes along on a copy of the
world that nobody steps, hands it to nobody."""

STEPS_AN_OPTIMISER = {
    "models/train/trainer.py", "models/vilad/frames_baselines.py", "models/vlm/ear.py", "models/meaning/recipe.py",
}  # fmt: skip


@dataclass(frozen=True)
class Source:
    """What the laws ask of a module; its tree is not kept."""

    text: str
    attributes: list[tuple[str, int]]
    """Called as attributes of something, with their lines."""
    names: list[tuple[str, int]]
    shells: list[int]
    classes: set[str]


@cache
def _sources() -> dict[Path, Source]:
    found: dict[Path, Source] = {}
    for path in SOURCE.rglob("*.py"):
        source = found[path] = Source(path.read_text(encoding="utf-8"), [], [], [], set())
        for node in ast.walk(ast.parse(source.text)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                source.attributes.append((node.func.attr, node.lineno))
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                source.names.append((node.func.id, node.lineno))
            elif isinstance(node, ast.keyword) and node.arg == "shell":
                source.shells.append(node.value.lineno)
            elif isinstance(node, ast.ClassDef):
                source.classes.add(node.name)
    return found


def _calls(path: Path, attribute: str) -> list[int]:
    return [line for name, line in _sources()[path].attributes if name == attribute]


def test_one_door_to_the_actuator() -> None:
    doors = {str(p.relative_to(SOURCE)) for p in _sources() if _calls(p, "step")}
    assert doors - STEPS_AN_OPTIMISER - STEPS_AN_EXECUTOR == STEPS_A_WORLD | STEPS_ITS_OWN
    assert len(_calls(SOURCE / "drive" / "actuate.py", "step")) == 1
    hands = {str(p.relative_to(SOURCE)) for p, source in _sources().items() if "drive.actuate import" in source.text}
    # Trips in simulated time, in real time, a judge who replays what was commanded, routes with scenarios (driven,
    # taught, and bounded as planned), the traffic that frames are taken of, and the kit that tries an executor.
    assert hands == {
        "drive/conformance.py",
        "drive/episode.py",
        "drive/live/control.py",
        "bench/leaderboard/instructed.py",
        "bench/leaderboard/lessons.py",
        "bench/leaderboard/rollout.py",
        "bench/openloop/driving.py",
    }


def test_the_compiled_core_is_the_highway_worlds_own() -> None:
    for path, source in _sources().items():
        if (SOURCE / "worlds" / "highway") not in path.parents:
            assert "highway.core" not in source.text, f"{path}: ask the world, not its core"


def test_nothing_runs_model_text_in_this_interpreter() -> None:
    reason = "model text never runs in this interpreter: use chauffeur.programs.sandbox"
    for path, source in _sources().items():
        for name, line in source.names:
            assert name not in {"exec", "eval", "compile", "__import__"}, f"{path}:{line}: {reason}"
        assert not source.shells, f"{path}:{source.shells}: no shell; Talk2Drive's model text reached one"


def test_the_loop_fits_on_a_page() -> None:
    assert len((SOURCE / "drive" / "loop.py").read_text(encoding="utf-8").splitlines()) < 100


def test_package_files_hand_names_on_and_define_nothing() -> None:
    for path in SOURCE.rglob("__init__.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            defined = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
            if isinstance(node, ast.FunctionDef) and node.name == "__getattr__":
                continue  # hands names on when they are asked for (PEP 562)
            assert not defined, f"{path}:{node.lineno} defines {getattr(node, 'name', '')}"


def test_a_class_name_is_defined_once() -> None:
    """Public ones; two classes of one module may share a name in different scopes."""
    found: Counter[str] = Counter()
    for source in _sources().values():
        found.update(source.classes)
    shared = {name for name, count in found.items() if count > 1 and not name.startswith("_")}
    assert not shared, f"say these nouns better, they are taken: {sorted(shared)}"


REQUESTS_MADE = {
    "drive/planning.py",  # for drives and benchmarks, screened
    "bench/hostile/requests.py",  # what screening is worth is measured without it, too
    "bench/report/redrive.py",  # of a trip that is filed; nobody is asked
    "models/vlm/lora.py",  # of a training pair; nobody is asked
}
"""Modules that may name the request of a planner as something to be made."""


def test_requests_of_planners_are_put_together_in_one_place() -> None:
    made: set[str] = set()
    for path in SOURCE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            match node:
                case ast.Call(func=ast.Name("PlanRequest")) | ast.IfExp(orelse=ast.Name("PlanRequest")):
                    made.add(path.relative_to(SOURCE).as_posix())
                case _:
                    pass
    assert made == REQUESTS_MADE
