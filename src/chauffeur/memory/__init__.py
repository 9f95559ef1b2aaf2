"""Memory: what each person wished, what was driven, and how they liked it."""

from chauffeur.memory.base import Memory
from chauffeur.memory.feedback import Standing, interpret_feedback, standing_feedback
from chauffeur.memory.similarity import mark, tags_of
from chauffeur.memory.vault import VaultMemory

__all__ = ["Memory", "Standing", "VaultMemory", "interpret_feedback", "mark", "standing_feedback", "tags_of"]
