"""Laws of the vehicle interfaces, held by reading their source: who may engage, and that nothing runs a command."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from functools import cache
from pathlib import Path

import chauffeur
from chauffeur.worlds.ros import engage

SOURCE = Path(chauffeur.__file__).parent
FOLDER = SOURCE / "worlds" / "ros"

ENGAGES = "worlds/ros/engage.py"
ASKS_A_PERSON = "cli/vehicle.py"


TEXTS = {path: path.read_text(encoding="utf-8") for path in SOURCE.rglob("*.py")}


@cache
def _nodes(path: Path) -> list[ast.AST]:
    return list(ast.walk(ast.parse(TEXTS[path])))


def _naming(*words: str) -> list[Path]:
    """Files whose text holds one of these words: no other can name it."""
    return [path for path, text in TEXTS.items() if any(word in text for word in words)]


def _imports(path: Path) -> set[str]:
    """Every module a file names in an import, as `a.b` and as `a.b.name`."""
    found: set[str] = set()
    for node in _nodes(path):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def _strings(path: Path) -> set[str]:
    documents = {ast.get_docstring(n, clean=False) for n in _nodes(path) if isinstance(n, ast.Module)}
    texts = {n.value for n in _nodes(path) if isinstance(n, ast.Constant) and isinstance(n.value, str)}
    return texts - documents


def test_only_a_person_engages() -> None:
    users = {
        str(path.relative_to(SOURCE))
        for path in _naming("engage")
        if any(name.startswith("chauffeur.worlds.ros.engage") for name in _imports(path))
    }
    assert users == {ASKS_A_PERSON}
    nodes = _nodes(SOURCE / ASKS_A_PERSON)
    calls = [n for n in nodes if isinstance(n, ast.Call) and ast.unparse(n.func) == "engage_vehicle"]
    assert len(calls) == 1
    command = next(n for n in nodes if isinstance(n, ast.FunctionDef) and n.name == "engage")
    asked = [n.lineno for n in ast.walk(command) if isinstance(n, ast.Call) and ast.unparse(n.func) == "typer.prompt"]
    assert asked
    assert min(asked) < calls[0].lineno <= (command.end_lineno or 0)


def test_nothing_else_knows_how_to_engage() -> None:
    for path in _naming("vehicle/engage", "change_to_autonomous", "ros.engage"):
        if str(path.relative_to(SOURCE)) == ENGAGES:
            continue
        for text in _strings(path):
            assert "/vehicle/engage" not in text, f"{path}: engaging is a person's act"
            assert "change_to_autonomous" not in text, f"{path}: engaging is a person's act"
            assert "ros.engage" not in text, f"{path}: import it where a reader sees it"


def test_engaging_knows_no_plan() -> None:
    imported = _imports(SOURCE / ENGAGES)
    assert not {name for name in imported if "concept" in name or "stack" in name or "limits" in name}
    names = {name for function in (engage.engage, engage.disengage) for name in inspect.signature(function).parameters}
    assert names == {"settings", "shown", "typed", "within_s"}


def test_the_vehicle_side_loads_without_the_engage_module_and_the_extras() -> None:
    modules = sorted(f"chauffeur.worlds.ros.{path.stem}" for path in FOLDER.glob("*.py") if path.stem != "__init__")
    modules.remove("chauffeur.worlds.ros.engage")
    loads = "; ".join(f"import {module}" for module in modules)
    bare = "import sys; sys.modules.update(dict.fromkeys(('cyclonedds', 'websockets', 'roslibpy')))"
    check = "assert 'chauffeur.worlds.ros.engage' not in sys.modules; print('absent')"
    done = subprocess.run(
        [sys.executable, "-c", f"{bare}; {loads}; {check}"], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "absent"


def test_no_command_is_ever_run() -> None:
    for path in [*FOLDER.rglob("*.py"), SOURCE / ASKS_A_PERSON]:
        assert not {"subprocess", "pty", "os.system", "multiprocessing", "shlex.split"} & _imports(path), path
        for node in _nodes(path):
            if isinstance(node, ast.Attribute):
                assert node.attr not in {"system", "popen", "Popen", "posix_spawn", "execv", "fork"}, (
                    f"{path}:{node.lineno}"
                )


def test_only_the_vehicles_file_makes_an_acknowledgement() -> None:
    makers = set()
    for path in _naming("Acknowledgement", "ConstantSpeed"):
        for node in _nodes(path):
            if isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2] in {
                "Acknowledgement",
                "ConstantSpeed",
            }:
                makers.add(str(path.relative_to(SOURCE)))
    assert makers == {"worlds/ros/settings.py"}


def test_the_unsafe_flag_has_one_place() -> None:
    users = [
        (str(path.relative_to(SOURCE)), node.lineno)
        for path in _naming("CONSTANT_SOURCE")
        for node in _nodes(path)
        if isinstance(node, ast.Name) and node.id == "CONSTANT_SOURCE" and isinstance(node.ctx, ast.Load)
    ]
    assert [file for file, _ in users] == ["worlds/ros/autoware_ai.py"]
