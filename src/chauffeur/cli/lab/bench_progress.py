"""How a benchmark run is shown while it works: a live line on a terminal, plain lines now and then elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.kernel.progress import Standing

LINE_EVERY_S: Final = 10.0


@contextmanager
def shown(console: Console, clock: Callable[[], float]) -> Generator[Callable[[Standing], None]]:
    """A function to be told where the run stands.

    Args:
        console: Where to show it.
        clock: Seconds of a clock that never goes back.
    """
    if not console.is_terminal:
        yield _lines(console, clock)
        return
    from rich.console import Group
    from rich.live import Live
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.text import Text

    bar = Progress(
        BarColumn(bar_width=24), MofNCompleteColumn(), TextColumn("{task.description}", markup=False), console=console
    )
    task = bar.add_task("starting", total=None)
    with Live(bar, console=console, refresh_per_second=4) as live:

        def show(standing: Standing) -> None:
            bar.update(task, total=standing.planned, completed=standing.done, description=pace_words(standing))
            live.update(Group(bar, Text("; ".join(state_words(standing)), style="dim")))

        yield show


def _lines(console: Console, clock: Callable[[], float]) -> Callable[[Standing], None]:
    last_s = clock()
    last = ""

    def show(standing: Standing) -> None:
        nonlocal last_s, last
        whole = standing.done == standing.planned
        if clock() - last_s < LINE_EVERY_S and not whole:
            return
        line = "; ".join([f"{standing.done:,}/{standing.planned:,} {pace_words(standing)}", *state_words(standing)])
        if line != last:
            console.print(line, soft_wrap=True)
        last_s, last = clock(), line

    return show


def pace_words(standing: Standing) -> str:
    """Rate and time to go."""
    rate = f"{standing.rate:.1f}/s"
    if standing.eta_s is None or standing.done >= standing.planned:
        return rate
    return f"{rate}, {_time(standing.eta_s)} to go"


def state_words(standing: Standing) -> list[str]:
    """What is in flight, what was spent, and how well it goes so far."""
    parts: list[str] = []
    if standing.requests or standing.in_flight:
        held = f" (the endpoint asks to wait {standing.held_s:.0f} s)" if standing.held_s > 1.0 else ""
        parts.append(f"{standing.in_flight} of {standing.window} in flight{held}")
        money = f", {standing.usd:.2f} USD" if standing.usd else ""
        parts.append(f"{standing.requests:,} requests{money}")
    if standing.completion is not None and standing.collision is not None:
        parts.append(
            f"so far: completion {100 * standing.completion:.1f} %, collision {100 * standing.collision:.2f} %"
        )
    if standing.failed:
        parts.append(f"{standing.failed} infra failed")
    return parts


def _time(seconds: float) -> str:
    minutes, rest = divmod(int(seconds + 0.5), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
