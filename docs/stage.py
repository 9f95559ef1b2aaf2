"""Lay out the site's sources under `build/book`: docs/, and the pages that stand elsewhere in the repository.

`make docs` runs it, then zensical. A page stands once: RESULTS, the architecture, the change log and the model cards
are copied from where they are, and links between them are turned to where they lie on the site. A link to a file that
is no page of the site becomes plain text. `python docs/stage.py notebooks` writes the tutorials of `NOTEBOOKS` as
notebooks.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BOOK = ROOT / "build" / "book"
ELSEWHERE = {
    "README.md": "readme.md",
    "benchmarks/RESULTS.md": "results.md",
    "ARCHITECTURE.md": "architecture.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "src/chauffeur/language/meaning/weights/CARD.md": "cards/meaning.md",
    "src/chauffeur/planners/onboard/weights/MODEL_CARD.md": "cards/onboard.md",
    "src/chauffeur/planners/onboard/weights/DATA_CARD.md": "cards/onboard-data.md",
    "src/chauffeur/planners/vlm/weights/MODEL_CARD.md": "cards/vlm.md",
    "src/chauffeur/planners/vilad/weights/MODEL_CARD.md": "cards/vilad-parking.md",
    "src/chauffeur/planners/vilad/weights/drive/MODEL_CARD.md": "cards/vilad-drive.md",
    "src/chauffeur/models/vilad/weights/frames/MODEL_CARD.md": "cards/vilad-frames.md",
    "src/chauffeur/models/bev_llm/weights/MODEL_CARD.md": "cards/bev-llm.md",
    "src/chauffeur/models/sorting/CARD.md": "cards/sorting.md",
}
"""Pages outside docs/, and their place on the site."""
NOTEBOOKS = ("a-wish", "vilad")
"""Tutorials that are notebooks as well, in docs/notebooks."""
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^()\s]+)\)")
FENCE = re.compile(r"^(```.*?^```)", re.MULTILINE | re.DOTALL)


def pages() -> dict[Path, Path]:
    """Every file of the site: where it stands in the repository, and where under `build/book`."""
    docs = [path for path in (ROOT / "docs").rglob("*") if path.is_file() and path.suffix not in (".py", ".pyc")]
    found = {path: BOOK / path.relative_to(ROOT / "docs") for path in docs}
    return found | {ROOT / source: BOOK / place for source, place in ELSEWHERE.items()}


def turned(text: str, source: Path, placed: dict[Path, Path]) -> str:
    """A page's text with its links as they lead on the site; code is left alone."""

    def turn(match: re.Match[str]) -> str:
        mark, label, target = match.groups()
        name, sharp, anchor = target.partition("#")
        if not name or re.match(r"[a-z]+:", name):
            return match.group()
        meant = Path(os.path.normpath(source.parent / name))
        if meant not in placed:
            return label
        here = os.path.relpath(placed[meant], placed[source].parent)
        return f"{mark}[{label}]({here}{sharp}{anchor})"

    return "".join(part if part.startswith("```") else LINK.sub(turn, part) for part in FENCE.split(text))


def stage() -> None:
    """Write `build/book` anew."""
    shutil.rmtree(BOOK, ignore_errors=True)
    placed = pages()
    for source, place in placed.items():
        place.parent.mkdir(parents=True, exist_ok=True)
        if source.suffix == ".md":
            place.write_text(turned(source.read_text(encoding="utf-8"), source, placed), encoding="utf-8")
        else:
            shutil.copyfile(source, place)


def notebook(page: str) -> str:
    """A tutorial's text as a notebook without outputs: Python as cells, commands as `!` lines, the rest as text."""
    cells: list[dict[str, object]] = []

    def add(kind: str, text: str) -> None:
        if not text.strip():
            return
        cell: dict[str, object] = {"cell_type": kind, "id": f"cell-{len(cells)}", "metadata": {}}
        cell["source"] = text.strip().splitlines(keepends=True)
        cells.append(cell | ({"execution_count": None, "outputs": []} if kind == "code" else {}))

    for part in FENCE.split(page):
        code = re.fullmatch(r"```(python|sh)\n(.*?)```", part, re.DOTALL)
        if code is None:
            add("markdown", part.replace("```output", "```text"))
        else:
            shell = "" if code.group(1) == "python" else "!"
            add("code", "".join(f"{shell}{line}\n" for line in code.group(2).splitlines()))
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return json.dumps({"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}, indent=1) + "\n"


def tutorial(name: str) -> str:
    """Text of a tutorial, without the line that leads to its notebook."""
    page = (ROOT / "docs" / "tutorials" / f"{name}.md").read_text(encoding="utf-8")
    return page.replace(f"[As a notebook](../notebooks/{name}.ipynb).\n\n", "")


if __name__ == "__main__":
    if sys.argv[1:] == ["notebooks"]:
        for name in NOTEBOOKS:
            (ROOT / "docs" / "notebooks" / f"{name}.ipynb").write_text(notebook(tutorial(name)), encoding="utf-8")
    else:
        stage()
