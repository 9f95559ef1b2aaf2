"""Settings of a served language model: in one place for every command, because they belong to the server and not to
the wish. Beside its address and key, which stand there too, each can be given as an environment variable.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from chauffeur.concept import ConfigError
from chauffeur.concept.addresses import Address, http_address
from chauffeur.planners.llm_errors import KEY_VARIABLES

_BASE_URL: Final = "https://api.openai.com/v1"
_URL_VARIABLES: Final = ("CHAUFFEUR_BASE_URL", "OPENAI_BASE_URL")
_PLAN_S: Final = 180.0
"""Least time for a whole plan, where it is not given."""


@dataclass(frozen=True, slots=True)
class LlmSettings:
    """Sampling, limits and patience for one model.

    Attributes:
        temperature: 0..2; None leaves it to the server. CHAUFFEUR_TEMPERATURE (`server` for None).
        max_tokens: Most tokens an answer may have, reasoning included. CHAUFFEUR_MAX_TOKENS.
        timeout_s: For one whole answer, from request to last word. CHAUFFEUR_TIMEOUT_S.
        attempts: Requests at most for one answer, where it failed in a way that passes. CHAUFFEUR_ATTEMPTS.
        repairs: How often the model may correct an answer that the checks refused. CHAUFFEUR_REPAIRS.
        budget_s: For a whole plan with retries, waits and repairs; default 180 s, or the time-outs of all its answers
            where those are longer. CHAUFFEUR_BUDGET_S.
    """

    temperature: float | None = 0.0
    max_tokens: int = 4096
    timeout_s: float = 60.0
    attempts: int = 4
    repairs: int = 1
    budget_s: float = 0.0

    @property
    def plan_s(self) -> float:
        """Seconds for a whole plan."""
        return self.budget_s or max(_PLAN_S, self.timeout_s * (1 + self.repairs))


_RANGES: Final[dict[str, tuple[float, float]]] = {
    "temperature": (0.0, 2.0),
    "max_tokens": (1, 1_000_000),
    "timeout_s": (0.001, 86_400.0),
    "attempts": (1, 100),
    "repairs": (0, 5),
    "budget_s": (0.001, 86_400.0),
}
VARIABLES: Final[dict[str, str]] = {name: f"CHAUFFEUR_{name.upper()}" for name in _RANGES}
"""Environment variable of each setting."""
_WHOLE: Final = ("max_tokens", "attempts", "repairs")


def settings_from(environ: Mapping[str, str], given: Mapping[str, float | str | None]) -> LlmSettings:
    """Settings as given; what is not given from the environment; the rest as it stands.

    Args:
        environ: Environment variables.
        given: Settings by name; None for those that are not given.

    Raises:
        ConfigError: A setting is no number or out of range; it names the variable where it came from one.
    """
    found: dict[str, Any] = {}
    for name, variable in VARIABLES.items():
        said, shown = given.get(name), name
        if said is None:
            said, shown = environ.get(variable, "").strip(), variable
        if said != "":
            found[name] = _value(shown, name, said)
    return LlmSettings(**found)


def _value(shown: str, name: str, said: float | str) -> float | None:
    if name == "temperature" and said == "server":
        return None
    try:
        value = int(said) if name in _WHOLE else float(said)
    except ValueError:
        whole = "a whole number" if name in _WHOLE else "a number"
        raise ConfigError(f"{shown} = {said!r} is not {whole}.") from None
    low, high = _RANGES[name]
    if not low <= value <= high:
        raise ConfigError(f"{shown} = {said} is out of range.", hint=f"Use {low:g} to {high:,.10g}.")
    return value


def parse_address(base_url: str | None, environ: Mapping[str, str]) -> Address:
    """The endpoint to use: the argument, else the environment, else OpenAI's.

    Raises:
        ConfigError: Not an HTTP address, or it carries a secret.
    """
    given = base_url or next((environ[name] for name in _URL_VARIABLES if environ.get(name)), _BASE_URL)
    example = "http://localhost:8000/v1 with --base-url"
    return http_address(given, "The base URL", example=example, key_place=KEY_VARIABLES[0])
