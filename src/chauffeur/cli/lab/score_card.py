"""A score card, and two of them compared, on the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from chauffeur.cli.console import columns, plain
from chauffeur.cli.failures import FAILED
from chauffeur.cli.lab.tables import show_table

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.evaluation.card import ScoreCard


def show_card(console: Console, card: ScoreCard) -> None:
    """The figures; beneath them who judged, what the paper's figures are, and what was not run and why."""
    from rich.text import Text

    from chauffeur.bench.evaluation.card import PAPER_NOTE, head_text, paper_texts
    from chauffeur.bench.evaluation.parts import LEFT_OUT

    lines: list[list[str]] = []
    for entry in card.ran:
        lines += [[entry.name, "", "", ""]]
        lines += [[f"  {one.head}", one.text, str(one.items), one.printed] for one in entry.figures]
    console.print()
    if lines:
        show_table(console, Text("Score card", "bold"), ("", "value", "items", "paper"), lines)
    console.print(plain(head_text(card)), style="dim")
    console.print("\nJudges, and what the figures come from", style="bold")
    console.print(
        columns((one.name, plain(f"{one.evidence[:1].upper()}{one.evidence[1:]}. {one.judge}")) for one in card.ran)
    )
    printed = [(entry.name, plain(text)) for entry in card.ran for text in paper_texts(entry)]
    if printed:
        console.print("\nPaper", style="bold")
        console.print(columns(printed))
        console.print(PAPER_NOTE, style="dim")
    missing = [one for one in card.entries if one.state != "done" and one.why != LEFT_OUT]
    if missing:
        console.print("\nNot run, or not whole", style="bold")
        console.print(
            columns((one.name, plain(f"{_state(one.state)}{one.why} {one.remedy}".rstrip())) for one in missing)
        )

    if left := [one.name for one in card.entries if one.why == LEFT_OUT]:
        console.print(f"\nLeft out: {', '.join(left)}.", style="dim")


def _state(state: str) -> str:
    return "" if state == "not run" else f"{state[:1].upper()}{state[1:]}: "


def show_comparison(console: Console, old: Path, new: Path) -> None:
    """Differences of two cards; what may not be compared is named. Exit code 1 where nothing may be."""
    from rich.text import Text

    from chauffeur.bench.evaluation.compare import compare_cards

    found = compare_cards(old, new)
    lines = [
        [f"{one.name}: {one.new.head}", _value(one.old.text), _value(one.new.text), one.text, "*" if one.sure else ""]
        for one in found.changes
    ]
    if lines:
        title = Text(f"{old} against {new}", "bold")
        show_table(console, title, ("", "old", "new", "difference", ""), lines)
        console.print("* its 95 % interval, paired by item, does not hold 0.", style="dim")
    for note in found.notes:
        console.print(plain(note))
    if found.refused:
        console.print("\nNot compared", style="bold")
        console.print(columns((name, plain(why)) for name, why in found.refused))
    if not lines:
        raise typer.Exit(FAILED)


def _value(text: str) -> str:
    """A figure without its ends."""
    return text.partition(" ")[0]
