"""Exemplar programs of our own writing, one text per manoeuvre, with numbers left open."""

from chauffeur.planners.onboard.exemplars.library import Exemplar, Filled, exemplars, program_of

__all__ = ["Exemplar", "Filled", "exemplars", "program_of"]
