"""One OpenGL renderer for all tests of the camera: making one takes a while."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from chauffeur.camera import Renderer, make_renderer
from chauffeur.camera.painter import PainterRenderer
from chauffeur.concept import MissingExtraError


@pytest.fixture(scope="session")
def opengl() -> Iterator[Renderer]:
    pytest.importorskip("moderngl")
    try:
        made = make_renderer("opengl")
    except MissingExtraError as error:
        pytest.skip(str(error))
    yield made
    made.close()


@pytest.fixture(scope="session")
def painter() -> Renderer:
    return PainterRenderer()
