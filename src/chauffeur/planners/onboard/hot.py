"""The model in use, exchanged while the planner runs: a pointer names its folder, and is looked at between requests."""

from __future__ import annotations

import logging
import os
import secrets
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from chauffeur.concept import DataError, Plan, PlanRequest
from chauffeur.memory.files import sync_directory
from chauffeur.planners.onboard.engine import Engine
from chauffeur.planners.onboard.language_model import LanguageModelPlanner
from chauffeur.planners.onboard.prompt import prompt

_log = logging.getLogger(__name__)


def take_into_use(pointer: Path, folder: Path) -> None:
    """Make a pointer name a model folder, in one step; what it named before stays where it is.

    Raises:
        DataError: The pointer is no symbolic link, or cannot be made.
    """
    draft = pointer.with_name(f".{pointer.name}.{secrets.token_hex(4)}")
    try:
        for path in folder.iterdir():
            with path.open("rb") as file:
                os.fsync(file.fileno())
        sync_directory(folder)
        draft.symlink_to(os.path.relpath(folder.resolve(), pointer.parent.resolve()), target_is_directory=True)
        draft.replace(pointer)
        sync_directory(pointer.parent)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise DataError(f"{pointer} cannot be made to name {folder}: {error.strerror or error}.") from error


def opened(folder: Path) -> Engine:
    """A model, loaded and tried out: a graph that loads may still not run.

    Raises:
        DataError: It cannot be read.
        MissingExtraError: A library is missing.
    """
    engine = Engine(folder)
    engine.write(prompt(None, (), "drive faster"))
    return engine


Model = TypeVar("Model")


class HotModel(Generic[Model]):
    """What was loaded from the folder that a pointer names, and loaded anew once the pointer names another.

    `current` is asked before a request, and what it gives serves that request to its end. A model that cannot be opened
    is logged and not tried again until the pointer moves; the one before goes on.
    """

    def __init__(self, pointer: Path, open_model: Callable[[Path], Model], otherwise: Path | None = None) -> None:
        """Open what the pointer names now.

        Args:
            pointer: Symbolic link to a model folder, e.g. `out/current`.
            open_model: Loads a folder, e.g. `opened` or `LanguageModelPlanner`.
            otherwise: Folder that is used as long as there is no pointer.

        Raises:
            DataError: There is no model there, or it cannot be read.
        """
        self._pointer = pointer
        self._open = open_model
        self._otherwise = otherwise
        self._guard = threading.Lock()
        self._tried = self._target()
        self._model = open_model(self._tried)

    def current(self) -> Model:
        """The model to serve the next request."""
        with self._guard:
            try:
                target = self._target()
                if target != self._tried:
                    self._tried = target
                    self._model = self._open(target)
                    _log.info("the on-board model is now %s", target)
            except Exception as error:  # noqa: BLE001 - whatever is wrong with the new model, the old one drives on
                _log.warning("the on-board model was not exchanged: %s", error)
            return self._model

    def _target(self) -> Path:
        if self._otherwise is not None and not self._pointer.is_symlink() and not self._pointer.exists():
            return self._otherwise.resolve()
        try:
            return self._pointer.resolve(strict=True)
        except (OSError, RuntimeError) as error:
            raise DataError(f"{self._pointer} names no model: {error}.") from error


class HotPlanner:
    """The on-board planner over whichever model is in use; the change is noticed between two requests."""

    def __init__(self, pointer: Path, otherwise: Path | None = None) -> None:
        """As `HotModel`."""
        self._hot = HotModel(pointer, _tried_planner, otherwise)

    @property
    def id(self) -> str:
        """Registry name."""
        return "onboard"

    @property
    def model(self) -> str:
        """Version of the model that would answer now."""
        return self._hot.current().model

    async def plan(self, request: PlanRequest) -> Plan:
        """As `LanguageModelPlanner.plan`."""
        return await self._hot.current().plan(request)


def _tried_planner(folder: Path) -> LanguageModelPlanner:
    return LanguageModelPlanner(opened(folder))
