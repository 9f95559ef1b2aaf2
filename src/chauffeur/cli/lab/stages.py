"""Long work in stages: bars on a terminal, plain lines now and then elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from chauffeur.cli.lab.bench_progress import LINE_EVERY_S

if TYPE_CHECKING:
    from rich.console import Console


@contextmanager
def stages_shown(console: Console) -> Generator[Callable[[str, int, int], None]]:
    """A function to be told (stage, done, of how many); what stands behind a comma in a stage's name may change."""
    if not console.is_terminal:
        yield _lines(console)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    bars: dict[str, TaskID] = {}
    with Progress(*columns, console=console) as shown:

        def told(stage: str, done: int, of: int) -> None:
            name = stage.partition(",")[0]
            if name not in bars:
                bars[name] = shown.add_task(name)
            shown.update(bars[name], completed=done, total=of, description=stage)

        yield told


def _lines(console: Console) -> Callable[[str, int, int], None]:
    shown: dict[str, float] = {}

    def told(stage: str, done: int, of: int) -> None:
        name = stage.partition(",")[0]
        now = time.monotonic()
        if done == of or now - shown.get(name, 0.0) >= LINE_EVERY_S:
            shown[name] = now
            console.print(f"{stage}: {done:,} of {of:,}", soft_wrap=True)

    return told
