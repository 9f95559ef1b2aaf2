"""S: role, rules, driving-API documentation, answer format and examples, rendered from the templates beside it."""

from __future__ import annotations

import tomllib
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
    thoughts = tomllib.loads(template("thoughts.toml"))
    if vocabulary == "town":
        return fill(template("exemplars_town.md"), thoughts["town_steps" if chain_of_thought else "town"])
    # The numbers of the examples keep to the same limits that the model is held to.
    numbers = {
        "headway": f"{max(limits.min_time_headway_s, _CLOSE_HEADWAY_S):g}",
        "over": f"{min(limits.max_over_limit_mps, _OVER_LIMIT_MPS):g}",
    }
    return fill(template("exemplars.md"), {**thoughts["steps" if chain_of_thought else "plain"], **numbers})


def build_system_message(
    setting: Setting = "zero-shot",
    *,
    limits: Limits | None = None,
    chain_of_thought: bool = False,
    vocabulary: Vocabulary = "road",
) -> SystemMessage:
    """S for planners that write programs.

    Args:
        setting: `zero-shot` gives the documentation only, `few-shot` adds three worked examples.
        limits: Bounds the program is held to; the model is told of them. Default: `Limits()`.
        chain_of_thought: Ask for numbered reasoning (situation, wish, risks, plan) before the program.
        vocabulary: Which of the driving APIs there are where the programs are to drive.
    """
    from chauffeur.programs.catalogue import render_docs  # heavy with its package; prompts are imported early

    bounds = limits or Limits()
    text = fill(
        template("rules_town.md" if vocabulary == "town" else "rules.md"),
        {
            "limits": describe_limits(bounds),
            "answer": template("answer_steps.md" if chain_of_thought else "answer_plain.md"),
            "api": render_docs(vocabulary).strip(),
        },
    )
    if setting == "few-shot":
        text = f"{text}\n\n{_exemplars(bounds, chain_of_thought, vocabulary)}"
    return SystemMessage(text=text, setting=setting)
