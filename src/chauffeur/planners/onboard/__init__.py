"""The embedded planners: the on-board language model, and the rules it is measured against."""

from chauffeur.planners.onboard.language_model import LanguageModelPlanner
from chauffeur.planners.onboard.retrieval import RetrievalPlanner
from chauffeur.planners.onboard.understand import understand

__all__ = ["LanguageModelPlanner", "RetrievalPlanner", "understand"]
