"""HTTP addresses that come from outside, and the keys that go there. A key is read from the environment, never kept."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final
from urllib.parse import urlsplit

from chauffeur.concept.errors import ConfigError

_LOCAL_SUFFIXES: Final = (".localhost", ".local", ".lan", ".internal", ".home.arpa")
"""Names that never leave a network of one's own (RFC 6761, 6762, 8375, and common use)."""


@dataclass(frozen=True, slots=True)
class Address:
    """A checked base URL.

    Attributes:
        url: Without trailing slash, user, query or fragment; safe to show.
        host: Lower case.
        local: On this machine or this network, by its form: no key is needed there, and plain HTTP is allowed.
    """

    url: str
    host: str
    local: bool


def http_address(given: str, what: str, *, example: str, key_place: str = "an environment variable") -> Address:
    """A base URL, checked.

    Args:
        given: As it was given.
        what: What it is the address of, as an error says it.
        example: A good one, for an error's hint.
        key_place: Where a key belongs instead, for an error's hint.

    Raises:
        ConfigError: Not an HTTP address, or it carries a secret, which the error does not show.
    """
    try:
        parts = urlsplit(given.strip())
        host, port = (parts.hostname or "").lower(), parts.port
    except ValueError:
        host, port, parts = "", None, urlsplit("")
    if parts.scheme not in ("http", "https") or not host:
        raise ConfigError(f"{what} is not an HTTP address.", hint=f"Give one such as {example}.")
    if parts.username or parts.password or parts.query or parts.fragment:
        raise ConfigError(
            f"{what} ({host}) carries more than host and path.",
            hint=f"Leave out user, password and query; a key belongs into {key_place}.",
        )
    shown = f"[{host}]" if ":" in host else host
    authority = shown if port is None else f"{shown}:{port}"
    return Address(f"{parts.scheme}://{authority}{parts.path.rstrip('/')}", host, _is_local(host))


def read_key(address: Address, variables: Iterable[str], environ: Mapping[str, str]) -> tuple[str, str] | None:
    """(key, name of its variable), or None where the environment has none.

    Args:
        address: Where it would be sent.
        variables: Environment variables that may hold it, the first that is set counts.
        environ: Environment.

    Raises:
        ConfigError: The key cannot be one, or would cross a public network unencrypted. Its text is never shown.
    """
    for name in variables:
        key = environ.get(name, "").strip()
        if not key:
            continue
        if not key.isascii() or not key.isprintable() or " " in key:
            raise ConfigError(f"{name} holds characters no key has.", hint="Set it again, without line breaks.")
        if address.url.startswith("http://") and not address.local:
            raise ConfigError(
                f"The key in {name} would be sent to {address.url} unencrypted.", hint="Use an https:// address."
            )
        return key, name
    return None


def _is_local(host: str) -> bool:
    try:
        numbers = ipaddress.ip_address(host)
    except ValueError:
        return "." not in host or host.endswith(_LOCAL_SUFFIXES)
    return numbers.is_private or numbers.is_loopback or numbers.is_link_local
