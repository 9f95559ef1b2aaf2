"""What the terminals call the things they tell of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from chauffeur.drive.events import EventKind
    from chauffeur.drive.live.messages import FallbackLevel

FALLBACK_LEVELS: Final[dict[FallbackLevel, str]] = {
    "follow": "follows the plan",
    "hold": "holds the last wish",
    "keep": "keeps lane and distance",
    "slow": "slows down",
    "stop": "stops",
    "hand": "you drive",
}
"""The fallback levels in words."""

EVENTS: Final[dict[EventKind, tuple[str, str]]] = {
    "planned": ("thinks", "cyan"),
    "declined": ("declined", "bold yellow"),
    "answered": ("answers", "cyan"),
    "unplanned": ("no plan", "bold yellow"),
    "superseded": ("superseded", "dim"),
    "started": ("drives", "green"),
    "refused": ("refused", "bold red"),
    "stale": ("too late", "bold yellow"),
    "finished": ("done", "bold green"),
    "failed": ("failed", "bold red"),
    "interrupted": ("broken off", "yellow"),
    "resumed": ("goes on", "yellow"),
    "said": ("says", "magenta"),
    "garbage": ("garbage", "red"),
    "halt": ("stops", "bold red"),
}
"""Label and style of what becomes of a wish."""

NOT_HEARD: Final = {
    "no_hotword": "not for the car",
    "not_understood": "not understood",
    "nothing": "nothing",
    "failed": "no answer",
}
"""Why speech is no wish."""
