"""Prompts: S from templates, and C, H, I and earlier rounds as a conversation of quoted data."""

from chauffeur.planners.prompts.blocks import data_block
from chauffeur.planners.prompts.system import PROMPT_VERSION, Setting, build_system_message, describe_limits
from chauffeur.planners.prompts.turns import Message, build_messages, repair_turns, wish_turn

__all__ = [
    "PROMPT_VERSION",
    "Message",
    "Setting",
    "build_messages",
    "build_system_message",
    "data_block",
    "describe_limits",
    "repair_turns",
    "wish_turn",
]
