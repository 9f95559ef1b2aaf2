"""Checks that commands are carried out: labelled commands driven in staged scenes, judged by geometry."""

from chauffeur.bench.realization.benchmark import RealizationBenchmark, realization
from chauffeur.bench.realization.highway import highway_scenario
from chauffeur.bench.realization.stage import CommandScene, stage_of

__all__ = ["CommandScene", "RealizationBenchmark", "highway_scenario", "realization", "stage_of"]
