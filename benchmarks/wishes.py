"""What becomes of passengers' wishes: right at once, after one yes, asked in vain, declined, driven wrongly, opposite.

    python benchmarks/wishes.py [--planner meaning] [--wishes FILE]

`FILE` is in the form of `data/passengers/wishes.jsonl` (docs/passengers.md), the default. A planner that is not sure of
a reading says it back as a question ("Shall I drive slower?"); each is answered with yes, as a person would whose wish
it names, and a drive that then misses the wish counts as asked in vain. `opposite` is a wrong drive to the other side,
or with the other sign, by the plan's own tags. Wishes noted `pair N do` and `pair N dont`, or `chat N plain` and `chat
N chat`, are counted as pairs as well: both are to be right. Judged like `chauffeur bench passengers`; but a `dont` that
asks for nothing else is right, too, where a drive does not do what its `do` asks for ("don't overtake": it follows).
"""

from __future__ import annotations

import argparse
import asyncio
from collections import Counter, defaultdict
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.lampilot.requests import PlainRequests
from chauffeur.bench.lampilot.rollout import RolloutJob, plan_adapter, roll_out
from chauffeur.bench.passengers import PassengerRequests
from chauffeur.bench.passengers.loader import PassengerWish, load_wishes, parse_wishes
from chauffeur.concept import LAMPILOT_LIMITS, Context, Plan
from chauffeur.describe import describe
from chauffeur.driving.episode import make_world
from chauffeur.driving.judge.goals import answered_rightly
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.highway.dblv1 import Item

_OTHER: Final = {"left": "right", "right": "left"}
_LESS: Final = ("speed.decrease", "style.relax", "style.careful", "style.comfort")
_MORE: Final = ("speed.increase", "style.hurry", "style.sporty")
_SIGNS: Final = {"faster": 1, "hurry": 1, "slower": -1, "relax": -1}
_GAPS: Final = {"closer": "gap.increase", "wider": "gap.decrease", "room": "gap.decrease"}
_PAIRED: Final = ("pair", "chat")


def is_opposite(wish: PassengerWish, plan: Plan, now_mps: float) -> bool:
    """Whether a plan goes to the other side, or has the other sign, than the wish."""
    family, _, side = wish.kind.partition("_")
    tags = plan.intent.split("+")
    if side in _OTHER:
        return any(tag.endswith(_OTHER[side]) for tag in tags) and not any(tag.endswith(side) for tag in tags)
    if (sign := _SIGNS.get(family, 0)) != 0:
        target = dict(plan.settings).get("target_speed_mps", now_mps)
        turned = _LESS if sign > 0 else _MORE
        return any(tag in turned for tag in tags) or sign * (target - now_mps) < -0.5
    return _GAPS.get(family) in tags


class Judged:
    """Asks a planner, drives what it plans, and says what became of each wish."""

    def __init__(self, planner: Planner, wishes: tuple[PassengerWish, ...]) -> None:
        self._planner = planner
        self._requests = PassengerRequests(PlainRequests.of("few-shot", LAMPILOT_LIMITS), wishes)
        self._contexts: dict[str, Context] = {}
        self._denied = {wish.note.removesuffix("do") + "dont": wish for wish in wishes if wish.note.endswith(" do")}

    def outcome(self, wish: PassengerWish) -> str:
        """What became of a wish."""
        if wish.scenario not in self._contexts:
            self._contexts[wish.scenario] = describe(make_world(wish.scene).reset(wish.scene))
        context = self._contexts[wish.scenario]
        request = asyncio.run(self._requests.request(Item(wish.id, wish.task, wish.wish, wish.scene), context))
        plan = asyncio.run(self._planner.plan(request))
        if self._right(wish, plan):
            return "right"
        if plan.policy is None and plan.offer:
            said = replace(request.instruction, text=plan.offer, confirmed=plan.refusal)
            plan = asyncio.run(self._planner.plan(replace(request, instruction=said)))
            return "after a yes" if self._right(wish, plan) else "asked in vain"
        if plan.policy is None:
            return "declined"
        return "opposite" if is_opposite(wish, plan, context.situation.speed_mps) else "driven wrongly"

    def _right(self, wish: PassengerWish, plan: Plan) -> bool:
        stored: dict[str, Any] = plan_adapter.dump_python(plan_adapter.validate_python(asdict(plan)), mode="json")
        if wish.right == "refuse" and plan.policy is not None and (denied := self._denied.get(wish.note)) is not None:
            scene = replace(wish.scene, goal=denied.scene.goal)
            return not bool(roll_out(RolloutJob(wish.id, scene, "", stored, LAMPILOT_LIMITS))["success"])
        row = roll_out(RolloutJob(wish.id, wish.scene, "", stored, LAMPILOT_LIMITS))
        return answered_rightly(wish.scene.goal, refused=bool(row["refused"]), success=bool(row["success"]))


def main() -> None:
    """Ask, answer, drive, and print a few lines."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--planner", default="onboard")
    parser.add_argument("--wishes", type=Path, default=None)
    options = parser.parse_args()
    wishes = load_wishes() if options.wishes is None else parse_wishes(options.wishes.read_bytes())
    judged = Judged(make_planner(options.planner), wishes)
    counts: Counter[tuple[str, str]] = Counter()
    pairs: dict[tuple[str, str], list[str]] = defaultdict(list)
    for wish in wishes:
        became = judged.outcome(wish)
        counts[wish.right, became] += 1
        kind, _, rest = wish.note.partition(" ")
        if kind in _PAIRED and len(rest.split()) == 2:
            pairs[kind, rest.split()[0]].append(became)
    for right in ("drive", "ask", "refuse"):
        parts = [f"{became} {count}" for (of, became), count in sorted(counts.items()) if of == right]
        print(f"{options.planner}, to {right}: {', '.join(parts)}")
    for kind in _PAIRED:
        found = [became for (of, _), became in pairs.items() if of == kind]
        if found:
            print(f"{kind}: both right in {sum(set(one) == {'right'} for one in found)} of {len(found)}")


if __name__ == "__main__":
    main()
