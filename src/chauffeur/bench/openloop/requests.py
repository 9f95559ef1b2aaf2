"""Requests to a model: waypoints after a picture and the car's own motion, in three settings.

zero-shot         one question.
chain-of-thought  OpenEMMA's three questions first (the scene, the road users that matter, the driver's intent), each
                  answered before the next; then the waypoints with those answers before the eyes.
sft               the short question that a fine-tuned model was trained on, and nothing else (`training_lines`).
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from chauffeur.bench.openloop.nuscenes import FUTURE, PlanningSample
from chauffeur.bench.pictures import read_picture
from chauffeur.planners.prompts.waypoints import ROLE, ask, asked_of, motion_words, waypoints_text, with_wish

if TYPE_CHECKING:
    from chauffeur.planners.prompts import Message

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


def context_of(sample: PlanningSample) -> str:
    """Text beside the picture: own motion over 2 s, and what the navigation says."""
    return motion_words(sample.history, sample.command)


def question(sample: PlanningSample, setting: OpenLoopSetting, instruction: str = "") -> str:
    """The text of the last question, with what the passenger says where there is an instruction."""
    if setting == "sft":
        return f"{context_of(sample)}\nWaypoints:"
    return f"{ROLE}\n{context_of(sample)}\n{with_wish(ask(len(sample.future)), instruction)}"


def opening(sample: PlanningSample, text: str, shown: Shown, side_px: int) -> Message:
    """A turn with the picture and a text. Raises DataError: the picture is missing or damaged."""
    return asked_of(read_picture(sample.picture, side_px, "blank" if shown == "blank" else "real"), text)


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
