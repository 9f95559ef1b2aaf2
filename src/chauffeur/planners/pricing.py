"""What a reply costs, where the price is known.

A short table that is wrong in silence would be worse than none: it names its date, covers one provider's standard
tier without discounts (cached prompts, batches), and answers None for everything else, servers of one's own included.
"""

from __future__ import annotations

import re

PRICES_AS_OF = "2026-03"
PRICES_SOURCE = "OpenAI's published list, standard tier, without cached-prompt or batch discounts"

_HOST = "api.openai.com"

# USD per million tokens: (prompt, completion).
_PRICES: dict[str, tuple[float, float]] = {
    "gpt-3.5-turbo": (0.50, 1.50),
    "gpt-4": (30.00, 60.00),
    "gpt-4-turbo": (10.00, 30.00),
    "gpt-4o": (2.50, 10.00),
    "gpt-4o-mini": (0.15, 0.60),
    "gpt-4.1": (2.00, 8.00),
    "gpt-4.1-mini": (0.40, 1.60),
    "gpt-4.1-nano": (0.10, 0.40),
    "gpt-5": (1.25, 10.00),
    "gpt-5-mini": (0.25, 2.00),
    "gpt-5-nano": (0.05, 0.40),
    "gpt-5.1": (1.25, 10.00),
    "gpt-5.2": (1.75, 14.00),
    "gpt-5.4": (2.50, 15.00),
    "o3": (2.00, 8.00),
    "o3-mini": (1.10, 4.40),
    "o4-mini": (1.10, 4.40),
}

_OBSERVATION = re.compile(r"-\d{4}-\d{2}-\d{2}$")


def cost_usd(host: str, model: str, prompt_tokens: int, completion_tokens: int) -> float | None:
    """Price of a reply in USD, or None where no price is known.

    Args:
        host: Host of the endpoint.
        model: Model id; a dated observation has the price of its model.
        prompt_tokens: Tokens in.
        completion_tokens: Tokens out, reasoning tokens included.
    """
    price = _PRICES.get(_OBSERVATION.sub("", model)) if host == _HOST else None
    if price is None:
        return None
    return (prompt_tokens * price[0] + completion_tokens * price[1]) / 1e6
