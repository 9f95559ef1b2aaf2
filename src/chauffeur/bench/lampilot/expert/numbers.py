"""The expert's numbers: speeds, margins and phases, tuned on some traffic and tested on other (benchmarks/RESULTS.md).

Speeds in m/s, distances in m, times in s, accelerations in m/s2; what each is for stands in the program texts.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from chauffeur.planners.onboard.exemplars.crossing import CROSSING

_NUMBERS: Final[dict[str, Any]] = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))

TUNED: Final[dict[str, dict[str, float]]] = {
    **_NUMBERS["tuned"],
    **{side: CROSSING[side] | {"END": -1e5} for side in CROSSING},
}
"""By style: `closer` and `wider` keep a distance, `slow` and `speed` a speed; then the manoeuvres and the turns."""

SPREAD: Final[dict[str, dict[str, tuple[float, float]]]] = {
    style: {name: (low, high) for name, (low, high) in row.items()} for style, row in _NUMBERS["spread"].items()
}
"""From where to where a number goes in variants."""
