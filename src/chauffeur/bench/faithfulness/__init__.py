"""Whether explanations describe programs: generated and hand-written cases, and how well the judge tells them apart."""

from chauffeur.bench.faithfulness.benchmark import JUDGE, SCORES, FaithfulnessBenchmark, FaithfulnessRow
from chauffeur.bench.faithfulness.cases import FaithfulnessCase, half_of, handwritten, of_half
from chauffeur.bench.faithfulness.generator import COUNT, SEED, generate

__all__ = [
    "COUNT",
    "JUDGE",
    "SCORES",
    "SEED",
    "FaithfulnessBenchmark",
    "FaithfulnessCase",
    "FaithfulnessRow",
    "generate",
    "half_of",
    "handwritten",
    "of_half",
]
