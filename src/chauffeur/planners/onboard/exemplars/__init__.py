"""Exemplar programs of our own writing, one text per manoeuvre, with numbers left open."""

from chauffeur.planners.onboard.exemplars.library import Exemplar, Filled, exemplars, function_of, program_of

__all__ = ["Exemplar", "Filled", "exemplars", "function_of", "program_of"]
