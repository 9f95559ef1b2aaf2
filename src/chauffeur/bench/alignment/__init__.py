"""Whether explanations describe programs: generated and hand-written cases, and how well the judge tells them apart."""

from chauffeur.bench.alignment.cases import Case, half_of, handwritten, of_half
from chauffeur.bench.alignment.generating import COUNT, SEED, generate
from chauffeur.bench.alignment.scoring import JUDGE, Judged, Score, by_kind, judge_cases, score, table_lines

__all__ = [
    "COUNT",
    "JUDGE",
    "SEED",
    "Case",
    "Judged",
    "Score",
    "by_kind",
    "generate",
    "half_of",
    "handwritten",
    "judge_cases",
    "of_half",
    "score",
    "table_lines",
]
