"""Where an endpoint is."""

from __future__ import annotations

from collections.abc import Mapping

from chauffeur.concept.addresses import Address, http_address
from chauffeur.planners.llm_errors import KEY_VARIABLES

DEFAULT_BASE_URL = "https://api.openai.com/v1"
URL_VARIABLES = ("CHAUFFEUR_BASE_URL", "OPENAI_BASE_URL")
PLACEHOLDER_KEY = "none"
"""What servers of one's own are sent when there is no key: some servers want a non-empty one."""


def parse_address(base_url: str | None, environ: Mapping[str, str]) -> Address:
    """The endpoint to use: the argument, else the environment, else OpenAI's.

    Raises:
        ConfigError: Not an HTTP address, or it carries a secret.
    """
    given = base_url or next((environ[name] for name in URL_VARIABLES if environ.get(name)), DEFAULT_BASE_URL)
    example = "http://localhost:8000/v1 with --base-url"
    return http_address(given, "The base URL", example=example, key_place=KEY_VARIABLES[0])
