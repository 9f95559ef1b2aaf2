"""Words as people say them: plain tokens, numbers and units. Knows language and nothing of driving."""

from chauffeur.language.quantities import Dimension, Quantity, mark_quantities, measured, read_quantities
from chauffeur.language.slips import Slip, slip_in
from chauffeur.language.tokens import plain, tokens_of

__all__ = [
    "Dimension",
    "Quantity",
    "Slip",
    "mark_quantities",
    "measured",
    "plain",
    "read_quantities",
    "slip_in",
    "tokens_of",
]
