"""How long memory keeps what people said, and whether it keeps anything new at all: one file, for this installation."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from chauffeur.concept import NOBODY, ConfigError, PersonId
from chauffeur.concept.data import data_home
from chauffeur.memory.files import private_directory, publish

PRIVACY_FILE: Final = "privacy.json"
RETENTION_DAYS: Final = 90
_LONGEST_DAYS: Final = 36_500


@dataclass(frozen=True, slots=True)
class Privacy:
    """What is kept.

    Attributes:
        retention_days: Trips older than this are neither recalled nor kept; None keeps them until they are erased.
        keeps: Whether new trips are kept; what is there already is recalled all the same.
    """

    retention_days: int | None = RETENTION_DAYS
    keeps: bool = True

    def since(self, now: datetime) -> datetime | None:
        """From when on trips count; None where all do."""
        return None if self.retention_days is None else now - timedelta(days=self.retention_days)

    def keep_from(self, now: datetime) -> str:
        """The same as a stamp; empty where all count."""
        since = self.since(now)
        return "" if since is None else stamp(since)


def utc_now() -> datetime:
    """Present time."""
    return datetime.now(UTC)


def stamp(moment: datetime) -> str:
    """ISO 8601 in UTC and of fixed width, so that stamps sort as times."""
    return moment.astimezone(UTC).isoformat(timespec="milliseconds")


def is_somebody(person: PersonId) -> bool:
    """Whether a name was given: without one nothing is kept."""
    return person.strip() != NOBODY


def read_privacy(home: Path | None = None) -> Privacy:
    """The settings of a data directory, the default one by default.

    Raises:
        ConfigError: The file cannot be read: to guess would keep what somebody did not want kept.
    """
    path = (data_home() if home is None else home) / PRIVACY_FILE
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        days, keeps = found["retention_days"], found["keeps"]
    except (FileNotFoundError, NotADirectoryError):
        return Privacy()
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise ConfigError(
            f"The privacy settings in {path} cannot be read ({type(error).__name__}).",
            hint="Set them again: chauffeur me retention 90; chauffeur me privacy off",
        ) from error
    if not isinstance(keeps, bool) or not (days is None or _is_days(days)):
        raise ConfigError(f"{path} holds no privacy settings.", hint="Set them again: chauffeur me retention 90")
    return Privacy(days, keeps)


def write_privacy(privacy: Privacy, home: Path | None = None) -> None:
    """Set them. Raises ConfigError: the retention is no number of days."""
    if privacy.retention_days is not None and not _is_days(privacy.retention_days):
        raise ConfigError(f"A retention of {privacy.retention_days} days is none.", hint="Use 1 day or more.")
    folder = private_directory(data_home() if home is None else home)
    publish(folder / PRIVACY_FILE, (json.dumps(asdict(privacy)) + "\n").encode())


def _is_days(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= _LONGEST_DAYS
