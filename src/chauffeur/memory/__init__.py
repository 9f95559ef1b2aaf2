"""Memory: what each person wished, what was driven, and how they liked it."""

from chauffeur.memory.base import Memory
from chauffeur.memory.conflicts import conflicts_in
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.memory.vault import VaultMemory

__all__ = [
    "Memory",
    "VaultMemory",
    "conflicts_in",
    "interpret_feedback",
]
