"""S for planners that write action matrices (paper Sec. VI-B2), and examples of it (few-shot)."""

from __future__ import annotations

from typing import Final

from chauffeur.concept import ActionMatrix, PlanRequest
from chauffeur.planners.prompts.blocks import CONTEXT_CHARS, INSTRUCTION_CHARS, data_block
from chauffeur.planners.prompts.system import fill, template
from chauffeur.planners.prompts.turns import MAX_ROUNDS, Message, repair_turns, wish_turn, with_pictures
from chauffeur.safety.gain_box import GAIN_NAMES, gain_box

ASK: Final = "Give thoughts and the action matrix for the instruction above, in the answer format."

MODERATE = ActionMatrix((0.35, 0.02, 0.06), (8.0, 20.0, 150.0))
"""Fixed gains for general safety and comfort: the baseline of the paper's Tab. XI."""

_EXAMPLES = (
    (
        "Take it easy, my mother feels dizzy.",
        "Clear sky, sunny, dry road.",
        "Thoughts: A dizzy passenger needs gentle changes of speed and soft steering; the road is dry, so nothing else "
        "asks for care. I choose low gains and a high steering weight.",
        (0.18, 0.008, 0.15),
        (4.0, 12.0, 300.0),
    ),
    (
        "My train leaves in ten minutes, step on it!",
        "Clear sky, sunny, dry road.",
        "Thoughts: The passenger is in a hurry and the road is dry. I choose high gains and let the steering follow "
        "the path tightly, within the certified ranges.",
        (0.7, 0.04, 0.03),
        (16.0, 40.0, 95.0),
    ),
    (
        "My train leaves in ten minutes, step on it!",
        "Heavy snow, the road is white.",
        "Thoughts: The passenger is in a hurry, but the road is slippery: I am quicker than usual for snow and still "
        "more careful than on a dry road.",
        (0.42, 0.025, 0.06),
        (11.0, 25.0, 120.0),
    ),
)


def matrix_words(policy: ActionMatrix) -> str:
    """[[Kp, Ki, Kd], [Wl, Wh, Ws]] as JSON."""
    rows = (", ".join(f"{value:g}" for value in row) for row in (policy.pid, policy.mpc))
    return "[" + ", ".join(f"[{row}]" for row in rows) + "]"


def motion_messages(request: PlanRequest) -> list[Message]:
    """The conversation that asks for an action matrix: three examples, then V, and C, H and I as quoted data."""
    box = gain_box()
    ranges = "\n".join(f"- {name}: {box.low[name]:g} to {box.high[name]:g}" for name in GAIN_NAMES)
    system = fill(template("motion.md"), {"ranges": ranges, "default": matrix_words(MODERATE)})
    messages: list[Message] = [{"role": "system", "content": system}]
    for words, sky, thoughts, pid, mpc in _EXAMPLES:
        asked = [data_block("context", sky, CONTEXT_CHARS), data_block("instruction", words, INSTRUCTION_CHARS), ASK]
        inside = box.clamped(ActionMatrix(pid, mpc))
        messages.append({"role": "user", "content": "\n\n".join(asked)})
        messages.append({"role": "assistant", "content": f"{thoughts}\nP = {matrix_words(inside)}"})
    messages.append({"role": "user", "content": with_pictures(wish_turn(request, ask=ASK), request.images)})
    for earlier in request.rounds[-MAX_ROUNDS:]:
        messages += repair_turns(earlier.plan_text, [earlier.feedback], ask=ASK)
    return messages
