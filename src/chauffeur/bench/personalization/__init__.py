"""Talk2Drive's evaluation (paper Sec. V-C): how a drive scores, and how often a person takes over."""

from chauffeur.bench.personalization.scoring import (
    SCORE_VERSION,
    DrivingScore,
    ScoreWeights,
    TripStatistics,
    driving_score,
    statistics_of,
)

__all__ = ["SCORE_VERSION", "DrivingScore", "ScoreWeights", "TripStatistics", "driving_score", "statistics_of"]
