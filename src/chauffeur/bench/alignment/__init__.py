"""Whether explanations describe programs: generated and hand-written cases, and how well the judge tells them apart."""

from chauffeur.bench.alignment.benchmark import JUDGE, SCORES, AlignmentBenchmark, AlignmentRow
from chauffeur.bench.alignment.cases import AlignmentCase, half_of, handwritten, of_half
from chauffeur.bench.alignment.generating import COUNT, SEED, generate

__all__ = [
    "COUNT",
    "JUDGE",
    "SCORES",
    "SEED",
    "AlignmentBenchmark",
    "AlignmentCase",
    "AlignmentRow",
    "generate",
    "half_of",
    "handwritten",
    "of_half",
]
