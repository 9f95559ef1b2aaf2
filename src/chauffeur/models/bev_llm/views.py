"""Views of the compact network: six cameras, and two cuts of the front one in which far things are larger.

At a hundred pixels across, a car sixty metres ahead is three pixels wide. The middle of the front picture is kept at
twice the detail, and the middle of that at four times it, as one more view each with a camera of its own (longer focal
length), so that the geometry of the attention holds for them as for the others. They come right after the front view:
the first three are those of earlier instants, and those of a single camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.camera import Camera

FRONT: Final = "CAM_F0"
MIDDLE: Final = "CAM_F0.middle"
FAR: Final = "CAM_F0.far"
FRONT_VIEWS: Final = 3
"""Views of the front camera: all that is looked at of earlier instants."""
VIEWS: Final = (FRONT, MIDDLE, FAR, "CAM_L0", "CAM_R0", "CAM_L2", "CAM_R2", "CAM_B0")
DETAIL: Final = 4
"""How many times as wide and high as a view a front picture is whose cuts lose nothing."""
_WHOLE: Final = (0.0, 0.0, 1.0, 1.0)
_BOXES: Final = {MIDDLE: (0.25, 0.2, 0.75, 0.7), FAR: (0.375, 0.4, 0.625, 0.65)}
"""Of the cuts in the front picture: left, top, right, bottom, as shares; the horizon lies in them."""


def camera_of(view: str) -> str:
    """The camera that a view is a part of."""
    return FRONT if view in _BOXES else view


def cut(image: Any, view: str, size: tuple[int, int]) -> NDArray[np.uint8]:
    """A view, (3, H, W), of a picture.

    Args:
        image: The camera's picture (PIL, RGB).
        view: One of VIEWS.
        size: (height, width), px.
    """
    from PIL import Image

    wide, high = image.size
    left, top, right, bottom = _BOXES.get(view, _WHOLE)
    box = (left * wide, top * high, right * wide, bottom * high)
    small = image.resize((size[1], size[0]), Image.Resampling.BILINEAR, box=box)
    return np.asarray(small, np.uint8).transpose(2, 0, 1)


def view_cameras(cameras: Sequence[Camera], size: tuple[int, int]) -> tuple[Camera, ...]:
    """The cameras of VIEWS, as far as the rig has them, with pictures of (height, width) px."""
    by_name = {camera.name: camera for camera in cameras}
    height, width = size
    found: list[Camera] = []
    for view in VIEWS:
        if camera_of(view) not in by_name:
            continue
        whole = by_name[camera_of(view)]
        left, top, right, bottom = _BOXES.get(view, _WHOLE)
        across, down = width / ((right - left) * whole.width), height / ((bottom - top) * whole.height)
        (fx, fy), (cx, cy) = whole.focal_px, whole.centre_px
        found.append(
            replace(
                whole,
                name=view,
                width=width,
                height=height,
                focal_px=(fx * across, fy * down),
                centre_px=((cx - left * whole.width) * across, (cy - top * whole.height) * down),
            )
        )
    return tuple(found)
