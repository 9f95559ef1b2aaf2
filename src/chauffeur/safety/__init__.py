"""Safety before driving: small pure functions that judge a plan and never edit it."""

from chauffeur.safety.base import Check
from chauffeur.safety.checks import DEFAULT_CHECKS, run_checks
from chauffeur.safety.envelope import PARAMETERS_CHECK, check_parameters
from chauffeur.safety.format import FORMAT_CHECK, check_format

__all__ = [
    "DEFAULT_CHECKS",
    "FORMAT_CHECK",
    "PARAMETERS_CHECK",
    "Check",
    "check_format",
    "check_parameters",
    "run_checks",
]
