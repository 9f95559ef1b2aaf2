"""What a planner's model would be sent, on the terminal."""

from __future__ import annotations

import json

from rich.console import Console
from rich.text import Text

from chauffeur.cli.console import plain
from chauffeur.concept import ConfigError, PlanRequest
from chauffeur.planners.base import Planner, Prompting
from chauffeur.planners.llm_context import tokens_about
from chauffeur.planners.prompts import pictures_in, words_of


def show_prompt(console: Console, planner: Planner, request: PlanRequest) -> None:
    """Print the request that a planner would send, every turn word for word.

    Raises:
        ConfigError: This planner sends no prompt.
    """
    if not isinstance(planner, Prompting):
        raise ConfigError(
            f"The planner {planner.id} sends no prompt.", hint="Name a language model, e.g. --planner openai/gpt-4o."
        )
    prompt = planner.prompt(request)

    def note(text: str) -> None:
        console.print(Text(style="dim").append_text(plain(text)), soft_wrap=True)

    note(f"POST {prompt.url}")
    note(json.dumps(prompt.parameters, ensure_ascii=False))
    for message in prompt.messages:
        words, pictures = words_of(message), pictures_in([message])
        also = f", {pictures} pictures" if pictures else ""
        note(f"----- {message['role']}: {len(words):,} characters, about {tokens_about([message]):,} tokens{also}")
        console.print(plain(words), soft_wrap=True)
    note(f"----- {len(prompt.messages)} turns, about {tokens_about(prompt.messages):,} tokens")
