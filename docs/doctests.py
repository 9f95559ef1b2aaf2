"""Show the examples of docstrings as code: mkdocstrings takes `>>>` outside of a section for quoted text."""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

EXAMPLE = re.compile(r"^>>> .*(?:\n(?!\s*$).*)*", re.MULTILINE)


class Doctests(Extension):
    """Puts each example of a docstring into a fence."""

    def on_instance(self, *, obj: Object, **_: Any) -> None:
        """An object was read."""
        if obj.docstring is not None:
            obj.docstring.value = EXAMPLE.sub(lambda found: f"```pycon\n{found.group()}\n```", obj.docstring.value)
