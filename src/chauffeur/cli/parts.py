"""The exchangeable parts a command line can name: planner, limits, speech engine."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from chauffeur.concept import LAMPILOT_LIMITS, ConfigError, Limits, MissingExtraError
from chauffeur.concept.lab import needs_lab

if TYPE_CHECKING:
    from chauffeur.concept import Context, Observation
    from chauffeur.describe.services.sources import SourceSettings
    from chauffeur.driving.talk.asr_process import AsrEngine
    from chauffeur.planners.base import Planner
    from chauffeur.planners.prompts import Setting

_LIMITS = {"default": Limits(), "lampilot": LAMPILOT_LIMITS}


def needs(extra: str, what: str, *modules: str) -> None:
    """Say before any work is done that an extra is missing. Nothing is imported.

    Args:
        extra: The extra of this package that brings the modules.
        what: Who needs it, as the subject of a sentence.
        modules: Top-level modules.

    Raises:
        MissingExtraError: One cannot be found; the hint installs the extra for this interpreter.
    """
    missing = [name for name in modules if not _importable(name)]
    if missing:
        raise MissingExtraError(f"{what} needs {', '.join(missing)}.", extra=extra)


def _importable(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ValueError:  # it is being kept from being imported
        return False


def limits_named(name: str) -> Limits:
    """Limits by name. Raises ConfigError for an unknown one."""
    if name not in _LIMITS:
        raise ConfigError(f"Unknown limits {name!r}.", hint=f"Use one of: {', '.join(_LIMITS)}.")
    return _LIMITS[name]


def seeing_named(name: str, seed: int = 0) -> Callable[[Observation], Context] | None:
    """Who makes C: None for the world's own state, a descriptor that looks for `cameras` or `cameras/FOLDER`.

    Args:
        name: As on the command line.
        seed: Of what stands along the road in the pictures.

    Raises:
        ConfigError: Unknown name.
        MissingExtraError: Nothing can be rendered or read here.
        DataError: The folder holds no model.
    """
    kind, _, folder = name.partition("/")
    if name == "state":
        return None
    if kind != "cameras":
        raise ConfigError(f"Unknown way of seeing {name!r}.", hint="Use state, cameras, or cameras/FOLDER.")
    needs_lab("Seeing by cameras")
    needs("models", "Seeing by cameras", "torch", "transformers", "safetensors")
    from pathlib import Path

    from chauffeur.camera import make_renderer
    from chauffeur.describe.vision import CameraDescriptor
    from chauffeur.models.bev_llm.seeing import BevLlmReader

    return CameraDescriptor(BevLlmReader(Path(folder) if folder else None), make_renderer(), place=seed)


def setting_named(name: str) -> Setting:
    """Prompt setting by name. Raises ConfigError for an unknown one."""
    if name not in ("few-shot", "zero-shot"):
        raise ConfigError(f"Unknown setting {name!r}.", hint="Use few-shot or zero-shot.")
    return name


def planner_named(spec: str, base_url: str | None, on_text: Callable[[str, int], None] | None = None) -> Planner:
    """Planner by specification; `on_text` gets a language model's reply as it is written.

    Raises:
        ConfigError: Unknown, or it takes no endpoint.
    """
    from chauffeur.planners.registry import make_planner, takes_option

    options: dict[str, Any] = {} if base_url is None else {"base_url": base_url}
    if on_text is not None and takes_option(spec, "on_text"):
        options["on_text"] = on_text
    return make_planner(spec, **options)


def planner_options(spec: str, base_url: str | None) -> dict[str, Any]:
    """Options of a planner in a benchmark.

    A language model is asked whole replies, which cost less to read than pieces nobody looks at, and does not try again
    by itself: the run does, which sees what all calls meet.
    """
    options: dict[str, Any] = {} if base_url is None else {"base_url": base_url}
    return options | {"attempts": 1, "stream": False} if spec.startswith("openai/") else options


def engine_named(spec: str) -> AsrEngine | None:
    """The speech engine a specification names; None for `none`.

    Raises:
        ConfigError: There is no such engine.
    """
    from chauffeur.driving.talk.asr_process import AsrEngine
    from chauffeur.speech.engines import ENGINES

    name, _, model = spec.strip().partition("/")
    if name not in (*ENGINES, "none"):
        raise ConfigError(f"Unknown speech engine {spec!r}.", hint=f"Known: {', '.join(ENGINES)}, none.")
    return AsrEngine(name, model, favoured=True) if name != "none" else None


def not_kept(person: str) -> str:
    """What to tell a person of whom nothing new is kept; empty where it is."""
    from chauffeur.memory.privacy import read_privacy

    if not person or read_privacy().keeps:
        return ""
    return f"Privacy mode: nothing of this drive is kept in the profile of {person}."


def standing_sources() -> SourceSettings | None:
    """Where the context of this person's drives is completed from; None where their file does not exist.

    Raises:
        ConfigError: The file cannot be used.
    """
    from chauffeur.driving.surroundings import services_file

    path = services_file()
    if path is None:
        return None
    from chauffeur.describe.services.sources import read_sources

    return read_sources(path)
