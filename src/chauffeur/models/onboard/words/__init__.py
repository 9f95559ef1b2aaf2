"""What passengers say for each skill of the dialect: the tables of this folder, and their sentences."""

from chauffeur.models.onboard.wordings import clause, conditioned, in_order, levels, utter, wordings

__all__ = ["clause", "conditioned", "in_order", "levels", "utter", "wordings"]
