"""What the terminals call the things they tell of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from chauffeur.driving.live.messages import FallbackLevel

FALLBACK_LEVELS: Final[dict[FallbackLevel, str]] = {
    "follow": "follows the plan",
    "hold": "holds the last wish",
    "keep": "keeps lane and distance",
    "slow": "slows down",
    "stop": "stops",
    "hand": "you drive",
}
"""The fallback levels in words."""

NOT_HEARD: Final = {
    "no_hotword": "not for the car",
    "not_understood": "not understood",
    "nothing": "nothing",
    "failed": "no answer",
}
"""Why speech is no wish."""
