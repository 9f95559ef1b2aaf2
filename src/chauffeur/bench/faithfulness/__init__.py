"""Do explanations describe programs? Generated and hand-written cases, and how well the judge tells them apart."""

from chauffeur.bench.faithfulness.benchmark import SCORES, FaithfulnessBenchmark
from chauffeur.bench.faithfulness.cases import FaithfulnessCase, half_of, handwritten, of_half
from chauffeur.bench.faithfulness.generator import generate

__all__ = [
    "SCORES",
    "FaithfulnessBenchmark",
    "FaithfulnessCase",
    "generate",
    "half_of",
    "handwritten",
    "of_half",
]
