"""What the compact network looks at: six cameras, and the middle of the front one at full detail.

At a hundred pixels across, a car sixty metres ahead is three pixels wide. The middle of the front picture, cut out and
kept at twice the detail, is one more view with a camera of its own (longer focal length), so that the geometry of the
attention holds for it as for the others. It comes right after the front view: the first two are those of earlier
instants, and those of a single camera.
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
FRONT_VIEWS: Final = 2
"""Views of the front camera: all that is looked at of earlier instants."""
VIEWS: Final = (FRONT, MIDDLE, "CAM_L0", "CAM_R0", "CAM_L2", "CAM_R2", "CAM_B0")
_BOX: Final = (0.25, 0.2, 0.75, 0.7)
"""Of the middle in the front picture: left, top, right, bottom, as shares; the horizon lies in it."""


def camera_of(view: str) -> str:
    """The camera that a view is a part of."""
    return FRONT if view == MIDDLE else view


def cut(image: Any, view: str, size: tuple[int, int]) -> NDArray[np.uint8]:
    """A view, (3, H, W), of a picture.

    Args:
        image: The camera's picture (PIL, RGB).
        view: One of VIEWS.
        size: (height, width), px.
    """
    from PIL import Image

    wide, high = image.size
    left, top, right, bottom = _BOX if view == MIDDLE else (0.0, 0.0, 1.0, 1.0)
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
        left, top, right, bottom = _BOX if view == MIDDLE else (0.0, 0.0, 1.0, 1.0)
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
