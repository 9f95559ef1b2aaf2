"""LaMPilot-Bench: instruction following on highway and intersection (paper Sec. IV-A)."""

from chauffeur.bench.lampilot.runner import LampilotRun, lampilot

__all__ = ["LampilotRun", "lampilot"]
