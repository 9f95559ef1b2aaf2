"""Driving programs for the steps of an instruction in a town: a learned one as it is, or several put together."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from chauffeur.planners.onboard.exemplars.texts import programs
from chauffeur.planners.onboard.town_steps import LANE_CHANGES, WORDS, TownStep

_STOPS_BEFORE_M: Final = 12.0
_ANNOUNCED_M: Final = 40.0
"""From so far before the place that is said on, the next junction is the one that is meant."""


def program_of(steps: Sequence[TownStep], *, said_again: bool = False) -> str:
    """A learned program as it is, or several steps as one program.

    Args:
        steps: Of the instruction.
        said_again: Whether what follows the first step is said again once that is done, as navigation does.
    """
    first = steps[0].recalled
    if first is not None and all(step.plain for step in steps) and (said_again or len(steps) == 1):
        return first.entry.source
    body: list[str] = []
    for k, step in enumerate(steps):
        if step.place:
            name = re.sub(r"[^\w'. -]", "", step.place)[:40].replace('"', "")
            body += [
                f'    if get_distance_to_place("{name}") < 0:',
                f'        say("I do not find {name} ahead on this way, so I go straight on.")',
                "        yield proceed(check_speed_limit())",
                "        return",
                *_driven_until(f'get_distance_to_place("{name}") < 0'),
            ]
        if step.after_m is not None:
            near = step.after_m - _ANNOUNCED_M if step.turn else step.after_m
            body += [f"    yield from drive_on({near:.0f})"]
        if step.before_junction:
            body += _driven_until(f"get_distance_to_junction() < {_STOPS_BEFORE_M}")
        if step.waits:
            body += [
                '    say("I wait here. Tell me when to go on.")',
                "    while True:",
                "        yield stop()",
            ]
            break
        if step.out:
            body += [
                '    say("I stop here. Please look round before you get out.")',
                "    for _ in range(200):",
                "        yield stop()",
            ]
            break
        if step.recalled is None:
            if step.after_m is None:
                body += ["    while True:", "        yield proceed(check_speed_limit())"]
                break
            continue
        if step.nth > 1:
            body += [
                f"    for _ in range({step.nth - 1}):",
                f'        yield from pass_a_way("{step.turn}")',
            ]
        if step.turn and (k or not step.plain):  # the first junction from there on that leads so
            body += _driven_until(f'can_go("{step.turn}")')
        if step.turn:
            verb = "go_straight" if step.turn == "straight" else f"turn_{step.turn}"
            body += [
                f'    if not can_go("{step.turn}"):',
                f'        say("No way leads {WORDS[step.turn]} at the next junction, so I go straight on.")',
                "        yield proceed(check_speed_limit())",
                "        return",
                f"    {verb}_at_next_intersection()",
                "    yield from cross_the_junction()",
            ]
        else:
            lane = next((name for name in LANE_CHANGES if name in step.calls), "")
            body += [f"    {lane}()"] if lane else []
            body += ["    for _ in range(100):", "        yield proceed(check_speed_limit())"]
    used = {
        "cross_the_junction": any(step.turn for step in steps),
        "pass_a_way": any(step.nth > 1 for step in steps),
        "drive_on": any(step.after_m is not None for step in steps),
    }
    texts = programs("chauffeur.planners.onboard", "town")
    helpers = "".join(f"{texts[name]}\n\n" for name, needed in used.items() if needed)
    return "\n".join([helpers, "def as_told():", *body, ""]).lstrip("\n")


def _driven_until(condition: str) -> list[str]:
    """Lines that drive on until a condition holds."""
    return [
        "    for _ in range(12000):",
        f"        if {condition}:",
        "            break",
        "        yield proceed(check_speed_limit())",
    ]
