"""Positions of picture patches and bird's-eye cells: what makes the attention aware of the cameras.

Vehicle frame: x forward, y left, z up, m, at the rig's origin. A patch is known by the ray through its middle, a cell
by where its column of reference points falls in each picture (the reference points of BEVFormer, as a bias).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.camera import Camera

    FloatArray = NDArray[np.float32]

HEIGHTS_M: Final = (0.3, 1.2, 3.5)
"""Of a cell's reference points: wheels, bodies, signals."""
_FAR: Final = 12.0
"""Largest penalty of a patch that shows nothing of a cell."""


@dataclass(frozen=True, slots=True)
class BevGrid:
    """Cells of the bird's-eye view.

    Attributes:
        ahead_m, behind_m, side_m: How far it reaches.
        rows, columns: Cells along and across.
    """

    ahead_m: float = 48.0
    behind_m: float = 16.0
    side_m: float = 12.0
    rows: int = 10
    columns: int = 6

    @property
    def cells(self) -> int:
        """Number of them."""
        return self.rows * self.columns

    def centres(self) -> FloatArray:
        """Middles (x, y) of all cells, (cells, 2), m; row by row from behind."""
        xs = -self.behind_m + (np.arange(self.rows) + 0.5) * (self.ahead_m + self.behind_m) / self.rows
        ys = -self.side_m + (np.arange(self.columns) + 0.5) * 2.0 * self.side_m / self.columns
        return np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2).astype(np.float32)


@dataclass(frozen=True, slots=True)
class RigGeometry:
    """Geometry of a rig, as the attention uses it.

    Attributes:
        rays: Of each patch of each view: direction of its middle and place of its camera, (views * patches, 6); places
            in tens of metres.
        bias: Added to the scores of cells (rows) for patches, (cells, views * patches), 0 where a reference point of
            the cell falls, down to -12 far from all.
        places: Middles of the cells, (cells, 2), in tens of metres.
    """

    rays: FloatArray
    bias: FloatArray
    places: FloatArray


def rig_geometry(cameras: Sequence[Camera], patches: tuple[int, int], grid: BevGrid) -> RigGeometry:
    """Geometry of a rig.

    Args:
        cameras: In the order of the views.
        patches: Rows and columns of patches of a picture.
        grid: Cells.
    """
    rays: list[FloatArray] = []
    bias: list[FloatArray] = []
    for camera in cameras:
        middles = _middles(camera, patches)
        rays.append(_rays(camera, middles))
        bias.append(_bias(camera, middles, patches, grid))
    return RigGeometry(np.concatenate(rays), np.concatenate(bias, axis=1), grid.centres() / 10.0)


def _middles(camera: Camera, patches: tuple[int, int]) -> FloatArray:
    """Pixels (u, v) of the middles of patches, (patches, 2), row by row."""
    rows, columns = patches
    u = (np.arange(columns) + 0.5) * camera.width / columns
    v = (np.arange(rows) + 0.5) * camera.height / rows
    return np.stack(np.meshgrid(v, u, indexing="ij")[::-1], axis=-1).reshape(-1, 2).astype(np.float32)


def _rays(camera: Camera, middles: FloatArray) -> FloatArray:
    flat = (middles - np.array(camera.centre_px)) / np.array(camera.focal_px)
    seen = np.concatenate([flat, np.ones((len(flat), 1))], axis=1)
    ahead = seen / np.linalg.norm(seen, axis=1, keepdims=True) @ camera.rotation.T
    place = np.broadcast_to(np.array(camera.position_m) / 10.0, ahead.shape)
    return np.concatenate([ahead, place], axis=1).astype(np.float32)


def _bias(camera: Camera, middles: FloatArray, patches: tuple[int, int], grid: BevGrid) -> FloatArray:
    """Half the squared distance, in patches, from the nearest reference point of a cell, with its sign changed."""
    centres = grid.centres()
    size = np.array([camera.width / patches[1], camera.height / patches[0]])
    best = np.full((len(centres), len(middles)), -_FAR, np.float32)
    for height in HEIGHTS_M:
        points = np.concatenate([centres, np.full((len(centres), 1), height)], axis=1)
        pixels, depth = camera.project(points.astype(np.float64))
        apart = ((pixels[:, None] - middles[None]) / size) ** 2
        score = np.where(depth[:, None] > 0.5, -0.5 * apart.sum(axis=-1), -_FAR)
        best = np.maximum(best, np.maximum(score, -_FAR)).astype(np.float32)
    return best
