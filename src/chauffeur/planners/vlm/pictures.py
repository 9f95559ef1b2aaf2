"""The grid in which the on-board VLM looks at a picture."""

from __future__ import annotations

from typing import Final

from chauffeur.planners.camera_faults import HEIGHT, WIDTH

CELLS: Final = (HEIGHT // 16, WIDTH // 16)
"""Rows and columns of the grid that the network sees in."""
