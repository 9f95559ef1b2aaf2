"""Activations of functions during the analysis: where a name leads."""

from __future__ import annotations

from typing import Final

from chauffeur.programs.verify.scopes import Scope
from chauffeur.programs.verify.values import Key

MODULE: Final = 0
"""Number of the module's frame."""


class CallFrame:
    """An activation of a scope.

    Attributes:
        number: Names its variables.
        scope: What it activates.
        parent: The activation its free names lead to.
        open: Whether nothing is known of its variables, because it stands for any activation.
    """

    __slots__ = ("_places", "number", "open", "parent", "scope")

    def __init__(self, number: int, scope: Scope, parent: CallFrame | None, *, is_open: bool = False) -> None:
        self.number = number
        self.scope = scope
        self.parent = parent
        self.open = is_open
        self._places: dict[str, CallFrame | Key | None] = {}

    def place(self, name: str) -> CallFrame | Key | None:
        """The variable behind a name; its frame where that is open; None for what the text does not bind."""
        if name in self._places:
            return self._places[name]
        found = self._places[name] = self._find(name)
        return found

    def _find(self, name: str) -> CallFrame | Key | None:
        frame: CallFrame | None = self
        while frame is not None:
            if frame.scope.shared.get(name):  # declared global
                while frame.parent is not None:
                    frame = frame.parent
                return frame.number, name
            if name in frame.scope.names:
                return frame if frame.open else (frame.number, name)
            frame = frame.parent
        return None
