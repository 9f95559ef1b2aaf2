"""Faithfulness of the thoughts R to the program P: claims of the text, held against what the program does."""

from chauffeur.concept import Faithfulness, Mismatch
from chauffeur.concept import MismatchKind as Kind
from chauffeur.safety.faithfulness.check import DRIVEN_CHECK, FAITHFULNESS_CHECK, check_driven, check_faithfulness
from chauffeur.safety.faithfulness.facts import Effect, Facts, FactSurroundings
from chauffeur.safety.faithfulness.judge import judge, judge_drive
from chauffeur.safety.faithfulness.relations import read_facts
from chauffeur.safety.faithfulness.report import KINDS, mismatch_words, score_words

__all__ = [
    "DRIVEN_CHECK",
    "FAITHFULNESS_CHECK",
    "KINDS",
    "Effect",
    "FactSurroundings",
    "Facts",
    "Faithfulness",
    "Kind",
    "Mismatch",
    "check_driven",
    "check_faithfulness",
    "judge",
    "judge_drive",
    "mismatch_words",
    "read_facts",
    "score_words",
]
