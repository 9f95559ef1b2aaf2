"""Vocabulary of the on-board planner as text files: words of other languages."""

from chauffeur.planners.onboard.words.files import words_file

__all__ = ["words_file"]
