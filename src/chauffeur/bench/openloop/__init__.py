"""Open-loop planning (paper Tab. XII): nuScenes in its own file format, and frames of our own camera and traffic."""

from chauffeur.bench.openloop.benchmark import OpenLoopBenchmark
from chauffeur.bench.openloop.instructed import openloop

__all__ = ["OpenLoopBenchmark", "openloop"]
