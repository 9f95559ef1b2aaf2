"""Whether what passengers say is done: labelled commands driven in staged scenes of a town, judged by geometry."""

from chauffeur.bench.realization.benchmark import RealizationBenchmark, realization
from chauffeur.bench.realization.stage import CommandScene, stage_of

__all__ = ["CommandScene", "RealizationBenchmark", "realization", "stage_of"]
