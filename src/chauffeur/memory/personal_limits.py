"""Limits a person sets in a file they can read: no wish, no habit and no model gets past them.

`limits.toml` in Chauffeur's data directory, a table for each person and `everybody` for all:

    [everybody]
    max_speed_kmh = 130

    [ana]
    max_speed_kmh = 100          # never faster, whatever the sign says
    max_over_limit_kmh = 0       # above the sign: not at all
    min_time_headway_s = 1.5     # never closer

A table makes limits stricter, never looser: of two bounds the stricter one holds.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from chauffeur.concept import NOBODY, ConfigError, Limits, PersonId
from chauffeur.concept.data import data_home
from chauffeur.concept.units import MPS_PER_KMH

LIMITS_FILE: Final = "limits.toml"
EVERYBODY: Final = "everybody"
_RANGES: Final[dict[str, tuple[float, float]]] = {
    "max_speed_kmh": (1.0, 250.0),
    "max_over_limit_kmh": (0.0, 50.0),
    "min_time_headway_s": (0.0, 10.0),
}
"""What a table may hold, and between which values."""


def personal_limits(person: PersonId, limits: Limits, path: Path | None = None) -> Limits:
    """Limits, made stricter by what the file says for a person and for everybody.

    Args:
        person: Whose wish it is.
        limits: Of the drive.
        path: The file; default the one of this installation. Where there is none, nothing changes.

    Raises:
        ConfigError: The file cannot be read, or holds what it must not: nobody drives on half a file.
    """
    path = data_home() / LIMITS_FILE if path is None else path
    tables = _tables(path)
    names = [EVERYBODY] if person.strip() in (NOBODY, EVERYBODY) else [EVERYBODY, person.strip()]
    for name in names:
        if name in tables:
            limits = _stricter(limits, tables[name], name)
    return limits


def _tables(path: Path) -> dict[str, dict[str, float]]:
    try:
        content = path.read_text(encoding="utf-8")
    except (FileNotFoundError, NotADirectoryError):
        return {}
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            f"The limits in {path} cannot be read: {error}.", hint="Mend the file, or remove it."
        ) from error
    try:
        document: dict[str, Any] = tomllib.loads(content)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path} is no TOML: {error}.", hint="Mend the file, or remove it.") from error
    return {name: _table(path, name, table) for name, table in document.items()}


def _table(path: Path, name: str, table: object) -> dict[str, float]:
    if not isinstance(table, dict):
        raise ConfigError(
            f"{path}: {name!r} stands outside a table.", hint=f"Put it below a name, e.g. [{EVERYBODY}] or [ana]."
        )
    found: dict[str, float] = {}
    for key, value in table.items():
        if key not in _RANGES:
            raise ConfigError(f"{path}: [{name}] has no limit {key!r}.", hint=f"There are: {', '.join(_RANGES)}.")
        low, high = _RANGES[key]
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise ConfigError(f"{path}: [{name}] {key} = {value!r} is no number from {low:g} to {high:g}.")
        found[key] = float(value)
    return found


def _stricter(limits: Limits, table: dict[str, float], name: str) -> Limits:
    slowest = math.inf if limits.max_speed_mps is None else limits.max_speed_mps
    cap = min(slowest, table.get("max_speed_kmh", math.inf) * MPS_PER_KMH)
    closest = max(limits.min_time_headway_s, table.get("min_time_headway_s", 0.0))
    return replace(
        limits,
        name=f"{limits.name}+{name}",
        max_speed_mps=None if math.isinf(cap) else cap,
        max_over_limit_mps=min(limits.max_over_limit_mps, table.get("max_over_limit_kmh", math.inf) * MPS_PER_KMH),
        min_time_headway_s=closest,
        max_time_headway_s=max(limits.max_time_headway_s, closest),
    )
