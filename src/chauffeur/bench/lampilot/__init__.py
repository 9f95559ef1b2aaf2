"""LaMPilot-Bench: instruction following on highway and intersection (paper Sec. IV-A)."""

from chauffeur.bench.lampilot.benchmark import LampilotBenchmark
from chauffeur.bench.lampilot.referee import LampilotReferee
from chauffeur.bench.lampilot.runner import LampilotRun, RunConfig, lampilot

__all__ = ["LampilotBenchmark", "LampilotReferee", "LampilotRun", "RunConfig", "lampilot"]
