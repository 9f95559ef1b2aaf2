"""All fuzzing targets by name."""

from __future__ import annotations

from importlib import import_module
from typing import Final

from fuzz.target import Target

MODULES: Final = {
    "gate": "gate",
    "verifier": "verifier",
    "interpreter": "interpreter",
    "replies": "replies",
    "screening": "screening",
    "explanations": "explanations",
    "audit-log": "audit_log",
}
"""Target -> module. A module is imported only in the process that fuzzes it, instrumented."""


def target(name: str) -> Target:
    """A target by its name."""
    return import_module(f"fuzz.{MODULES[name]}").TARGET
