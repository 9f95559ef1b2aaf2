"""S: role, rules, driving-API documentation, answer format and examples, rendered from the templates beside it."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Literal

from chauffeur.concept import Limits, SystemMessage
from chauffeur.concept.units import kmh

if TYPE_CHECKING:
    from chauffeur.programs.catalogue import Vocabulary

Setting = Literal["zero-shot", "few-shot"]

PROMPT_VERSION = "lmp-v1"
"""Version of the templates; stands in every result whose program they brought about."""

_CLOSE_HEADWAY_S = 0.3
"""Headway that lets the autopilot close in to short gaps at motorway speed."""

_OVER_LIMIT_MPS = 5.0

TOWN_PROMPT_VERSION = "lmp-town-v1"
"""Version of the templates for towns."""

_TOWN = {
    "thoughts_start": (
        "Thoughts: We stand behind a car that stands as well. I go at the speed limit, but not before there is room: "
        "what I read now is old in a moment, so the program asks in every step."
    ),
    "thoughts_left": (
        "Thoughts: The next junction is the one with the lights, and a way leads left there. I choose it now; the "
        "autopilot gets into the lane for it and minds the light."
    ),
    "thoughts_right": (
        "Thoughts: The turn is made from the right lane. I move over first, give the car 5 s for it, and choose the "
        "way at the junction then."
    ),
}

_TOWN_STEPS = {
    name: "Thoughts:\n1. Situation: " + situation + "\n2. Wish: " + wish + "\n3. Risks: " + risks + "\n4. Plan: " + plan
    for name, situation, wish, risks, plan in (
        (
            "thoughts_start",
            "standing, a car that stands 11.3 m ahead.",
            "start driving.",
            "running into the car ahead; what is read now is old in the next step.",
            "ask in every step who is ahead; stand while a standing car is within 5 m, else go at the speed limit.",
        ),
        (
            "thoughts_left",
            "7.9 m/s in the right lane of two, a green light 48 m ahead, a way to the left there.",
            "left at the lights, which is the next junction.",
            "being in the wrong lane, and the light turning yellow.",
            "choose left now, so that the autopilot changes lanes in time; slow down for a yellow light.",
        ),
        (
            "thoughts_right",
            "12.1 m/s in the middle lane of three, a way to the right at the next junction.",
            "over to the right lane, then right.",
            "no gap in the right lane, and turning before the lane is changed.",
            "ask for the right lane, give it 5 s, then choose the way to the right.",
        ),
    )
}

_PLAIN = {
    "thoughts_gap": (
        "Thoughts: The passenger wants a gap of 25 m to the car ahead, which is 52 m away. I allow a small headway "
        "and steer the speed by the gap: faster than the lead while it is too large, slower while it is too small."
    ),
    "thoughts_overtake": (
        "Thoughts: The passenger wants to pass the slower car 31.5 m ahead on its left. I wait until the left lane is "
        "safe, move over, and drive up to 5 m/s faster than that car until it is 15 m behind."
    ),
    "thoughts_straight": (
        "Thoughts: The passenger wants to cross straight ahead; there is a stop sign. I choose the route now, let the "
        "autopilot stop at the sign, and go once the crossing traffic on both sides has left room for half a second."
    ),
}

_STEPS = {
    "thoughts_gap": (
        "Thoughts:\n"
        "1. Situation: 29.3 m/s in the right lane of two; one car ahead at 52.0 m, 28.1 m/s.\n"
        "2. Wish: a gap of 25 m to that car, centre to centre.\n"
        "3. Risks: closing in too fast, and no car left to follow. The speed wished above the lead's "
        "shrinks with the remaining gap, and a missing lead ends the program.\n"
        "4. Plan: allow a small headway; each step wish the lead's speed plus a part for the gap error and a part that "
        "grows while the error lasts, within the speed limit; end after 60 s."
    ),
    "thoughts_overtake": (
        "Thoughts:\n"
        "1. Situation: 24.6 m/s in the middle lane of three; a car ahead at 31.5 m with the same speed.\n"
        "2. Wish: pass that car on its left.\n"
        "3. Risks: a car beside or behind in the left lane. I enter only when it is safe and give up after 30 s.\n"
        "4. Plan: wait for a safe left lane, move over, drive up to 5 m/s faster than the car until it is 15 m behind."
    ),
    "thoughts_straight": (
        "Thoughts:\n"
        "1. Situation: 10.0 m/s, single lane, a stop sign and an intersection ahead.\n"
        "2. Wish: cross straight ahead.\n"
        "3. Risks: crossing traffic from both sides. I stop at the sign and go only after half a second of free road.\n"
        "4. Plan: choose the route, wait until the car stands, watch both sides, then leave the stop."
    ),
}


@cache
def template(name: str) -> str:
    """A template's text, without its last line end."""
    return resources.files(__package__ or "").joinpath("templates", name).read_text(encoding="utf-8").rstrip("\n")


