"""What is driven of commands in German, Spanish, French and Chinese: planned where the act can be driven, as far as V.

    python benchmarks/languages.py [--planner onboard] [--each] [FILE ...]

A command is right if the plan is the act of its label (whether the checks then let it through is another matter), asked
if nothing is planned and the person is told that English is needed, asked back or declined, wrong if another act is
planned, opposite if it is the other side or the other way. A call for help is right if the car's own emergency answer
comes, and a sentence that asks for nothing, or for nothing now (`none`), if nothing is planned.
"""

from __future__ import annotations

import argparse
import asyncio
from collections import Counter
from pathlib import Path

from chauffeur.concept import NOBODY, Limits, Plan
from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.driving.emergency import EMERGENCY_PLANNER
from chauffeur.driving.scenarios import find, planner_for
from chauffeur.driving.session import Session, parse_wish
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner

DATA = Path(__file__).parents[1] / "tests" / "language"
FILES = (DATA / "languages_dev.tsv", DATA / "languages_heldout.tsv")
OUTCOMES = ("right", "asked", "wrong", "opposite")
PLACES = {
    "turn.left": "intersection",
    "turn.right": "intersection",
    "lane.right": "left-lane",
    "gap": "following",
    "follow": "following",
    "pull_over": "emergency-lane",
    "park": "parking",
    "speed": "cruise",
}
"""Scenarios that carry an act; the others are planned on the highway with a vehicle to overtake."""
OPPOSITE = {"left": "right", "right": "left", "slower": "faster", "faster": "slower"}
INTENTS = {
    "stop": ("stop",),
    "slower": ("speed.decrease",),
    "faster": ("speed.increase",),
    "turn.left": ("turn.left",),
    "turn.right": ("turn.right",),
    "lane.left": ("lane.left",),
    "lane.right": ("lane.right",),
    "overtake": ("overtake.left", "overtake.right", "overtake"),
    "gap": ("gap.increase",),
    "pull_over": ("pull_over",),
    "park": ("park",),
    "follow": ("follow",),
    "speed": ("speed.set",),
}


def outcome_of(label: str, plan: Plan) -> str:
    """One of `OUTCOMES`, by what the plan drives or, where the checks or the planner declined it, what it was."""
    act, _, value = label.partition(":")
    own = plan.planner == EMERGENCY_PLANNER
    asked = plan.intent in ("", "ask", "refuse", "answer", "none", "declined", "refused")
    if act == "help":
        return "right" if own else "asked" if asked else "wrong"
    if asked or act == "none":
        return "asked" if asked and act != "none" else "right" if asked else "wrong"
    if plan.intent in INTENTS[act]:
        speed = dict(plan.settings).get("target_speed_mps")
        said = f"{value} km/h" in f"{plan.refusal} {plan.thoughts.text}"
        wrong = value and not said and (speed is None or abs(speed - float(value) * MPS_PER_KMH) > 0.1)
        return "wrong" if wrong else "right"
    side = act.rpartition(".")[2]
    return "opposite" if plan.intent in INTENTS.get(act.replace(side, OPPOSITE.get(side, "-")), ()) else "wrong"


def main() -> None:
    """Plan every command and print a table, one line a file and language."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--planner", default="", help="default: the on-board planner of each world")
    parser.add_argument("--each", action="store_true", help="print every command that is not right")
    parser.add_argument("files", nargs="*", type=Path, default=FILES)
    args = parser.parse_args()
    planners: dict[str, Planner] = {}
    print("| file | language | commands | right | asked | wrong | opposite |\n|---|---|---:|---:|---:|---:|---:|")
    for file in args.files:
        found: dict[str, Counter[str]] = {}
        for line in file.read_text(encoding="utf-8").splitlines():
            if line.startswith("#"):
                continue
            language, label, text = line.split("\t")
            place = find(PLACES.get(label.partition(":")[0], "overtake"))
            spec = planner_for(args.planner, place)
            planner = planners.setdefault(spec, make_planner(spec))
            session = Session(planner=planner, max_s=0.1)
            trip = asyncio.run(session.drive(parse_wish(text, NOBODY), place, place.seed, Limits())).trip
            outcome = outcome_of(label, trip.plan)
            found.setdefault(language, Counter())[outcome] += 1
            if args.each and outcome != "right":
                print(outcome, language, label, text, trip.plan.intent, trip.plan.thoughts.text[:80], sep=" | ")
        for language, counts in found.items():
            cells = " | ".join(str(counts[one]) for one in OUTCOMES)
            print(f"| {file.stem} | {language} | {counts.total()} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
