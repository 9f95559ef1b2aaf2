"""The question for waypoints: the car's own motion, what the navigation and the passenger say, and how to answer.

It is the same in an open loop (`bench/openloop`) and where the answer is driven (`planners/waypoints.py`). Arrays are
in the ego frame of the instant: x ahead, y left, m.
"""

from __future__ import annotations

import math
from base64 import b64encode
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from chauffeur.foreign.waypoints import STEP_S

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chauffeur.planners.prompts.turns import ImagePart, Message, TextPart

    FloatArray = NDArray[np.float64]

HISTORY: Final = 4
"""Places before the present one, half a second apart: 2 s."""
ASIDE_M: Final = 2.0
"""ST-P3's and UniAD's high-level command: left or right where the way is so far aside after 3 s."""
ROLE: Final = (
    "You drive a car. The picture is of its front camera, now. Positions are in the car's own frame of this instant, "
    "in metres: x ahead, y to the left; the car is at (0, 0)."
)
_WORDS: Final = {6: "six", 12: "twelve"}
_SAID: Final = "Navigation: "
_WISH: Final = "The passenger says: "
_WAS: Final = "Was at (x, y, heading in degrees): "


def motion_words(history: FloatArray, command: str = "") -> str:
    """Own motion in words, and what the navigation says.

    Args:
        history: Poses (x, y, heading rad) half a second apart, oldest first, the present one last; (HISTORY + 1, 3).
        command: High-level command; empty for none.
    """
    past = ", ".join(
        f"{(i - HISTORY) * STEP_S:.1f} s ({x:.2f}, {y:.2f}, {math.degrees(heading):.1f})"
        for i, (x, y, heading) in enumerate(history)
    )
    legs = pairwise(history)
    speeds = ", ".join(f"{math.hypot(b[0] - a[0], b[1] - a[1]) / STEP_S:.1f}" for a, b in legs)
    said = f"\n{_SAID}{command}" if command else ""
    return f"{_WAS}{past}.\nSpeed over each half second, m/s: {speeds}.{said}"


def command_of(aside_m: float) -> str:
    """High-level command for a way that lies so far to the left after 3 s."""
    return "turn left" if aside_m >= ASIDE_M else "turn right" if aside_m <= -ASIDE_M else "go straight"


def tells_motion(text: str) -> bool:
    """True if a text has what `motion_words` writes."""
    return any(line.startswith(_WAS) for line in text.splitlines())


def read_motion(text: str) -> tuple[FloatArray, str]:
    """History (HISTORY + 1, 3) and command out of what `motion_words` wrote. Raises ValueError: it is not there."""
    import numpy as np

    lines = text.splitlines()
    past = next((line for line in lines if line.startswith(_WAS)), "").removeprefix(_WAS)
    rows: list[tuple[float, float, float]] = []
    for part in past.split("(")[1:]:
        x, y, heading = (float(number) for number in part.partition(")")[0].split(","))
        rows.append((x, y, math.radians(heading)))
    if len(rows) != HISTORY + 1:
        raise ValueError(f"{len(rows)} past positions, not {HISTORY + 1}")
    said = next((line for line in lines if line.startswith(_SAID)), "").removeprefix(_SAID)
    return np.array(rows), said


def with_wish(text: str, instruction: str) -> str:
    """A question with the passenger's instruction before it; the question alone where there is none."""
    return f"{_WISH}{instruction}\n{text}" if instruction else text


def ask(steps: int) -> str:
    """The question for so many waypoints, half seconds apart."""
    *times, last = (f"{STEP_S * (i + 1):.1f}" for i in range(steps))
    form = ", ".join(["(x, y)"] * steps)
    return (
        f"Where will the car be {', '.join(times)} and {last} s from now? "
        f"Answer with {_WORDS.get(steps, steps)} positions, nothing else: [{form}]"
    )


def asked_of(jpeg: bytes | None, text: str) -> Message:
    """The turn that asks: the front camera's picture, where there is one, and the text."""
    parts: list[TextPart | ImagePart] = [{"type": "text", "text": text}]
    if jpeg is not None:
        url = f"data:image/jpeg;base64,{b64encode(jpeg).decode('ascii')}"
        seen: ImagePart = {"type": "image_url", "image_url": {"url": url}}
        parts = [{"type": "text", "text": "Front camera, now:"}, seen, *parts]
    return {"role": "user", "content": parts}


def waypoints_text(waypoints: FloatArray) -> str:
    """Waypoints (steps, 2) as an answer says them."""
    return "[" + ", ".join(f"({x:.2f}, {y:.2f})" for x, y in waypoints) + "]"
