"""Where an endpoint is and which key it gets. The key is read from the environment and never kept."""

from __future__ import annotations

import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

from chauffeur.concept import ConfigError
from chauffeur.planners.llm_errors import KEY_VARIABLES

DEFAULT_BASE_URL = "https://api.openai.com/v1"
URL_VARIABLES = ("CHAUFFEUR_BASE_URL", "OPENAI_BASE_URL")
PLACEHOLDER_KEY = "none"
"""What servers of one's own are sent when there is no key: the SDK and some servers want a non-empty one."""

_LOCAL_SUFFIXES = (".localhost", ".local", ".lan", ".internal", ".home.arpa")


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


def parse_address(base_url: str | None, environ: Mapping[str, str]) -> Address:
    """The endpoint to use: the argument, else the environment, else OpenAI's.

    Raises:
        ConfigError: Not an HTTP address, or it carries a secret.
    """
    given = base_url or next((environ[name] for name in URL_VARIABLES if environ.get(name)), DEFAULT_BASE_URL)
    try:
        parts = urlsplit(given.strip())
        host, port = (parts.hostname or "").lower(), parts.port
    except ValueError:
        host, port, parts = "", None, urlsplit("")
    if parts.scheme not in {"http", "https"} or not host:
        raise ConfigError(
            "The base URL is not an HTTP address.", hint="Give one such as http://localhost:8000/v1 with --base-url."
        )
    if parts.username or parts.password or parts.query or parts.fragment:
        raise ConfigError(
            f"The base URL for {host} carries more than host and path.",
            hint=f"Leave out user, password and query; put a key into {KEY_VARIABLES[0]}.",
        )
    shown_host = f"[{host}]" if ":" in host else host
    authority = shown_host if port is None else f"{shown_host}:{port}"
    return Address(url=f"{parts.scheme}://{authority}{parts.path.rstrip('/')}", host=host, local=_is_local(host))


def _is_local(host: str) -> bool:
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return "." not in host or host.endswith(_LOCAL_SUFFIXES)
    return address.is_private or address.is_loopback or address.is_link_local


def read_key(address: Address, environ: Mapping[str, str]) -> tuple[str, str] | None:
    """(key, name of its variable), or None where the environment has none.

    Raises:
        ConfigError: The key cannot be one, or would cross a public network unencrypted. Its text is never shown.
    """
    for name in KEY_VARIABLES:
        key = environ.get(name, "").strip()
        if not key:
            continue
        if not key.isascii() or not key.isprintable() or " " in key:
            raise ConfigError(f"{name} holds characters no API key has.", hint="Set it again, without line breaks.")
        if address.url.startswith("http://") and not address.local:
            raise ConfigError(
                f"The key in {name} would be sent to {address.url} unencrypted.", hint="Use an https:// address."
            )
        return key, name
    return None
