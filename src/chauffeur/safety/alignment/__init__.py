"""Whether the thoughts R describe the program P: claims of the text, held against what the program does."""

from chauffeur.safety.alignment.check import ALIGNMENT_CHECK, check_alignment
from chauffeur.safety.alignment.comparing import Kind, Mismatch
from chauffeur.safety.alignment.facts import Effect, Facts, Surroundings
from chauffeur.safety.alignment.judge import Alignment, judge
from chauffeur.safety.alignment.tracing import read_facts

__all__ = [
    "ALIGNMENT_CHECK",
    "Alignment",
    "Effect",
    "Facts",
    "Kind",
    "Mismatch",
    "Surroundings",
    "check_alignment",
    "judge",
    "read_facts",
]
