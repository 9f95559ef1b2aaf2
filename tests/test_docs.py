"""What the documents tell a reader to type exists, and what they show as a program is one."""

from __future__ import annotations

import ast
import importlib
import re
import shlex
import tomllib
from collections import Counter
from functools import cache
from pathlib import Path

import click
import pytest
import typer.main

import chauffeur
from chauffeur.cli.main import app
from chauffeur.planners.onboard.dialect import read
from chauffeur.programs import check_source
from pictures import PICTURES
from stage import BOOK, ELSEWHERE, pages, turned

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCKS = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`(chauffeur [^`\n]+)`")


def _commands(text: str) -> list[str]:
    shell = [block for language, block in BLOCKS.findall(text) if language in ("", "sh")]
    lines = [line.split("#")[0].strip() for block in shell for line in re.split(r"[\n;]", block)]
    return [line for line in lines if line.startswith("chauffeur ")] + INLINE.findall(text)


@cache
def _root() -> click.Command:
    return typer.main.get_command(app)


def _check(line: str, where: str) -> None:
    command = _root()
    words = shlex.split(line.split(" < ", maxsplit=1)[0])[1:]
    options = [word.partition("=")[0] for word in words if word.startswith("--")]
    for word in words:
        children = getattr(command, "commands", {})
        if word in children:
            command = children[word]
        elif children:
            try:
                command = command.resolve_command(typer.Context(command), [word])[1]  # a registered benchmark
            except Exception:  # what is no command where one is due is judged below
                break
    known = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
    rest = [word for word in words if word not in ("...", "|") and not word.startswith("-")]
    assert not getattr(command, "commands", {}) or command.name in rest[-1:] or not rest, where
    assert set(options) <= known | {"--help"}, where


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_commands_exist(document: Path) -> None:
    for line in _commands(document.read_text(encoding="utf-8")):
        _check(line, f"{document.name}: {line}")


def test_commands_that_the_program_names_exist() -> None:
    """In its hints, its help and its comments."""
    found = 0
    for file in [*sorted((ROOT / "src").rglob("*.py")), ROOT / "src" / "chauffeur" / "cli" / "examples.md"]:
        text = file.read_text(encoding="utf-8")
        examples = re.findall(r"^    (chauffeur [a-z][^\n{]*)$", text, re.MULTILINE)
        for line in [*examples, *re.findall(r"`(chauffeur [a-z][^`\n{]*)`", text)]:
            found += 1
            _check(line, f"{file.relative_to(ROOT)}: {line}")
    assert found > 100


def test_programs_shown_are_programs() -> None:
    shown = 0
    for document in DOCUMENTS:
        for language, block in BLOCKS.findall(document.read_text(encoding="utf-8")):
            if (
                language == "python"
                and "yield autopilot()" in block
                and "import chauffeur" not in block
                and "from chauffeur" not in block
            ):
                shown += 1
                if document.name == "onboard.md":  # the dialect: its skills come with the program
                    assert read(block)
                    continue
                assert check_source(block).passed, f"{document.name}: {check_source(block).errors}"
    assert shown


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_blocks_can_be_read(document: Path) -> None:
    """Python as a cell of a notebook, where `await` may stand at the top; TOML as a file."""
    for language, block in BLOCKS.findall(document.read_text(encoding="utf-8")):
        if language == "python":
            compile(block, document.name, "exec", ast.PyCF_ALLOW_TOP_LEVEL_AWAIT | ast.PyCF_ONLY_AST)
        elif language == "toml":
            tomllib.loads(block)


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
    meant = re.compile(
        r"\bseed('s|s')? (Tab\.|Sec\.|Eq\.|Fig\.|survey|section)|\bthe seeds' |\bof the seeds\b", re.IGNORECASE
    )
    texts = [
        *DOCUMENTS,
        ROOT / "ARCHITECTURE.md",
        ROOT / "benchmarks" / "RESULTS.md",
        *sorted((ROOT / "src").rglob("*.py")),
    ]
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


# Links and figures ------------------------------------------------------------------------------------------------

LINK = re.compile(r"\]\(([^()\s]+)\)")
PAGES = [*DOCUMENTS, *(ROOT / source for source in ELSEWHERE if source not in ("README.md", "CONTRIBUTING.md"))]


def _anchors(page: Path) -> set[str]:
    """Of headings that have the same one on the site as where the repository is shown."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    names = (re.sub(r"[^\w\- ]", "", title.lower()).strip() for title in titles)
    return {name.replace(" ", "-") for name in names if not re.search(r"[- ]{2}", name)}


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_no_link_is_dead(page: Path) -> None:
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for target in LINK.findall(text):
        if target.startswith(("http://", "https://", "mailto:")):
            continue
        name, _, anchor = target.partition("#")
        found = (page.parent / name).resolve() if name else page
        assert found.exists(), f"{page.name}: {target}"
        assert not anchor or anchor in _anchors(found), f"{page.name}: {target}"
        # The site has the pages that docs/stage.py lays out: from docs/, a link leads nowhere else.
        assert not page.is_relative_to(ROOT / "docs") or found in pages(), f"{page.name}: {target}"


def test_links_lead_to_where_pages_lie_on_the_site() -> None:
    placed = pages()
    source = ROOT / "docs" / "tutorials" / "vilad.md"
    text = (
        "[a](../vilad.md#figures) [b](../../benchmarks/RESULTS.md) [c](../../pyproject.toml) `x`\n```\n[a](b.md)\n```\n"
    )
    assert turned(text, source, placed) == "[a](../vilad.md#figures) [b](../results.md) c `x`\n```\n[a](b.md)\n```\n"
    for page in (one for one in placed if one.suffix == ".md"):
        laid = turned(page.read_text(encoding="utf-8"), page, placed)
        for target in LINK.findall(re.sub(r"^```.*?^```", "", laid, flags=re.MULTILINE | re.DOTALL)):
            if not re.match(r"[a-z]+:|#", target):
                meant = (placed[page].parent / target.partition("#")[0]).resolve()
                assert meant in placed.values(), f"{page.name}: {target}"


def test_every_page_is_in_the_menu_and_at_the_start() -> None:
    def named(menu: object) -> list[str]:
        if isinstance(menu, str):
            return [menu]
        parts = menu.values() if isinstance(menu, dict) else menu
        return [page for part in parts for page in named(part)]  # type: ignore[union-attr]

    menu = named(tomllib.loads((ROOT / "zensical.toml").read_text(encoding="utf-8"))["project"]["nav"])
    assert len(menu) == len(set(menu))
    assert set(menu) == {str(place.relative_to(BOOK)) for place in pages().values() if place.suffix == ".md"}
    start = ROOT / "docs" / "index.md"
    linked = {(start.parent / target).resolve() for target in LINK.findall(start.read_text(encoding="utf-8"))}
    assert linked | {start} >= set((ROOT / "docs").rglob("*.md"))


def test_every_picture_is_shown_and_made_by_its_script() -> None:
    made = {name for _, names in PICTURES.values() for name in names}
    assert made == {path.name for path in (ROOT / "docs" / "images").iterdir()}
    shown = "".join(page.read_text(encoding="utf-8") for page in DOCUMENTS)
    assert all(f"images/{name})" in shown for name in made)


def test_the_reference_has_all_that_the_package_offers() -> None:
    text = (ROOT / "docs" / "reference.md").read_text(encoding="utf-8")
    named = re.findall(r"^::: ([\w.]+)\.(\w+)$", text, re.MULTILINE)
    for module, name in named:
        assert hasattr(importlib.import_module(module), name), f"{module}.{name}"
    assert {name for _, name in named} >= set(chauffeur.__all__) - {"__version__"}


FIGURES = {
    "wishes": (
        r"([\d.]+) % of 200 held-out wishes right at once, ([\d.]+) % with one yes, ([\d.]+) % driven wrongly",
        r"\| `onboard`, held out \| 200 \| ([\d.]+) % [^|]*\| ([\d.]+) % [^|]*\| ([\d.]+) %",
    ),
    "LaMPilot-Bench": (
        r"3,136 items: ([\d.]+) % completed, ([\d.]+) % collisions, driving score ([\d.]+)",
        r"development data, 3,136 .*?\| ([\d.]+) / ([\d.]+) / \*\*([\d.]+)\*\*",
    ),
    "town, expert": (
        r"expert ([\d.]+), by words",
        r"\| expert \(`--planner expert [^|]*\| 78 \|[^|]*\|[^|]*\| ([\d.]+) \[",
    ),
    "town, words": (r"by words ([\d.]+) of 100", r"\| by words \(`--planner [^|]*\| 78 \|[^|]*\|[^|]*\| ([\d.]+) \["),
    "questions": (
        r"([\d.]+) % of unseen simulated questions, ([\d.]+) % blind",
        r"\| total \| ([\d.]+) \|[^|]*\|[^|]*\|[^|]*\| ([\d.]+) \|",
    ),
    "voice": (r"([\d.]+) ms from the end of speech", r"\| `talk2drive` \| 30 of 30 \| \*\*([\d.]+) ms"),
    "memory": (
        r"highways ([\d.]+) % without memory, ([\d.]+) % with it",
        r"\*\*([\d.]+) \[13, 31\] / ([\d.]+) \[10, 22\]\*\*",
    ),
    "gains": (r"driving score ([\d.]+), with fixed", r"\| vlm, front camera \|[^|]*\|[^|]*\| ([\d.]+) /"),
    "fixed gains": (r"with fixed gains ([\d.]+);", r"\| fixed gains \|[^|]*\|[^|]*\| ([\d.]+) /"),
    "ViLaD": (
        r"new phrasing: ([\d.]+) % success",
        r"(?s)ViLaD, parking by words.*?\| network, as driven \|[^|]*\|[^|]*\| ([\d.]+) \|",
    ),
    "linear reader": (
        r"same solver ([\d.]+) %",
        r"(?s)ViLaD, parking by words.*?\| the same on 100,000 \|[^|]*\|[^|]*\| ([\d.]+) \|",
    ),
    "shield": (
        r"shield: ([\d.]+) collisions caused by the ego in ([\d,]+) trips, ([\d.]+) by others",
        r"\| all \| all \| \*\*(?P<b>[\d,]+)\*\* \| \*\*(?P<a>\d+)\*\* / (?P<c>\d+) /",
    ),
    "first drive": (r"The first drive takes (\d+) s", r"`make drive` for the first time .*?\| (\d+) s"),
    "next drive": (r"the next (\d+) s", r"`make drive` after that \| (\d+) s"),
    "installing": (r"\((\d+) s installing", r"of which installing .*?\| (\d+) s"),
    "compiling": (r"installing, (\d+) s compiling", r"of which compiling .*?\| (\d+) s"),
    "crowded": (r"crowded machine (\d+) s, (\d+) s of", r"crowded machine \(load 11\): [^|]*\| (\d+) / (\d+) s"),
    "disk": (r"`\.venv` is then (\d+) MB", r"`\.venv` after it, .*?\| (\d+) MB"),
}
"""Figures of the README and of the page on installing, and where RESULTS has them."""


@pytest.mark.parametrize("name", FIGURES)
def test_figures_of_the_readme_are_those_of_the_results(name: str) -> None:
    shown = "".join((ROOT / page).read_text(encoding="utf-8") for page in ("README.md", "docs/install.md"))
    results = (ROOT / "benchmarks" / "RESULTS.md").read_text(encoding="utf-8")
    said, (measured,) = (
        list(re.finditer(pattern, text)) for pattern, text in zip(FIGURES[name], (shown, results), strict=True)
    )
    by_name = measured.groupdict()
    figures = tuple(by_name[key] for key in sorted(by_name)) or measured.groups()
    assert said and all(one.groups() == figures for one in said)


def test_the_readme_is_one_screen_and_has_one_line_a_system() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(readme.splitlines()) <= 70
    table = readme.partition("## The paper's nine systems")[2].partition("\n## ")[0]
    rows = [line for line in table.splitlines() if line.startswith("| [")]
    assert len(rows) == 9 and all(re.search(r"\d", row.split("|")[2]) for row in rows)
    picture = re.search(r"!\[Simulated [^]]*\]\((docs/images/[\w.-]+)\)", readme)
    assert picture and (ROOT / picture.group(1)).stat().st_size < 1_500_000


def test_the_headline_of_the_model_is_the_row_of_its_table() -> None:
    results = (ROOT / "benchmarks" / "RESULTS.md").read_text(encoding="utf-8")
    table = results.partition("### Under `origin`")[2].partition("\n### ")[0]
    (headline,) = re.findall(
        r"development data, 3,136 .*?\| ([\d.]+) / ([\d.]+) / \*\*([\d.]+)\*\* \| ([\d.]+) / ([\d.]+) / ([\d.]+)",
        results,
    )
    for label, (done, collided, score) in (("onboard (", headline[:3]), ("retrieval (", headline[3:])):
        (cells,) = [
            re.sub(r" \[.*?\]", "", line).split(" | ") for line in table.splitlines() if line.startswith(f"| {label}")
        ]
        assert (cells[3], cells[2], cells[-1].rstrip(" |")) == (done, collided, score), label


# Judges -----------------------------------------------------------------------------------------------------------


def test_every_table_of_the_results_names_its_judge() -> None:
    """Nobody judges themselves: what decides a figure, and what it shares with what it decides on, stands beside it."""
    results = (ROOT / "benchmarks" / "RESULTS.md").read_text(encoding="utf-8")
    sections = re.split(r"^(?=##+ )", results, flags=re.MULTILINE)
    judged = [one for one in sections if re.search(r"^\|", one, re.MULTILINE)]
    assert len(judged) > 25
    silent = [one.partition("\n")[0] for one in judged if not re.search(r"^Judge: ", one, re.MULTILINE)]
    assert not silent
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert re.search(r"^Judge: ", readme.partition("nine systems")[2].partition("\n## ")[0], re.MULTILINE)
