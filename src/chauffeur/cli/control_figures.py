"""How control did in a drive, in words: for the end of `chauffeur talk`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from chauffeur.cli.labels import FALLBACK_LEVELS
from chauffeur.driving.talk.tally import Tally
from chauffeur.hmi import words

_SCHEDULING: Final = {
    "fifo": "Real time (fifo): no ordinary program takes its core",
    "nice": "Favoured (nice): other programs get less of its core, but some",
    "default": "As any other program (default): no more was asked for, or allowed",
}


def control_figures(tally: Tally) -> Iterator[tuple[str, str]]:
    """Label and words of each figure that says something."""
    if tally.trouble:
        yield "last words", tally.trouble
    yield "shield", words.shield_words(tally.changes) or "The shield changed no command."
    if tally.clipped:
        count = ", ".join(f"{name} {times}" for name, times in tally.clipped.most_common())
        yield "limits", f"Wishes held within the limits, in control periods: {count}."
    lower = [
        f"{FALLBACK_LEVELS[level]}: {_periods(count)}" for level, count in tally.levels.items() if level != "follow"
    ]
    if lower:
        yield "fallbacks", "; ".join(lower) + "."
    yield from _punctuality(tally)
    last = tally.last
    if last is not None and last.refused:
        count = ", ".join(f"{why} {times}" for why, times in last.refused.items())
        yield "disbelieved", f"Messages of the policy that control did not believe: {count}."
    if last is not None and last.faults:
        yield "faults", f"{_periods(last.faults)} of control failed and were answered by braking."
    if tally.lost_reports:
        yield "reports", f"{tally.lost_reports} lost."


def _punctuality(tally: Tally) -> Iterator[tuple[str, str]]:
    figures = tally.figures
    if figures is None:
        yield "control", "It left no figures of its punctuality."
        return
    period_ms = 1000.0 * figures["period_s"]
    due = figures["ticks"] + figures["missed"]
    yield "control", f"{figures['missed']} of {_periods(due)} of {period_ms:g} ms were missed."
    late = ("p50", "p99", "p999", "max")
    shares = ("50 %", "99 %", "99.9 %", "all")
    told = (f"{figures[f'{at}_ms']:.2f} ms ({share})" for at, share in zip(late, shares, strict=True))
    yield "punctuality", f"Periods began late by at most {', '.join(told)}."
    memory = "" if figures["memory_locked"] else "; memory not locked"
    yield "scheduling", f"{_SCHEDULING[figures['scheduling']]}{memory}."


def _periods(count: int) -> str:
    return f"{count} period{'' if count == 1 else 's'}"