def fill(text: str, values: dict[str, str]) -> str:
    """A template with its `{names}` replaced."""
    # Plain replacement: programs and documentation hold braces that str.format would trip over.
    for name, value in values.items():
        text = text.replace("{" + name + "}", value)
    return text


def describe_limits(limits: Limits) -> str:
    """The limits a program is held to, in words."""
    lines = [
        f"- Speed: at most {limits.max_over_limit_mps:g} m/s above the lane's speed limit.",
        f"- Time headway: {limits.min_time_headway_s:g} s to {limits.max_time_headway_s:g} s.",
    ]
    if limits.max_speed_mps is not None:
        cap_kmh = kmh(limits.max_speed_mps)
        lines.append(f"- Never faster than {limits.max_speed_mps:g} m/s ({cap_kmh:.0f} km/h), whatever the sign says.")
    return "\n".join(lines)


def _exemplars(limits: Limits, chain_of_thought: bool, vocabulary: Vocabulary) -> str:
    if vocabulary == "town":
        return fill(template("exemplars_town.md"), _TOWN_STEPS if chain_of_thought else _TOWN)
    # The numbers of the examples keep to the same limits that the model is held to.
    numbers = {
        "headway": f"{max(limits.min_time_headway_s, _CLOSE_HEADWAY_S):g}",
        "over": f"{min(limits.max_over_limit_mps, _OVER_LIMIT_MPS):g}",
    }
    return fill(template("exemplars.md"), {**(_STEPS if chain_of_thought else _PLAIN), **numbers})


def build_system_message(
    setting: Setting = "zero-shot",
    *,
    limits: Limits | None = None,
    chain_of_thought: bool = False,
    api_docs: str | None = None,
    vocabulary: Vocabulary = "road",
) -> SystemMessage:
    """S for planners that write programs.

    Args:
        setting: `zero-shot` gives the documentation only, `few-shot` adds three worked examples.
        limits: Bounds the program is held to; the model is told of them. Default: `Limits()`.
        chain_of_thought: Ask for numbered reasoning (situation, wish, risks, plan) before the program.
        api_docs: Driving-API documentation; default is the catalogue that also gates and runs programs.
        vocabulary: Which of the driving APIs there are where the programs are to drive.
    """
    if api_docs is None:
        from chauffeur.programs.catalogue import render_docs

        api_docs = render_docs(vocabulary)
    bounds = limits or Limits()
    text = fill(
        template("rules_town.md" if vocabulary == "town" else "rules.md"),
        {
            "limits": describe_limits(bounds),
            "answer": template("answer_steps.md" if chain_of_thought else "answer_plain.md"),
            "api": api_docs.strip(),
        },
    )
    if setting == "few-shot":
        text = f"{text}\n\n{_exemplars(bounds, chain_of_thought, vocabulary)}"
    return SystemMessage(text=text, setting=setting)
