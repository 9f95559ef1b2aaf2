"""The house's laws, held by reading its source."""

from __future__ import annotations

import ast
import re
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import chauffeur

SOURCE = Path(chauffeur.__file__).parent

STEPS_A_WORLD = {"driving/actuate.py"}
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
    "driving/conformance.py", "driving/episode.py", "driving/live/control.py", "driving/live/policy.py",
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
    assert len(_calls(SOURCE / "driving" / "actuate.py", "step")) == 1
    hands = {str(p.relative_to(SOURCE)) for p, source in _sources().items() if "driving.actuate import" in source.text}
    # Trips in simulated time, in real time, a judge who replays what was commanded, routes with scenarios (driven,
    # taught, and bounded as planned), the traffic that frames are taken of, and the kit that tries an executor.
    assert hands == {
        "driving/conformance.py",
        "driving/episode.py",
        "driving/live/control.py",
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
    assert len((SOURCE / "driving" / "loop.py").read_text(encoding="utf-8").splitlines()) < 100


def test_package_files_hand_names_on_and_define_nothing() -> None:
    for path in SOURCE.rglob("__init__.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            defined = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
            if isinstance(node, ast.FunctionDef) and node.name in ("__getattr__", "__dir__"):
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
    "driving/planning.py",  # for drives and benchmarks, screened
    "bench/hostile/requests.py",  # what screening is worth is measured without it, too
    "bench/lampilot/shown.py",  # of a trip that is filed; nobody is asked
    "driving/trips.py",  # the same
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


READERS_OF_WORDS = {
    f"chauffeur.language.{name}"
    for name in (
        "corrections", "denials", "grammar", "hazards", "ordinals", "questions", "slips", "text_classifier", "tokens",
        "wanted", "word_files",
    )
}  # fmt: skip
"""Readers of English beside `language.meaning`, which are to leave. Numbers, units, letters, weather, distress and
other languages have one reader each, and are none of these."""

OTHER_TEXT = {
    "describe/services/maxspeed.py": "tags of maps",
    "hmi/words.py": "units in the car's own sentences",
    "planners/llm_context.py": "errors of an endpoint",
    "planners/llm_endpoint.py": "errors of an endpoint",
    "planners/llm_errors.py": "errors of an endpoint",
    "safety/concealment.py": "what is hidden in a text, before anybody reads it",
    "safety/faithfulness/claims.py": "thoughts of a planner: what wishes have not; acts are asked of `meaning`",
    "safety/faithfulness/comparison.py": "thoughts of a planner",
}
READS_WORDS = {
    "describe/answers.py": "what a question is about; acts say only that it is one",
    "driving/drive_session.py": "leave is taken of a session: a closed class of words",
    "driving/live/plan_messages.py": "what is said aside, until the session holds an utterance",
    "driving/onroad/checks.py": "to engage the vehicle is no act, and never done",
    "driving/onroad/session.py": "what is said aside, until the session holds an utterance",
    "driving/planning.py": "what is a question, until the request holds an utterance",
    "driving/scenarios.py": "whether a wish is one that a scenario is listed with",
    "memory/conflicts.py": "numbers to keep and numbers to change by, until acts are read as well",
    "memory/feedback.py": "opinions, until acts of feedback are read as well",
    "memory/phrases.py": "opinions, until acts of feedback are read as well",
    "memory/plain_text.py": "opinions, until acts of feedback are read as well",
    "memory/remarks.py": "opinions, until acts of feedback are read as well",
    "memory/similarity.py": "how alike wishes are, as numbers that are kept with each",
    "planners/arbitration.py": "corrections and denials, until acts of them are read as well",
    **{
        f"planners/onboard/{name}.py": "the rules of a planner that has a reader of its own"
        for name in ("doubts", "town", "town_intents", "town_steps")
    },
    "planners/talk2drive/embedded.py": "how likely a hint is: acts are what is asked for, not what a remark is after",
    "planners/talk2drive/explicit_overtake.py": "who forbids to pass is read as asking for it too often",
    "planners/talk2drive/hints.py": "hints: acts are what is asked for, not what a remark is after",
    "planners/talk2drive/style.py": "places of a lot and of a town by name, until references have them all",
    "planners/vilad/planner.py": "corrections; words reach its network as they are",
    "planners/vlm/engine.py": "how somebody wants to be driven, beside a picture: learned with the head",
    "safety/dangers.py": "declines more than the acts of a wish do, and never less",
}
"""Modules that read a passenger's words by themselves, with the reason; no others may, and the list only shrinks."""


def _matches_words(tree: ast.AST) -> bool:
    """Whether a module has a regular expression that chooses between words, or asks a reader beside `meaning`."""
    patterns = asks = regular = False
    for node in ast.walk(tree):
        match node:
            case ast.Constant(value=str(value)):
                patterns |= (
                    re.search(r"\\b|\(\?", value) is not None and re.search(r"[a-z]{3}\|[a-z]{3}", value) is not None
                )
            case ast.Import(names=names):
                regular |= any(one.name == "re" for one in names)
            case ast.ImportFrom(module=str(module), names=names):
                told = {f"{module}.{one.name}" for one in names} | {module}
                asks |= not told.isdisjoint(READERS_OF_WORDS) or bool(
                    module == "chauffeur.language" and {"plain", "slip_in", "tokens_of"} & {one.name for one in names}
                )
            case _:
                pass
    return asks or (patterns and regular)


def test_passengers_words_are_read_in_one_place() -> None:
    """Outside of what reads, hears and is trained to read (and of benchmarks, and of models' replies) no module decides
    by words."""
    apart = {"language", "speech", "models", "bench", "foreign"}
    found = {
        path.relative_to(SOURCE).as_posix()
        for path in _sources()
        if path.relative_to(SOURCE).parts[0] not in apart and _matches_words(ast.parse(_sources()[path].text))
    }
    assert not found - set(READS_WORDS) - set(OTHER_TEXT), "ask `language.meaning.read`, and go by acts"
    assert not (set(READS_WORDS) | set(OTHER_TEXT)) - found, "these no longer read words: take them off the list"
