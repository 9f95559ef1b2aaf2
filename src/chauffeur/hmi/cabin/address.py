"""Where the cabin page is reached in this car: said once for the machine, in its environment, not at every drive."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chauffeur.concept import ConfigError
from chauffeur.hmi.local_page import HOST, Certificate

ADDRESS_VARIABLE: Final = "CHAUFFEUR_CABIN"
CERTIFICATE_VARIABLE: Final = "CHAUFFEUR_CABIN_CERTIFICATE"
KEY_VARIABLE: Final = "CHAUFFEUR_CABIN_KEY"

_ADDRESS: Final = re.compile(r"(?P<host>\[[0-9A-Fa-f:.]+\]|[^:\[\]\s/]*)(?::(?P<port>\d{1,5}))?")
_MOST_PORT: Final = 65_535


@dataclass(frozen=True, slots=True)
class PageAddress:
    """Name or number, port (0: a free one) and certificate of the page's server."""

    host: str = HOST
    port: int = 0
    certificate: Certificate | None = None


def address_of(environ: Mapping[str, str]) -> PageAddress:
    """The address the environment names: this machine alone and a free port where it names none.

    Args:
        environ: `CHAUFFEUR_CABIN` is `host`, `host:port` or `:port`; `CHAUFFEUR_CABIN_CERTIFICATE` and
            `CHAUFFEUR_CABIN_KEY` are PEM files, without which only this machine itself can be named.

    Raises:
        ConfigError: It is no address, or only one of the two files is named.
    """
    said = environ.get(ADDRESS_VARIABLE, "").strip()
    chain, key = (environ.get(name, "").strip() for name in (CERTIFICATE_VARIABLE, KEY_VARIABLE))
    if bool(chain) != bool(key):
        missing = KEY_VARIABLE if chain else CERTIFICATE_VARIABLE
        raise ConfigError("A certificate and its key are needed, not one of them.", hint=f"Set {missing} as well.")
    found = _ADDRESS.fullmatch(said)
    port = int(found["port"] or 0) if found else 0
    if found is None or port > _MOST_PORT:
        raise ConfigError(
            f"{ADDRESS_VARIABLE}={said!r} is no address for the page.",
            hint="Write car.local:8443, or :8443 for this machine alone at that port.",
        )
    certificate = Certificate(Path(chain), Path(key)) if chain else None
    return PageAddress(found["host"].strip("[]") or HOST, port, certificate)
