"""Long work in stages, told in plain lines now and then."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from chauffeur.cli.lab.bench_progress import LINE_EVERY_S

if TYPE_CHECKING:
    from rich.console import Console


def stage_lines(console: Console) -> Callable[[str, int, int], None]:
    """A function to be told (stage, done, of how many); what stands behind a comma in a stage's name may change."""
    shown: dict[str, float] = {}

    def told(stage: str, done: int, of: int) -> None:
        name = stage.partition(",")[0]
        now = time.monotonic()
        if done == of or now - shown.get(name, 0.0) >= LINE_EVERY_S:
            shown[name] = now
            console.print(f"{stage}: {done:,} of {of:,}", soft_wrap=True)

    return told
