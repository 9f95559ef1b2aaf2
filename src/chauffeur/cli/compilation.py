"""Says what is being compiled: on its first drive a machine compiles the simulator, which takes about half a minute."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import TracebackType
from typing import Any, Final, Self

_EVENT: Final = "numba:compile"

Progress = Callable[[int, int], None]


class CompilationNotice:
    """Tells, as a context manager, how many functions of Chauffeur are compiled, of how many; nothing where all are."""

    def __init__(self, tell: Progress) -> None:
        """Args: called before and after each compiled function with (done, of how many)."""
        from numba.core import event

        self._event: Any = event
        self._tell = tell
        self._done: set[int] = set()
        self._kernels: frozenset[int] = frozenset()
        listener = type("_Listener", (event.Listener,), {"on_start": self._on_start, "on_end": self._on_end})
        self._listener: Any = listener()

    def __enter__(self) -> Self:
        self._event.register(_EVENT, self._listener)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._event.unregister(_EVENT, self._listener)

    def _on_start(self, event: Any) -> None:
        self._kernels = self._kernels or _kernels()
        if id(event.data["dispatcher"]) in self._kernels:
            self._tell(len(self._done), len(self._kernels))

    def _on_end(self, event: Any) -> None:
        kernel = id(event.data["dispatcher"])
        if kernel in self._kernels:
            self._done.add(kernel)
            self._tell(len(self._done), len(self._kernels))


def _kernels() -> frozenset[int]:
    """All compiled functions of the package that are loaded."""
    from numba.core.dispatcher import Dispatcher

    modules = [module for name, module in sorted(sys.modules.items()) if name.startswith("chauffeur.")]
    return frozenset(id(one) for module in modules for one in vars(module).values() if isinstance(one, Dispatcher))
