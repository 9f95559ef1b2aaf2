"""How many of the passengers' wishes are right at once, and how many more after one yes to the car's question.

    python benchmarks/passengers_answered.py [--planner retrieval]

A planner that is not sure of a reading says it back as a question ("Shall I drive slower?"), and drives after a yes.
Here every such question is answered with yes, as a person would whose wish it names; a drive that then misses the wish
counts as wrong, as it does without a question. Judged like `chauffeur bench passengers`, over the wishes to be driven.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

from chauffeur.bench.lampilot.requests import PlainRequests
from chauffeur.bench.lampilot.runner import Effort, LampilotRun, RunConfig
from chauffeur.bench.passengers import PassengerRequests, as_dataset, load_wishes
from chauffeur.concept import LAMPILOT_LIMITS, Plan, PlanRequest
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner


class Answered:
    """A planner whose offers are taken, once a wish."""

    def __init__(self, planner: Planner) -> None:
        """Wrap a planner."""
        self._planner = planner
        self.offers: list[str] = []

    @property
    def id(self) -> str:
        """The planner's own."""
        return self._planner.id

    @property
    def model(self) -> str:
        """The planner's own."""
        return self._planner.model

    async def plan(self, request: PlanRequest) -> Plan:
        """The plan, or the one after a yes."""
        first = await self._planner.plan(request)
        if not first.offer:
            return first
        self.offers.append(request.instruction.text)
        said = replace(request.instruction, text=first.offer, confirmed=first.refusal)
        return await self._planner.plan(replace(request, instruction=said))


def main() -> None:
    """Ask, answer, drive, and print one line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--planner", default="onboard", help="onboard or retrieval")
    name = parser.parse_args().planner
    data, wishes = as_dataset(), load_wishes()
    requests = PassengerRequests(PlainRequests.of("few-shot", LAMPILOT_LIMITS), wishes)
    planner = Answered(make_planner(name))
    with tempfile.TemporaryDirectory(prefix="chauffeur-passengers-") as folder:
        config = RunConfig(name, "few-shot", data.sha256, items=0, seed=0, asked="passengers")
        run = LampilotRun(Path(folder) / "run", data, config, planner, requests=requests)
        rows = [row for row in run.run(lambda _: None, Effort(workers=1)) if not row["to_refuse"]]
    asked = set(planner.offers)
    right = {True: 0, False: 0}
    for row in rows:
        right[row["command"] in asked] += row["answered_rightly"]
    count = sum(row["command"] in asked for row in rows)
    print(f"{name}, {len(rows)} wishes to be driven: {right[False]} right at once, {count} offered as a question,")
    print(f"{right[True]} of these right after a yes: {sum(right.values())} of {len(rows)}")


if __name__ == "__main__":
    main()
