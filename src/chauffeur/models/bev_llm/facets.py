"""Targets of the compact network's tokens: the class of every family, and the lead vehicle's distance.

From four-way questions alone a network that begins with nothing learns slowly: one bit or two a question, through all
its words. The ground truth of a staged scene says every class outright, and where every road user is; a head on each
token and one on each cell are taught with it (deep supervision, Lee et al. 2015). The answers come from the decoder.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chauffeur.bench.nuplanqa.scenes.wording import word_bank

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.models.bev_llm.geometry import BevGrid

Facets = tuple[tuple[str, tuple[str, ...]], ...]
"""Names of facets and of their classes."""

KINDS: Final = ("nobody", "car", "truck", "bus", "motorcycle", "bicycle", "pedestrian")
"""Of a cell of the bird's-eye view."""
DISTANCES_M: Final = (9.0, 12.0, 16.0, 22.0, 30.0, 40.0, 55.0, 75.0)
"""Bounds of the classes of the lead vehicle's distance, centre to centre; the class before them is nobody."""
APPROACHES_MPS: Final = (-6.0, -3.0, -1.0, 1.0, 3.0, 6.0)
"""Bounds of the classes of how much faster than the ego the lead vehicle is."""


def facets() -> Facets:
    """The families of questions, the two sides apart, and the lead vehicle's distance and approach."""
    found: list[tuple[str, tuple[str, ...]]] = []
    for family, bank in word_bank().families.items():
        sides = ("left", "right") if family == "beside" else ("",)
        found += [(f"{family} {side}".strip(), tuple(bank.classes)) for side in sides]
    distances = ("nobody", *(f"below {bound:g} m" for bound in DISTANCES_M), f"from {DISTANCES_M[-1]:g} m on")
    approaches = (*(f"below {bound:g} m/s" for bound in APPROACHES_MPS), f"from {APPROACHES_MPS[-1]:g} m/s on")
    return (*found, ("distance", distances), ("approach", approaches))


def labels_of(truth: Mapping[str, Any], of: Facets) -> NDArray[np.int64]:
    """Index of each facet's class in a scene, (facets,); -1 where it is not known."""
    told = {f"{family} {side}".strip(): value for family, side, value in truth["facts"]}
    lead: Sequence[float] | None = truth["lead"]
    found = np.full(len(of), -1, np.int64)
    for place, (name, classes) in enumerate(of):
        if name in told:
            found[place] = classes.index(told[name])
        elif name == "distance" and lead is not None:
            found[place] = 1 + bisect_right(DISTANCES_M, lead[0]) if lead else 0
        elif name == "approach" and lead:
            found[place] = bisect_right(APPROACHES_MPS, lead[1])
    return found


def cells_of(truth: Mapping[str, Any], grid: BevGrid) -> NDArray[np.int64]:
    """Kind of the road user in each cell, (cells,); -1 where somebody is whom no picture shows, or of no such kind."""
    found = np.zeros(grid.cells, np.int64)
    for kind, x_m, y_m, seen in truth["users"]:
        row = int((x_m + grid.behind_m) / (grid.ahead_m + grid.behind_m) * grid.rows // 1)
        column = int((y_m + grid.side_m) / (2.0 * grid.side_m) * grid.columns // 1)
        if 0 <= row < grid.rows and 0 <= column < grid.columns:
            found[row * grid.columns + column] = KINDS.index(kind) if seen and kind in KINDS else -1
    return found
