"""The wishes as a benchmark: LaMPilot's, over other scenes and words, with the passenger's earlier trips as H."""

from __future__ import annotations

from chauffeur.bench.lampilot.benchmark import LampilotBenchmark
from chauffeur.bench.lampilot.report import PASSENGERS_CARD
from chauffeur.bench.lampilot.requests import PlainRequests
from chauffeur.bench.passengers.loader import as_dataset, load_wishes
from chauffeur.bench.passengers.requests import PassengerRequests
from chauffeur.concept import LAMPILOT_LIMITS
from chauffeur.planners.prompts import Setting


class PassengersBenchmark(LampilotBenchmark):
    """All wishes; an answer is right where it drives, asks back or declines as their card says."""

    card = PASSENGERS_CARD


def passengers(planner: str = "onboard", setting: Setting = "few-shot") -> PassengersBenchmark:
    """Make the benchmark over 417 hand-written wishes with the right outcome each: driven, asked back, or refused.

    Args:
        planner: As for `bench lampilot`.
        setting: Prompt for language models.

    Raises:
        DataError: The wishes are damaged.
    """
    requests = PassengerRequests(PlainRequests.of(setting, LAMPILOT_LIMITS), load_wishes())
    return PassengersBenchmark(as_dataset(), requests, planner, setting=setting, seed=0)
