"""Files of TOML that people write, read into a model: bounded, and what is wrong with one is said by its key."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Final, TypeVar

from pydantic import BaseModel, ValidationError

from chauffeur.concept import ConfigError

_MAX_BYTES: Final = 64_000

M = TypeVar("M", bound=BaseModel)


def read_file(kind: type[M], path: Path) -> M:
    """A model from a file.

    Raises:
        ConfigError: It cannot be read; or as `read_text`.
    """
    try:
        with path.open("rb") as file:
            body = file.read(_MAX_BYTES + 1)
        text = body.decode("utf-8")
    except OSError as error:
        raise ConfigError(f"{path} cannot be read ({error.strerror}).", hint="Check the path.") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path} is not UTF-8 text.", hint="Save it as UTF-8.") from error
    if len(body) > _MAX_BYTES:
        raise ConfigError(f"{path} is longer than {_MAX_BYTES} bytes.", hint="Such a file has about 60 lines.")
    return read_text(kind, text, str(path))


def read_text(kind: type[M], text: str, where: str) -> M:
    """A model from TOML.

    Args:
        kind: The model.
        text: What stands in the file.
        where: Name of the file.

    Raises:
        ConfigError: It is not TOML, or a key is unknown, missing or out of range.
    """
    try:
        return kind.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{where} is not TOML: {error}.", hint="Look at that line.") from error
    except ValidationError as error:
        # A key that is not known comes first: it often is why another one is missing.
        wrong = sorted(
            error.errors(include_url=False, include_input=False), key=lambda one: one["type"] != "extra_forbidden"
        )
        first = wrong[0]
        key = ".".join(str(step) for step in first["loc"] if step != "[key]") or "the file"
        more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
        if first["type"] == "extra_forbidden":
            raise ConfigError(
                f"{where}: the key {key!r} is not known{more}.",
                hint="Take it out, or correct it; `docs/services.md` lists the keys.",
            ) from error
        if first["type"] == "missing":
            raise ConfigError(
                f"{where}: {key!r} is missing{more}.", hint="Add it; `docs/services.md` lists the keys."
            ) from error
        said = first["msg"].removeprefix("Value error, ")
        raise ConfigError(
            f"{where}: {key!r}: {said}{more}.", hint="Correct that key; `docs/services.md` lists them."
        ) from error
