"""What the documents tell a reader to type exists, and what they show as a program is one."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from pathlib import Path

import pytest
import typer.main

from chauffeur.cli.main import app
from chauffeur.planners.onboard.dialect import read
from chauffeur.programs import check_source

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCKS = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`(chauffeur [^`\n]+)`")


def _commands(text: str) -> list[str]:
    shell = [block for language, block in BLOCKS.findall(text) if language in ("", "sh")]
    lines = [line.split("#")[0].strip() for block in shell for line in re.split(r"[\n;]", block)]
    return [line for line in lines if line.startswith("chauffeur ")] + INLINE.findall(text)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_commands_exist(document: Path) -> None:
    for line in _commands(document.read_text(encoding="utf-8")):
        command = typer.main.get_command(app)
        words = shlex.split(line)[1:]
        options = [word for word in words if word.startswith("--")]
        for word in words:
            children = getattr(command, "commands", {})
            if word in children:
                command = children[word]
        known = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
        assert command.name != "chauffeur" or not [w for w in words if not w.startswith("-")], (
            f"{document.name}: {line}"
        )
        assert set(options) <= known | {"--help"}, f"{document.name}: {line}"


def test_programs_shown_are_programs() -> None:
    shown = 0
    for document in DOCUMENTS:
        for language, block in BLOCKS.findall(document.read_text(encoding="utf-8")):
            if language == "python" and "yield autopilot()" in block:
                shown += 1
                if document.name == "onboard.md":  # the dialect: its skills come with the program
                    assert read(block)
                    continue
                assert check_source(block).passed, f"{document.name}: {check_source(block).errors}"
    assert shown


def test_at_most_twelve_options_a_panel() -> None:
    """A command with more has to put them under headings in its help."""

    def walk(command: object, name: str) -> None:
        for child_name, child in getattr(command, "commands", {}).items():
            walk(child, f"{name} {child_name}")
        options = [p for p in getattr(command, "params", []) if p.param_type_name == "option" and p.name != "help"]
        panels = Counter(getattr(option, "rich_help_panel", None) for option in options)
        assert max(panels.values(), default=0) <= 12, f"{name} has {panels}"

    walk(typer.main.get_command(app), "chauffeur")


def test_documents_speak_of_the_product_alone() -> None:
    for document in [*DOCUMENTS, ROOT / "ARCHITECTURE.md", ROOT / "CHANGELOG.md"]:
        text = document.read_text(encoding="utf-8")
        assert not re.search(r"issue #?\d|TODO|FIXME", text), document.name


def test_a_seed_is_a_number_and_a_paper_a_paper() -> None:
    meant = re.compile(r"\bseed('s|s')? (Tab\.|Sec\.|Eq\.|Fig\.|survey|section)|\bthe seeds' |\bof the seeds\b", re.IGNORECASE)
    texts = [*DOCUMENTS, ROOT / "ARCHITECTURE.md", ROOT / "benchmarks" / "RESULTS.md", *sorted((ROOT / "src").rglob("*.py"))]
    found = [path.relative_to(ROOT) for path in texts if meant.search(path.read_text(encoding="utf-8"))]
    assert not found


def test_the_evidence_of_the_safety_case_is_there() -> None:
    text = (ROOT / "docs" / "safety-case.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:tests|safety|drive)/[\w/]+(?:\.py)?)(?:::(\w+))?`", text)
    assert len(named) > 25
    for path, function in named:
        file = ROOT / path if path.startswith("tests") else ROOT / "src" / "chauffeur" / path
        assert file.exists(), path
        assert not function or f"def {function}(" in file.read_text(encoding="utf-8"), f"{path}::{function}"
    results = (ROOT / "benchmarks" / "RESULTS.md").read_text(encoding="utf-8")
    for cell in re.findall(r"RESULTS, ((?:\"[^\"]+\"(?:, | and )?)+)", text):
        for title in re.findall(r"\"([^\"]+)\"", cell):
            assert re.search(rf"^##+ {re.escape(title)}$", results, re.MULTILINE), title
