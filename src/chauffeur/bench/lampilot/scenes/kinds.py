"""Plan of a suite: kinds of scenes, how many of each, and which split each item belongs to (paper Tab. III)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from chauffeur.bench.lampilot.scenes import beyond
from chauffeur.bench.lampilot.scenes import sampling as roads
from chauffeur.bench.lampilot.scenes import wish_sampler as wishes
from chauffeur.concept import ConfigError

Split = Literal["train", "val", "test", "extras"]

PAPER_ITEMS = 4900
PAPER_FAMILIES = {
    "distance": 1200,
    "speed": 1200,
    "pull over": 200,
    "routing": 1500,
    "lane change": 400,
    "overtake": 400,
}
"""Items per family in Tab. III."""
PAPER_ROADS = {"highway": 3400, "intersection": 1500}
PAPER_WORDS = (2, 7.6, 14)
"""Least, mean and greatest instruction length in words, Tab. III."""
PAPER_HELD_OUT = {"val": 500, "test": 500}
"""Of 4,900: Sec. IV-A names 500 for testing; as many are kept for validation."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of scene.

    Attributes:
        name: Also the beginning of its task files, by which families are told.
        family: Family of Tab. III, or the part of the extras.
        words: Mean instruction length wished, from LaMPilot's development items of the same kind.
        road: Draws its road and traffic: a DbLv1 `env` mapping.
        wish: Draws a wish that fits the first instant of such a road, or says why none does.
    """

    name: str
    family: str
    words: float
    road: Callable[[np.random.Generator], roads.Env]
    wish: wishes.Drawer


MAIN: tuple[Kind, ...] = (
    Kind("dec_abs_dis", "distance", 6.6, roads.dense, wishes.distance_wish),
    Kind("inc_abs_dis", "distance", 6.6, roads.near_lead, wishes.distance_wish),
    Kind("dec_rel_dis", "distance", 7.0, roads.dense, wishes.distance_wish),
    Kind("inc_rel_dis", "distance", 6.9, roads.near_lead, wishes.distance_wish),
    Kind("dec_abs_speed", "speed", 8.4, roads.cruising, wishes.speed_wish),
    Kind("inc_abs_speed", "speed", 8.7, roads.cruising, wishes.speed_wish),
    Kind("dec_rel_speed", "speed", 8.2, roads.cruising, wishes.speed_wish),
    Kind("inc_rel_speed", "speed", 8.2, roads.cruising, wishes.speed_wish),
    Kind("left_lc", "lane change", 4.8, roads.right_lane, wishes.lane_wish),
    Kind("right_lc", "lane change", 4.8, roads.left_lane, wishes.lane_wish),
    Kind("left_overtake", "overtake", 9.4, roads.right_lane_behind_lead, wishes.overtake_wish),
    Kind("right_overtake", "overtake", 9.9, roads.left_lane_behind_lead, wishes.overtake_wish),
    Kind("pull_over", "pull over", 12.2, roads.shoulder, wishes.pull_over_wish),
    Kind("go_straight", "routing", 7.4, roads.crossing, wishes.route_wish),
    Kind("turn_left", "routing", 7.2, roads.crossing, wishes.route_wish),
    Kind("turn_right", "routing", 7.0, roads.crossing, wishes.route_wish),
)

EXTRA_SHARES: Mapping[str, int] = {"directness": 6, "steps": 4, "refusals": 5, "units": 5}
"""Shares of the parts among the extras."""

_BEHAVIOURS = {
    "faster": roads.dense,
    "slower": roads.cruising,
    "wider": roads.dense,
    "overtake": roads.dense,
    "pull_over": roads.shoulder,
}
_UNITS = {"distance": ("ft", "yd", "len"), "speed": ("kmh", "mph")}

EXTRAS: Mapping[str, tuple[Kind, ...]] = {
    # Levels and behaviours turn at different rates, so that a few items show some of each.
    "directness": tuple(
        Kind(f"hint{1 + i % 3}_{name}", "directness", 8.0, road, beyond.hint_wish)
        for i, (name, road) in enumerate(3 * tuple(_BEHAVIOURS.items()))
    ),
    "steps": (
        Kind("steps_overtake_pull_over", "steps", 10.0, roads.shoulder_behind_traffic, beyond.steps_wish),
        Kind("steps_overtake_return", "steps", 11.0, roads.dense, beyond.steps_wish),
        Kind("steps_lane_speed", "steps", 12.0, roads.right_lane, beyond.steps_wish),
        Kind("steps_speed_lane", "steps", 12.0, roads.right_lane, beyond.steps_wish),
        Kind("steps_gap_overtake", "steps", 12.0, roads.dense, beyond.steps_wish),
        Kind("steps_speed_turn", "steps", 12.0, roads.crossing, beyond.steps_wish),
        Kind("steps_overtake_return_speed", "steps", 15.0, roads.dense, beyond.steps_wish),
    ),
    "refusals": (
        Kind("refuse_no_lane", "refusals", 5.5, roads.edge_lane, beyond.refuse_no_lane),
        Kind("refuse_no_lead", "refusals", 8.0, roads.cruising, beyond.refuse_no_lead),
        Kind("refuse_no_gap", "refusals", 7.5, roads.cruising, beyond.refuse_no_gap),
        Kind("refuse_no_shoulder", "refusals", 11.0, roads.dense, beyond.refuse_no_shoulder),
        Kind("refuse_no_junction", "refusals", 7.5, roads.dense, beyond.refuse_no_junction),
        Kind("refuse_speed", "refusals", 7.5, roads.cruising, beyond.refuse_speed),
        Kind("refuse_gap", "refusals", 7.0, roads.dense, beyond.refuse_gap),
        Kind("refuse_sign", "refusals", 7.5, roads.crossing, beyond.declined("The stop sign must be obeyed.")),
        Kind("refuse_danger", "refusals", 7.5, roads.any_road, beyond.refuse_danger),
        Kind(
            "ask_side",
            "refusals",
            5.0,
            roads.middle_lane,
            beyond.declined("Both sides have a lane, and none was named.", "ask"),
        ),
        Kind("ask_amount", "refusals", 5.0, roads.cruising, beyond.ask_amount),
    ),
    "units": tuple(
        replace(kind, name=f"{kind.name}_{units[turn]}", family="units")
        for turn in range(3)
        for kind in MAIN[:8]
        if turn < len(units := _UNITS[kind.family])
    ),
}
KINDS: Mapping[str, Kind] = {kind.name: kind for kind in (*MAIN, *(k for part in EXTRAS.values() for k in part))}


@dataclass(frozen=True, slots=True)
class Slot:
    """One item to be made.

    Attributes:
        index: Its place in the suite; with the suite's seed it decides everything random about the item.
        kind: Name of its kind.
        split: Where it goes; `extras` for what is beyond the original.
        part: Part of the extras, empty in the main suite.
        held: Whether it is worded with templates that only the test split uses.
    """

    index: int
    kind: str
    split: Split
    part: str = ""
    held: bool = False


EXTRA_BASE = 1_000_000_000
"""Index of the first extra, so that the number of main items does not change what the extras are."""


def plan_suite(n: int, seed: int, extras: int) -> tuple[Slot, ...]:
    """All items of a suite, kinds in order; the same for the same arguments.

    Args:
        n: Items of the main suite; families, roads and splits keep Tab. III's proportions (largest remainder).
        seed: Decides which items go where.
        extras: Items beyond the original.

    Raises:
        ConfigError: Fewer than 1 item, or a negative number of extras.
    """
    if n < 1 or extras < 0:
        raise ConfigError(f"A suite needs at least 1 item and no negative extras, not {n} and {extras}.")
    families = dict(zip(PAPER_FAMILIES, apportion(n, list(PAPER_FAMILIES.values())), strict=True))
    counts: list[int] = []
    for family, total in families.items():
        held = [kind for kind in MAIN if kind.family == family]
        counts += apportion(total, [1] * len(held))
    # in the order of MAIN, whatever the order of the families
    by_family = [kind.name for family in families for kind in MAIN if kind.family == family]
    of_kind = dict(zip(by_family, counts, strict=True))
    per_kind = [of_kind[kind.name] for kind in MAIN]
    test = apportion(round(n * PAPER_HELD_OUT["test"] / PAPER_ITEMS), per_kind)
    left = [count - taken for count, taken in zip(per_kind, test, strict=True)]
    val = apportion(round(n * PAPER_HELD_OUT["val"] / PAPER_ITEMS), left)
    rng = np.random.default_rng(np.random.SeedSequence([seed, 2**32]))
    slots: list[Slot] = []
    for kind, count, for_val, for_test in zip(MAIN, per_kind, val, test, strict=True):
        order = rng.permutation(count)
        split_at: dict[int, tuple[Split, bool]] = {}
        for place, which in enumerate(order.tolist()):
            if place < for_test:
                split_at[which] = "test", place % 2 == 0
            else:
                split_at[which] = ("val" if place < for_test + for_val else "train"), False
        slots += [Slot(len(slots) + i, kind.name, *_split(split_at[i])) for i in range(count)]
    return (*slots, *_plan_extras(extras))


def _split(placed: tuple[Split, bool]) -> tuple[Split, str, bool]:
    return placed[0], "", placed[1]


def _plan_extras(extras: int) -> list[Slot]:
    slots: list[Slot] = []
    for part, total in zip(EXTRA_SHARES, apportion(extras, list(EXTRA_SHARES.values())), strict=True):
        kinds = EXTRAS[part]
        for kind, count in zip(kinds, apportion(total, [1] * len(kinds)), strict=True):
            slots += [Slot(EXTRA_BASE + len(slots) + i, kind.name, "extras", part) for i in range(count)]
    return slots


def apportion(total: int, weights: Sequence[int]) -> list[int]:
    """`total` divided in proportion to the weights, whole numbers, by largest remainder (the first of equals)."""
    whole = sum(weights)
    if whole == 0:
        return [0] * len(weights)
    shares = [total * weight / whole for weight in weights]
    out = [int(share) for share in shares]
    by_remainder = sorted(range(len(weights)), key=lambda i: (out[i] - shares[i], i))
    for i in by_remainder[: total - sum(out)]:
        out[i] += 1
    return out
