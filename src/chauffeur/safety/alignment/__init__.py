"""Whether the thoughts R describe the program P: claims of the text, held against what the program does."""

from chauffeur.concept import Alignment, Mismatch
from chauffeur.concept import MismatchKind as Kind
from chauffeur.safety.alignment.check import ALIGNMENT_CHECK, DRIVEN_CHECK, check_alignment, check_driven
from chauffeur.safety.alignment.facts import Effect, Facts, FactSurroundings
from chauffeur.safety.alignment.judge import judge, judge_drive
from chauffeur.safety.alignment.saying import KINDS, mismatch_words, score_words
from chauffeur.safety.alignment.tracing import read_facts

__all__ = [
    "ALIGNMENT_CHECK",
    "DRIVEN_CHECK",
    "KINDS",
    "Alignment",
    "Effect",
    "FactSurroundings",
    "Facts",
    "Kind",
    "Mismatch",
    "check_alignment",
    "check_driven",
    "judge",
    "judge_drive",
    "mismatch_words",
    "read_facts",
    "score_words",
]
