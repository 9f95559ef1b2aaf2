"""The on-board planner behind the chat-completions protocol: a conversation in, a reply in the format of any model out.

The last user turn is the wish. Where it is one of our own prompts, C and I are read out of their data blocks, so that
the `openai` planner can use this model over HTTP like any other; any other client may just send the words.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from chauffeur.concept import Context, Instruction, Lead, Limits, Plan, PlanRequest, Program, Situation, SystemMessage
from chauffeur.planners.base import Planner
from chauffeur.programs.library import standalone

_BLOCK: Final = re.compile(r'<data name="(?P<name>[a-z0-9_-]+)">\n(?P<body>.*?)\n</data>', re.DOTALL)
_NUMBER: Final = r"(-?\d+(?:\.\d+)?)"
_SPEED: Final = re.compile(rf"driving at {_NUMBER} m/s")
_LIMIT: Final = re.compile(rf"speed limit of my lane is {_NUMBER} m/s")
_AHEAD: Final = re.compile(rf"car ahead of me in my lane is {_NUMBER} m away and drives at {_NUMBER} m/s")
_LANES: Final = re.compile(r"highway with (\d+) lanes? in my direction, in the (\w+) lane from the right")
_SIGN: Final = re.compile(rf"stop sign stands {_NUMBER} m ahead")
_WAYS: Final = re.compile(r"At the intersection I may ([a-z ,]+);")
_ORDINALS: Final = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")
_TURNS: Final = (("turn left", "left"), ("go straight", "straight"), ("turn right", "right"))


def request_of(messages: Sequence[Mapping[str, Any]], limits: Limits) -> PlanRequest:
    """The request that a conversation makes.

    Args:
        messages: Turns with `role` and `content`, as chat-completions endpoints take them.
        limits: Bounds for what the planner chooses itself.

    Raises:
        ValueError: There is no user turn with text.
    """
    said = (_text(message.get("content")).strip() for message in messages if message.get("role") == "user")
    turns = [text for text in said if text]
    if not turns:
        raise ValueError("The conversation has no user message with text.")
    blocks = _blocks(turns[-1])
    if "instruction" not in blocks and len(turns) > 1:
        # A later round of one of our own conversations: what was said of the program, after the first turn's wish.
        first = _blocks(turns[0])
        if "instruction" in first and "feedback" in blocks:
            blocks = first | {"instruction": f"{first['instruction']}. {blocks['feedback']}"}
    wish = blocks.get("instruction", turns[-1])
    words = blocks.get("context", "")
    return PlanRequest(Instruction(wish), Context(words, situation_of(words)), SystemMessage(""), limits=limits)


async def reply_to(planner: Planner, messages: Sequence[Mapping[str, Any]], limits: Limits) -> tuple[str, Plan]:
    """The text a model would send back, and the plan behind it. Raises ValueError as `request_of`."""
    plan = await planner.plan(request_of(messages, limits))
    if not isinstance(plan.policy, Program):
        return f"REFUSE: {plan.refusal}", plan
    whole = standalone(plan.policy.source, "drive", plan.policy.library)
    return f"{plan.thoughts.text}\n\n```python\n{whole.rstrip()}\n```", plan


def situation_of(words: str) -> Situation:
    """C of our own descriptors read back; what they do not say is taken for a free highway of three lanes at 25 m/s."""
    speed, limit = _SPEED.search(words), _LIMIT.search(words)
    ahead, sign, ways = _AHEAD.search(words), _SIGN.search(words), _WAYS.search(words)
    lanes = _LANES.search(words)
    crossing = "intersection" in words
    count = int(lanes[1]) if lanes else 1 if crossing else 3
    place = _ORDINALS.index(lanes[2]) + 1 if lanes and lanes[2] in _ORDINALS else 1 if crossing else 2
    return Situation(
        world="intersection" if crossing else "highway",
        speed_mps=float(speed[1]) if speed else 25.0,
        speed_limit_mps=float(limit[1]) if limit else 31.3,
        lane_count=count,
        lane_index=max(0, count - place),
        emergency_lane="emergency lane" in words,
        front=Lead(0, float(ahead[1]), float(ahead[2])) if ahead else None,
        stop_sign_m=float(sign[1]) if sign else None,
        turns=tuple(turn for said, turn in _TURNS if ways and said in ways[1]),  # type: ignore[misc]
    )


def _blocks(text: str) -> dict[str, str]:
    return {
        match["name"]: "\n".join(line.removeprefix("|").strip() for line in match["body"].split("\n"))
        for match in _BLOCK.finditer(text)
    }


def _text(content: object) -> str:
    """A message's text; of a list of parts, the text parts."""
    if isinstance(content, str):
        return content
    if isinstance(content, list):
        return "\n".join(str(part.get("text", "")) for part in content if isinstance(part, dict))
    return ""
