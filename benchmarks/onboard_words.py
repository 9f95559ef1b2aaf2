"""The on-board language model on the generated test splits: phrasings that training knew, and phrasings it never saw.

    python benchmarks/onboard_words.py --run runs/onboard [--model FOLDER] [--most 1200] [--ablations]

A wish is right when what the model wrote, linked and driven in the wish's own scene, did what was wished; a question or
a refusal when it was asked back or refused. `exact` counts programs equal to the wished one, `asked` wishes that were
asked back although they were plain, `else` those for which something else was driven, or refused.
Latency and memory are those of this process on one thread.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from chauffeur.concept import (
    LAMPILOT_LIMITS,
    Limits,
    Observation,
    Plan,
    Program,
    ProgramError,
    Scenario,
    Situation,
    Thoughts,
)
from chauffeur.describe import describe
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import check_drive
from chauffeur.models.onboard.cases import Case, case_of
from chauffeur.models.onboard.examples import Example
from chauffeur.models.onboard.pipeline import examples_of
from chauffeur.models.onboard.skill_judge import judge
from chauffeur.planners.onboard.engine import Engine
from chauffeur.planners.onboard.language_model import SHIPPED
from chauffeur.planners.onboard.link import link
from chauffeur.planners.onboard.options import Declined
from chauffeur.planners.onboard.personal import Leaning
from chauffeur.planners.onboard.prompt import HISTORY, WISH
from chauffeur.planners.onboard.reply import OnboardReply, read_reply
from chauffeur.programs import UNHURRIED, Sandbox
from chauffeur.worlds.highway import HighwayWorld


@dataclass(frozen=True)
class Way:
    """How the model is asked."""

    name: str = "as shipped"
    history: bool = True
    constrained: bool = True


WAYS = (
    Way(),
    Way("without history", history=False),
    Way("without the grammar", constrained=False),
)


def ask(engine: Engine, example: Example, way: Way) -> tuple[OnboardReply | None, float]:
    """The network's reply, before it is held against the acts, and the seconds it took; None when it cannot be read."""
    begun = time.perf_counter()
    text = example.prompt
    if not way.history:
        text = re.sub(rf"{re.escape(HISTORY)}.*?{re.escape(WISH)}", HISTORY + WISH, text, flags=re.DOTALL)
    try:
        reply = read_reply(engine.write(text, constrained=way.constrained).text)
    except ProgramError:
        return None, time.perf_counter() - begun
    return reply, time.perf_counter() - begun


@cache
def _tools() -> tuple[HighwayWorld, Sandbox]:
    return HighwayWorld(), Sandbox(UNHURRIED)


def driven(job: tuple[Case, Example, OnboardReply]) -> bool:
    """Whether a program that is not the wished one does what was wished all the same."""
    case, example, reply = job
    wanted = read_reply(example.reply)
    linked = link(reply.steps, case.situation, LAMPILOT_LIMITS, lambda _: Leaning())
    if isinstance(linked, Declined):
        return not wanted.steps
    if not wanted.steps:
        return False
    world, sandbox = _tools()
    return judge(world, Scenario(**case.scenario), wanted.steps, reply.source, linked, sandbox).done


@cache
def _road() -> tuple[Observation, Situation]:
    """An ordinary road with somebody ahead, for wishes that have no scene of their own."""
    scenario = find("overtake")
    observation = HighwayWorld().reset(scenario, scenario.seed)
    return observation, describe(observation).situation


def refused_after_all(reply: OnboardReply) -> bool:
    """Whether a program goes nowhere: not the model is to refuse 3 m or 300 km/h, but linking or the checks of a drive.

    They are asked with what the planner says of the program and under the limits that hold for anybody.
    """
    observation, situation = _road()
    limits, leaning = Limits(), Leaning()
    linked = link(reply.steps, situation, limits, lambda _: leaning)
    if isinstance(linked, Declined):
        return True
    settings = linked.choice.settings([leaning] * len(reply.steps))
    program = Program(reply.source, library=linked.library)
    plan = Plan(Thoughts(""), program, intent=linked.choice.intent, settings=settings)
    return any(verdict.stops for verdict in check_drive(plan, observation, limits))


def outcomes(
    engine: Engine, examples: list[Example], cases: dict[int, Case], way: Way
) -> tuple[Counter[str], list[Any]]:
    counts: Counter[str] = Counter()
    times: list[float] = []
    open_: list[tuple[Case, Example, OnboardReply]] = []
    for example in examples:
        reply, took = ask(engine, example, way)
        times.append(took)
        wanted = read_reply(example.reply)
        if reply is None:
            counts["unreadable"] += 1
        elif wanted.steps and reply.steps == wanted.steps:
            counts["exact"] += 1
        elif reply.question or reply.refusal:
            same = bool(reply.question) == bool(wanted.question) if not wanted.steps else False
            counts["right answer" if same else "asked" if reply.question and wanted.steps else "else"] += 1
        elif example.case < 0:
            counts["right answer" if wanted.refusal and refused_after_all(reply) else "else"] += 1
        else:
            open_.append((cases[example.case], example, reply))
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        for done in pool.map(driven, open_, chunksize=8):
            counts["done otherwise" if done else "else"] += 1
    return counts, times


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=Path, required=True, help="Folder of `chauffeur model train onboard`.")
    parser.add_argument("--model", type=Path, default=SHIPPED)
    parser.add_argument("--most", type=int, default=1200, help="Examples of each split.")
    parser.add_argument("--ablations", action="store_true")
    arguments = parser.parse_args()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    engine = Engine(arguments.model)
    shipped: list[float] = []
    rows = (json.loads(line) for line in (arguments.run / "cases.jsonl").read_text().splitlines())
    cases = {row["index"]: case_of(row) for row in rows if "left_out" not in row}
    print("| asked | split | examples | right | exact | done otherwise | right answer | asked | else | unreadable |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|---:|")
    for way in WAYS if arguments.ablations else WAYS[:1]:
        for split in ("seen", "unseen"):
            examples = examples_of(arguments.run / "data" / f"{split}.jsonl")[: arguments.most]
            counts, times = outcomes(engine, examples, cases, way)
            share = partial(_share, len(examples))
            right = counts["exact"] + counts["done otherwise"] + counts["right answer"]
            names = ("exact", "done otherwise", "right answer", "asked", "else", "unreadable")
            cells = " | ".join(share(counts[name]) for name in names)
            print(f"| {way.name} | {split} | {len(examples)} | **{share(right)}** | {cells} |", flush=True)
            if way == WAYS[0]:
                shipped += times
    shipped.sort()
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    median, most = shipped[len(shipped) // 2], shipped[int(0.95 * len(shipped))]
    print(
        f"\nWish to reply: median {median * 1e3:.1f} ms, 95 % {most * 1e3:.1f} ms, longest {shipped[-1] * 1e3:.1f} ms. "
        f"Peak memory {after / 1024:.0f} MiB, of which {before / 1024:.0f} MiB before the model was loaded."
    )


def _share(of: int, count: int) -> str:
    return f"{100 * count / max(1, of):.1f} %"


if __name__ == "__main__":
    main()
