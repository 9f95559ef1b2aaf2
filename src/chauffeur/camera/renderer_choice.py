"""Choice of the renderer for this machine."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from chauffeur.concept import ConfigError, MissingExtraError

if TYPE_CHECKING:
    from chauffeur.camera.renderer import Renderer

_log = logging.getLogger(__name__)


def make_renderer(kind: str = "auto") -> Renderer:
    """A renderer; its `engine` says which one it is.

    Args:
        kind: `opengl` (moderngl and EGL), `painter` (NumPy: always there, slower, simpler), or `auto`: OpenGL where it
            runs, else the painter, which is logged.

    Raises:
        MissingExtraError: `opengl` was asked for and cannot run here.
        ConfigError: There is no such kind.
    """
    from chauffeur.camera.painter import PainterRenderer
    from chauffeur.camera.renderer import GlRenderer

    if kind == "painter":
        return PainterRenderer()
    if kind not in ("auto", "opengl"):
        raise ConfigError(f"There is no renderer {kind!r}.", hint="Choose of: auto, opengl, painter.")
    try:
        return GlRenderer()
    except MissingExtraError as error:
        if kind == "opengl":
            raise
        _log.warning("%s Pictures are painted in NumPy instead: slower and simpler. %s", error, error.hint)
        return PainterRenderer()
