"""Requests to a model: waypoints after a picture and the car's own motion, in three settings.

zero-shot         one question.
chain-of-thought  OpenEMMA's three questions first (the scene, the road users that matter, the driver's intent), each
                  answered before the next; then the waypoints with those answers before the eyes.
sft               the short question that a fine-tuned model was trained on, and nothing else (`training_lines`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, cast

from chauffeur.bench.openloop.nuscenes import FUTURE, HISTORY, STEP_S, PlanningSample
from chauffeur.bench.pictures import data_uri, read_picture

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chauffeur.planners.prompts import Message

    FloatArray = NDArray[np.float64]

ASKING: Final = "ask-v1"
"""Id of the wordings below; figures belong to them."""
OpenLoopSetting = Literal["zero-shot", "chain-of-thought", "sft"]
Shown = Literal["pictures", "blank"]

THOUGHTS: Final = (
    "Describe the scene in front of the car: road, lanes, traffic lights and signs, weather and light.",
    "Which two or three road users or objects matter most for the car now? For each: where it is and what it does.",
    "What is the driver about to do: turn left, turn right or go straight, and faster, slower or as fast as now?",
)
"""OpenEMMA's three steps before the waypoints (scene, objects, intent), in our words."""
_ROLE: Final = (
    "You drive a car. The picture is of its front camera, now. Positions are in the car's own frame of this instant, "
    "in metres: x ahead, y to the left; the car is at (0, 0)."
)
_WORDS: Final = {6: "six", 12: "twelve"}
_SAID: Final = "Navigation: "
_WISH: Final = "The passenger says: "
_WAS: Final = "Was at (x, y, heading in degrees): "


def context_of(sample: PlanningSample) -> str:
    """Text beside the picture: own motion over 2 s, and what the navigation says."""
    past = ", ".join(
        f"{(i - HISTORY) * STEP_S:.1f} s ({x:.2f}, {y:.2f}, {math.degrees(heading):.1f})"
        for i, (x, y, heading) in enumerate(sample.history)
    )
    speeds = ", ".join(f"{speed:.1f}" for speed in sample.speeds_mps)
    said = f"\n{_SAID}{sample.command}" if sample.command else ""
    return f"{_WAS}{past}.\nSpeed over each half second, m/s: {speeds}.{said}"


def read_context(text: str) -> tuple[FloatArray, str]:
    """History (5, 3) and command out of what `context_of` wrote; raises ValueError where it is not there."""
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


def question(sample: PlanningSample, setting: OpenLoopSetting, instruction: str = "") -> str:
    """The text of the last question, with what the passenger says where there is an instruction."""
    if setting == "sft":
        return f"{context_of(sample)}\nWaypoints:"
    return f"{_ROLE}\n{context_of(sample)}\n{with_wish(_ask(len(sample.future)), instruction)}"


def with_wish(text: str, instruction: str) -> str:
    """A question with the passenger's instruction before it; the question alone where there is none."""
    return f"{_WISH}{instruction}\n{text}" if instruction else text


def _ask(steps: int) -> str:
    """The question for so many waypoints, half seconds apart."""
    *times, last = (f"{STEP_S * (i + 1):.1f}" for i in range(steps))
    form = ", ".join(["(x, y)"] * steps)
    return (
        f"Where will the car be {', '.join(times)} and {last} s from now? "
        f"Answer with {_WORDS.get(steps, steps)} positions, nothing else: [{form}]"
    )


def opening(sample: PlanningSample, text: str, shown: Shown, side_px: int) -> Message:
    """A turn with the picture and a text. Raises DataError: the picture is missing or damaged."""
    picture = data_uri(read_picture(sample.picture, side_px, "blank" if shown == "blank" else "real"))
    parts: list[dict[str, Any]] = [
        {"type": "text", "text": "Front camera, now:"},
        {"type": "image_url", "image_url": {"url": picture}},
        {"type": "text", "text": text},
    ]
    return cast("Message", {"role": "user", "content": parts})


def waypoints_text(waypoints: FloatArray) -> str:
    """Waypoints (6, 2) as an answer says them."""
    return "[" + ", ".join(f"({x:.2f}, {y:.2f})" for x, y in waypoints) + "]"


def training_lines(samples: Iterable[PlanningSample], root: Path) -> Iterator[str]:
    """Samples as lines of chat fine-tuning in the `sft` setting, pictures by path below `root`; JSON, one a line."""
    for sample in samples:
        content: Sequence[dict[str, Any]] = (
            {"type": "image", "image": sample.picture.relative_to(root).as_posix()},
            {"type": "text", "text": question(sample, "sft")},
        )
        answer = waypoints_text(sample.future[:FUTURE])
        turns = [{"role": "user", "content": content}, {"role": "assistant", "content": answer}]
        yield json.dumps({"messages": turns}) + "\n"
