"""Contact sheets: many small pictures with their names on one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Pixels = NDArray[np.uint8]


def contact_sheet(pictures: Sequence[tuple[str, Pixels]], columns: int) -> Image.Image:
    """Pictures (H, W, 3) of one size in rows, each with its name in the corner."""
    height, width = pictures[0][1].shape[:2]
    sheet = Image.new("RGB", (columns * width, math.ceil(len(pictures) / columns) * height))
    draw = ImageDraw.Draw(sheet)
    for number, (name, pixels) in enumerate(pictures):
        corner = number % columns * width, number // columns * height
        sheet.paste(Image.fromarray(pixels), corner)
        at = corner[0] + 4, corner[1] + 2
        draw.rectangle(draw.textbbox(at, name), fill=(0, 0, 0))
        draw.text(at, name, fill=(255, 240, 120))
    return sheet
