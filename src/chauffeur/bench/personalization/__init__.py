"""Talk2Drive's evaluation (paper Sec. V-C): how a drive scores, and how often a person takes over."""

from chauffeur.bench.personalization.scoring import (
    TripStatistics,
    driving_score,
    statistics_of,
)

__all__ = ["TripStatistics", "driving_score", "statistics_of"]
