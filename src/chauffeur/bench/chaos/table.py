"""The suite's figures: a line for every kind of fault, and what was unsafe or lost, case by case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from chauffeur.bench.chaos.cases import KINDS
from chauffeur.bench.chaos.judge import MOST_SILENT
from chauffeur.drive.live.fallback_levels import FALLBACK_LEVELS

Rows = Sequence[Mapping[str, Any]]

HEADER: Final = (
    "fault", "cases", "unsafe", "lost", "left behind", "periods", "missed", "back s p50", "p95", "max", "not back",
    "worst level", "replanned", "s p50",
)  # fmt: skip


def lines(rows: Rows) -> list[list[str]]:
    """A line a kind, one a family, and one for all."""
    known = [kind.name for kind in KINDS]
    families = list(dict.fromkeys(kind.family for kind in KINDS))
    parts: list[tuple[str, Rows]] = [(name, [row for row in rows if row["kind"] == name]) for name in known]
    parts += [(f"all: {name}", [row for row in rows if row["family"] == name]) for name in families]
    return [_line(name, part) for name, part in [*parts, ("all", rows)] if part]


def figures(rows: Rows) -> dict[str, dict[str, Any]]:
    """The same as numbers."""
    return {line[0]: dict(zip(HEADER[1:], line[1:], strict=True)) for line in lines(rows)}


def failures(rows: Rows) -> list[str]:
    """What must not be, a line each."""
    found: list[str] = []
    for row in rows:
        words = [*row["unsafe"]]
        words += [f"no answer to {wish!r}" for wish in row["lost"]]
        words += [f"left behind: {what}" for what in row["left_behind"]]
        found += [f"case {row['case']} ({row['kind']}, {row['stage']}): {what}" for what in words]
    return found


def headline(rows: Rows) -> str:
    """The result in a sentence."""
    unsafe, lost = sum(bool(row["unsafe"]) for row in rows), sum(len(row["lost"]) for row in rows)
    wishes = sum(len(row["wishes"]) for row in rows)
    periods, missed = sum(row["ticks"] for row in rows), sum(row["deeds"]["missed"] for row in rows)
    stood = [row["machine_stood_ms"] for row in rows if _excused(row)]
    machine = (
        f" In {len(stood)} of the safe cases control was silent while the machine itself stood still, "
        f"for up to {max(stood)} ms."
        if stood
        else ""
    )
    return (
        f"In {len(rows):,} cases {unsafe} led to unsafe actuation and {lost} of {wishes:,} wishes went without an "
        f"answer; control missed {missed:,} of {periods + missed:,} periods.{machine}"
    )


def _excused(row: Mapping[str, Any]) -> bool:
    """Whether only the machine's standing still explains how long control was silent."""
    return row["deeds"]["longest_silence"] > MOST_SILENT and not row["unsafe"]


def table_markdown(rows: Rows, title: str) -> str:
    """The figures as Markdown."""
    rule = "|".join(["---", *["---:"] * (len(HEADER) - 1)])
    body = [f"| {' | '.join(cells)} |" for cells in (HEADER, *lines(rows))]
    wrong = failures(rows)
    parts = [f"# {title}", headline(rows), "\n".join([body[0], f"|{rule}|", *body[1:]])]
    parts.append("\n".join(["Nothing failed."] if not wrong else [f"- {line}" for line in wrong]))
    return "\n\n".join(parts) + "\n"


def _line(name: str, rows: Rows) -> list[str]:
    back = [row["to_follow_s"] for row in rows if row["to_follow_s"] is not None]
    disturbed = [value for value in back if value > 0.0]
    new = [row["to_new_plan_s"] for row in rows if row["to_new_plan_s"] is not None]
    worst = max((row["worst"] for row in rows), key=FALLBACK_LEVELS.index)
    return [
        name,
        str(len(rows)),
        str(sum(bool(row["unsafe"]) for row in rows)),
        str(sum(len(row["lost"]) for row in rows)),
        str(sum(len(row["left_behind"]) for row in rows)),
        str(sum(row["ticks"] for row in rows)),
        str(sum(row["deeds"]["missed"] for row in rows)),
        _percentile(disturbed, 50),
        _percentile(disturbed, 95),
        _percentile(disturbed, 100),
        str(len(rows) - len(back)),
        worst,
        str(len(new)),
        _percentile(new, 50),
    ]


def _percentile(values: Sequence[float], percent: float) -> str:
    return f"{float(np.percentile(values, percent)):.2f}" if values else "-"
