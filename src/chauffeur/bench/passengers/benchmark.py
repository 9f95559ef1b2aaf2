"""The wishes as a benchmark: LaMPilot's, over other scenes and words, with the passenger's earlier trips as H."""

from __future__ import annotations

from chauffeur.bench.lampilot.benchmark import LampilotBenchmark
from chauffeur.bench.lampilot.frozen import Frozen, RunConfig
from chauffeur.bench.lampilot.report import PASSENGERS_CARD
from chauffeur.bench.lampilot.requests import PlainRequests
from chauffeur.bench.passengers.loader import as_dataset, load_wishes
from chauffeur.bench.passengers.requests import PassengerRequests
from chauffeur.concept import LAMPILOT_LIMITS
from chauffeur.planners.prompts import Setting


def run_config(planner: str, setting: Setting) -> RunConfig:
    """Settings that decide a run over all wishes. Raises DataError: the wishes are damaged."""
    return RunConfig(planner, setting, as_dataset().sha256, 0, 0, LAMPILOT_LIMITS, asked="passengers")


def requests_of(setting: Setting) -> PassengerRequests:
    """Requests to a planner under a prompt setting."""
    return PassengerRequests(PlainRequests.of(setting, LAMPILOT_LIMITS), load_wishes())


class PassengersBenchmark(LampilotBenchmark):
    """All wishes; an answer is right where it drives, asks back or declines as their card says."""

    card = PASSENGERS_CARD


def passengers(planner: str = "onboard", setting: Setting = "few-shot") -> PassengersBenchmark:
    """The benchmark, as its entry point gives it."""
    frozen = Frozen.of(as_dataset(), run_config(planner, setting), "")
    return PassengersBenchmark(frozen, requests_of(setting))
