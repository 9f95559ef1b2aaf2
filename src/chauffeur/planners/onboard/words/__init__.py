"""Vocabulary of the on-board planner as text files: cues, rewrites and fillers."""

from chauffeur.planners.onboard.words.files import words_file

__all__ = ["words_file"]
