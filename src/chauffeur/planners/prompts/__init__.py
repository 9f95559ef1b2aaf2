"""Prompts: S from templates, and C, H, I and earlier rounds as a conversation of quoted data."""

from chauffeur.planners.prompts.blocks import data_block
from chauffeur.planners.prompts.coached import (
    COACHED_PROMPT_VERSION,
    DESCRIPTION_SENTENCES,
    Helper,
    build_coached_message,
    description_messages,
)
from chauffeur.planners.prompts.system import Setting, build_system_message, describe_limits
from chauffeur.planners.prompts.turns import Message, build_messages, pictures_in, repair_turns, wish_turn, words_of

__all__ = [
    "COACHED_PROMPT_VERSION",
    "DESCRIPTION_SENTENCES",
    "Helper",
    "Message",
    "Setting",
    "build_coached_message",
    "build_messages",
    "build_system_message",
    "data_block",
    "describe_limits",
    "description_messages",
    "pictures_in",
    "repair_turns",
    "wish_turn",
    "words_of",
]
