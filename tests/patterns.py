"""Prints every regular expression of the package: those compiled by its modules, and those written where they are used.

Run on its own: it has to stand between `re` and the modules before they are imported.
"""

from __future__ import annotations

import ast
import importlib
import json
import pkgutil
import re
import sys
from pathlib import Path
from typing import Any

OWN_TEXTS = ("chauffeur.models.",)
"""Rooms whose patterns read nothing but texts of our own: what training is made of."""


def main() -> None:
    found: dict[tuple[str, int], str] = {}
    compile_: Any = re.compile

    def compiling(pattern: Any, flags: Any = 0) -> Any:
        made = compile_(pattern, flags)
        module = sys._getframe(1).f_globals.get("__name__", "")
        if module.startswith("chauffeur.") and isinstance(made.pattern, str):
            found.setdefault((made.pattern, int(made.flags)), module)
        return made

    re.compile = compiling
    import chauffeur

    for module in pkgutil.walk_packages(chauffeur.__path__, "chauffeur."):
        if not module.name.startswith(OWN_TEXTS) and not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    for path in Path(chauffeur.__file__).parent.rglob("*.py"):
        name = ".".join(("chauffeur", *path.relative_to(Path(chauffeur.__file__).parent).with_suffix("").parts))
        if name.startswith(OWN_TEXTS):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            match node:
                case ast.Call(
                    func=ast.Attribute(value=ast.Name("re"), attr=used), args=[ast.Constant(str() as pattern), *_]
                ) if used not in ("compile", "escape"):
                    found.setdefault((pattern, int(compile_(pattern).flags)), name)
                case _:
                    pass
    print(json.dumps([[module, pattern, flags] for (pattern, flags), module in sorted(found.items())]))


if __name__ == "__main__":
    main()
