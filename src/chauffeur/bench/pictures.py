"""Bytes of a picture as a model gets them."""

from __future__ import annotations

import base64
import io
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Literal

from chauffeur.concept import DataError

MISSING: Final = "Missing view"
CORRUPT: Final = "Corrupt image"
"""Starts of the errors; they are counted apart."""

Pictures = Literal["real", "blank"]


def read_picture(path: Path, side_px: int = 0, pictures: Pictures = "real") -> bytes:
    """A picture as JPEG bytes.

    Args:
        path: Its file.
        side_px: Longer side it is scaled down to; 0 leaves it as it is.
        pictures: `blank` gives a grey one of the same size in its place.

    Raises:
        DataError: It is missing, or damaged.
    """
    from PIL import Image

    try:
        content = path.read_bytes()
    except OSError as error:
        raise DataError(f"{MISSING}: cannot read {path}: {error.strerror}.") from error
    try:
        image = Image.open(io.BytesIO(content))
        image.load()
    except Exception as error:  # PIL raises all kinds of things over damaged files
        raise DataError(f"{CORRUPT}: {path} is no picture that can be read ({type(error).__name__}).") from error
    scale = min(1.0, side_px / max(image.size)) if side_px else 1.0
    size = (max(1, round(image.width * scale)), max(1, round(image.height * scale)))
    if pictures == "blank":
        return _grey(size)
    if scale == 1.0 and image.format == "JPEG":
        return content
    small = image.convert("RGB").resize(size) if scale < 1.0 else image.convert("RGB")
    return _jpeg(small)


def data_uri(jpeg: bytes) -> str:
    """A picture as chat-completions endpoints take it."""
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode('ascii')}"


@lru_cache(maxsize=16)
def _grey(size: tuple[int, int]) -> bytes:
    from PIL import Image

    return _jpeg(Image.new("RGB", size, (128, 128, 128)))


def _jpeg(image: Any) -> bytes:
    out = io.BytesIO()
    image.save(out, "JPEG", quality=90)
    return out.getvalue()
