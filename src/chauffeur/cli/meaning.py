"""`chauffeur show meaning`: what the car understands of words."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer
from rich.text import Text

from chauffeur.cli.console import plain, stdout
from chauffeur.concept import ConfigError, DataError

if TYPE_CHECKING:
    from chauffeur.concept.utterance import Utterance

_UNSURE = 0.5
"""Below this the reading is more likely wrong than right: the car would ask."""


def meaning(
    words: Annotated[str, typer.Argument(help="What a passenger says.")] = "",
    source: Annotated[Path | None, typer.Option("--in", help="Read texts from a JSONL file.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write what was read to a JSONL file.")] = None,
) -> None:
    """Show what words mean to the car: acts, what they refer to, what they wait for, and what was not used."""
    from chauffeur.language.meaning.reader import read

    if bool(words.strip()) == (source is not None):
        raise ConfigError("Give words or --in FILE, one of the two.", hint='chauffeur show meaning "turn left"')
    if source is None:
        _show(read(words))
        return
    if out is None:
        raise ConfigError("--in needs --out.", hint="chauffeur show meaning --in commands.jsonl --out read.jsonl")
    rows = _rows(source)
    with out.open("w", encoding="utf-8") as file:
        for row in rows:
            file.write(json.dumps(_row(row["id"], read(row["text"])), ensure_ascii=False) + "\n")
    stdout().print(f"{len(rows)} texts read: {out}")


def _rows(source: Path) -> list[dict[str, Any]]:
    try:
        lines = source.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{source} cannot be read: {error}.") from error
    found: list[dict[str, Any]] = []
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            row: Any = json.loads(line)
        except (ValueError, RecursionError) as error:
            raise DataError(f"{source}, line {number}: no JSON: {error}.") from error
        if not isinstance(row, dict):
            raise DataError(f"{source}, line {number}: an object with `id` and `text` is wanted.")
        held = cast("dict[str, Any]", row)
        if not isinstance(held.get("text"), str) or "id" not in held:
            raise DataError(f"{source}, line {number}: an object with `id` and `text` is wanted.")
        found.append(held)
    return found


def _row(name: Any, utterance: Utterance) -> dict[str, Any]:
    from chauffeur.concept.utterance import acts_to_json

    return {
        "id": name,
        "acts": acts_to_json(utterance.acts),
        "address": utterance.address,
        "emergency": utterance.emergency,
        "asked": bool(utterance.acts) and utterance.sure < _UNSURE,
        "sure": round(utterance.sure, 3),
        "unused": [utterance.text[low:high] for low, high in utterance.unused],
    }


def _show(utterance: Utterance) -> None:
    from chauffeur.language.meaning.words import act_words

    console = stdout()
    if utterance.emergency:
        console.print(Text("Stop or distress: the emergency answer goes first.", style="bold red"))
    if not utterance.acts:
        about = {"car": "nothing for the car to do", "other": "said to another person"}
        console.print(Text(f"No act: {about.get(utterance.address, f'a {utterance.address}')}."))
    for number, act in enumerate(utterance.acts, 1):
        line = Text(f"{number}. ", style="bold")
        line.append(act_words(act), style="bold")
        if act.span is not None:
            line.append(f"   “{utterance.text[act.span[0] : act.span[1]]}”", style="dim")
        console.print(line)
    for low, high in utterance.unused:
        console.print(plain(f"   not used: “{utterance.text[low:high]}”"), style="dim")
    doubt = "  The car would ask first." if utterance.acts and utterance.sure < _UNSURE else ""
    console.print(Text(f"   sure: {100 * utterance.sure:.0f} %{doubt}", style="dim"))
