"""V: pictures as pixels and as PNG files."""

from __future__ import annotations

import numpy as np
import pytest

from chauffeur.concept import CameraImage, ConfigError


def test_pixels_and_png_are_the_same_picture():
    pixels = np.random.default_rng(3).integers(0, 256, (12, 20, 3)).astype(np.uint8)
    image = CameraImage("front", 2.0, pixels)
    again = CameraImage("front", 2.0, image.png())
    assert (again.pixels() == pixels).all() and again == image and hash(again) == hash(image)
    other = pixels.copy()
    other[0, 0, 0] ^= 1
    assert CameraImage("front", 2.0, other) != image
    assert CameraImage("back", 2.0, pixels) != image


def test_bytes_that_are_no_picture_are_said():
    with pytest.raises(ConfigError, match="'front' cannot be read"):
        CameraImage("front", 0.0, b"no picture").pixels()
