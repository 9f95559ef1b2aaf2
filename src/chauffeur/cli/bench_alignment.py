"""`chauffeur bench alignment`: how well the judge of explanations finds those that do not describe their program."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.alignment import Judged

EXAMPLES = """
Examples:

    chauffeur bench alignment

    chauffeur bench alignment --items 400 --out runs/alignment

Texts and programs, about half of them with one mismatch. The generated ones are synthetic: our own programs over
simulated scenes, told by a grammar. The others were written by hand, before the judge's rules; rules may be tuned on
their tuning half only.
"""


def alignment(
    items: Annotated[int, typer.Option(min=0, help="How many generated cases; 0 for the hand-written alone.")] = 2400,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the generated cases.")] = 7,
    out: Annotated[Path | None, typer.Option(help="Folder for `cases.jsonl`: every case and its verdict.")] = None,
) -> None:
    """Explanations and programs, aligned and not: precision, recall, F1 and false alarms of the judge."""
    from chauffeur.bench.alignment import JUDGE, generate, handwritten, judge_cases, of_half
    from chauffeur.cli.console import stdout

    console = stdout()
    sets: list[tuple[str, tuple[Judged, ...]]] = []
    if items:
        console.print(f"Alignment: {items} generated cases, seed {seed}, judge {JUDGE}", soft_wrap=True)
        sets.append(("Generated (synthetic)", judge_cases(generate(items, seed))))
    written = handwritten()
    sets.append(("Written by hand, test half", judge_cases(of_half(written, "test"))))
    sets.append(("Written by hand, tuning half", judge_cases(of_half(written, "tuning"))))
    for title, judged in sets:
        _show(console, title, judged)
    console.print("A mismatch is what is looked for. Judged by reading alone; nothing was driven.")
    if out is not None:
        _save(out, [one for _, judged in sets for one in judged])
        console.print(f"Rows: {out / 'cases.jsonl'}", soft_wrap=True)


def _show(console: Console, title: str, judged: Sequence[Judged]) -> None:
    from chauffeur.bench.alignment import score, table_lines
    from chauffeur.cli.tables import show_table

    found = score(judged)
    show_table(console, title, *table_lines(judged))
    console.print(
        f"precision {found.precision:.3f}, recall {found.recall:.3f}, F1 {found.f1:.3f}, "
        f"false alarms {100 * found.false_alarms:.1f} % of {found.alarms + found.passed} aligned cases"
    )
    console.print()


def _save(folder: Path, judged: Sequence[Judged]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "cases.jsonl").open("w", encoding="utf-8") as file:
        for one in judged:
            row = asdict(one.case) | {"verdict": asdict(one.alignment)}
            file.write(json.dumps(row, ensure_ascii=False) + "\n")
