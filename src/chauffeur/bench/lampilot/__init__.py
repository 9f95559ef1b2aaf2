"""LaMPilot-Bench: instruction following on highway and intersection (paper Sec. IV-A)."""

from chauffeur.bench.lampilot.benchmark import LampilotBenchmark, lampilot

__all__ = ["LampilotBenchmark", "lampilot"]
