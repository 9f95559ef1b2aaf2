"""Engines by name."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from chauffeur.concept import ConfigError
from chauffeur.speech.base import Recogniser
from chauffeur.speech.endpoint import DEFAULT_MODEL, TIMEOUT_S, EndpointRecogniser
from chauffeur.speech.grammar import GrammarRecogniser
from chauffeur.speech.whisper import WhisperRecogniser

ENGINES: Final = ("grammar", "whisper", "endpoint")
"""Names of the engines: offline and closed, offline and free, elsewhere."""


def open_recogniser(
    name: str = "grammar", *, model: str = "", base_url: str | None = None, timeout_s: float = TIMEOUT_S
) -> Recogniser:
    """An engine, ready to hear.

    Args:
        name: One of `ENGINES`.
        model: Folder of the Whisper model, or the endpoint's name for its model.
        base_url: Address of the endpoint; from the environment if left out.
        timeout_s: For one transcription by the endpoint.

    Raises:
        ConfigError: Unknown engine, no model named, or an unusable address.
        DataError: The model cannot be loaded.
        MissingExtraError: The engine's library is not installed.
    """
    if name == "grammar":
        return GrammarRecogniser()
    if name == "whisper":
        if not model:
            raise ConfigError("Whisper needs a model.", hint="Give its folder with --model FOLDER.")
        return WhisperRecogniser(Path(model))
    if name == "endpoint":
        return EndpointRecogniser(base_url, model or DEFAULT_MODEL, timeout_s=timeout_s)
    raise ConfigError(f"Unknown speech engine {name!r}.", hint=f"Known: {', '.join(ENGINES)}.")
