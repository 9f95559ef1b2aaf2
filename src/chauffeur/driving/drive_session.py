"""A drive that one talks with, over any transport: wishes in, `DriveEvent`s out.

`Talk` drives simulated cars in processes of their own, in real time; `VehicleSession` a vehicle behind ROS. What words
come to before any planner is asked stands here alone (`enter`), and so does who hears of the drive (`subscribe`).
"""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Final, Literal

from chauffeur.concept import PersonId, Result
from chauffeur.driving.emergency import ALARM_WORDS, GOING_ON, question_to
from chauffeur.driving.events import DriveEvent, Listener
from chauffeur.driving.questions import NOT_MEANT, NOTHING_ASKED
from chauffeur.driving.recorder import DriveRecorder
from chauffeur.language.emergency import SAFE_STOP_WISH, Emergency, read_emergency
from chauffeur.language.meaning.reader import read
from chauffeur.language.meaning.turns import answer_in, cancels, takes_back
from chauffeur.language.questions import ends_session

NO_SHOULDER_HERE: Final = "There is no shoulder here."
NEVER_MIND: Final = "Never mind."
"""What `cancel` says for the person."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Entrance:
    """What words come to before any planner.

    Attributes:
        way: `stop`: at once; `distress`: the person is asked; `go_on`: no stop, as they said; `yes`, `no`: to the car's
            open question; `leave`: the session ends; `nothing`: there is nothing to take back; `opinion`: on what was
            driven; `wish`: a planner's business.
        words: Told at once; empty for an opinion and a wish, and for a stop that needs no reason.
        offer: Wish that a yes to the words stands for; empty for none.
        result: What became of it, where that is all.
    """

    way: Literal["stop", "distress", "go_on", "yes", "no", "leave", "nothing", "opinion", "wish"]
    words: str = ""
    offer: str = ""
    result: Result = Result.DONE


class DriveSession(ABC):
    """Takes what a person says and does, and tells what becomes of it to whoever subscribes.

    Attributes:
        leaving: What is told when the person ends the session.
    """

    leaving: str = "You end the session."

    def __init__(self, person: PersonId, books: DriveRecorder | None) -> None:
        """Nothing is driven yet.

        Args:
            person: Whose wishes they are.
            books: Audit log, told before all others; None for none.
        """
        self._person, self._books = person, books
        self._listeners: list[Listener] = []

    # In ---------------------------------------------------------------------------------------------------------------

    @abstractmethod
    def ask(self, text: str) -> Any:
        """Take a wish, in the person's words; what a transport returns says how to wait for its answer."""

    @abstractmethod
    def feedback(self, text: str) -> Any:
        """Keep what the person says of the drive; a stop in it stops."""

    @abstractmethod
    def take_over(self, on: bool) -> None:
        """The person takes the wheel, or gives it back. Raises ConfigError: the transport has no wheel to give."""

    @abstractmethod
    def close(self) -> Any:
        """End the session. May be called twice."""

    def stop(self) -> Any:
        """Bring the car to a stand: by the same entrance as the word."""
        return self.ask(ALARM_WORDS["stop"])

    def cancel(self) -> Any:
        """Take the present wish back."""
        return self.ask(NEVER_MIND)

    # Out --------------------------------------------------------------------------------------------------------------

    def subscribe(self, listener: Listener) -> None:
        """Have every event from now on told to a listener, which must not block."""
        self._listeners.append(listener)

    def _tell(self, event: DriveEvent) -> None:
        if self._books is not None:
            self._books.tell(event)
        for listener in self._listeners:
            try:
                listener(event)
            except Exception:  # noqa: BLE001 - a listener must not take the drive with it
                _log.exception("an event could not be told")

    # The entrance -----------------------------------------------------------------------------------------------------

    def enter(self, text: str) -> Entrance:
        """What words come to before any planner is asked: the first of these that holds."""
        found = read_emergency(text)
        if found is not None and (urgent := self._urgent(found)) is not None:
            return urgent
        if self._question_is_open and (answer := answer_in(text)) is not None:
            return Entrance("yes") if answer else Entrance("no", NOT_MEANT, result=Result.DECLINED)
        if ends_session(text):
            return Entrance("leave", self.leaving)
        if takes_back(text) and not self._question_is_open and not self._takes_back(cancels(text)):
            return Entrance("nothing", NOTHING_ASKED)
        if self._was_driven and read(text).address == "feedback":
            return Entrance("opinion")
        return Entrance("wish")

    def _urgent(self, found: Emergency) -> Entrance | None:
        """What is certain whoever has the wheel and whatever is planned; None where it is a planner's business."""
        match found.kind:
            case "stop":
                return Entrance("stop")
            case "safe_stop" if not self._reaches_shoulder():
                return Entrance("stop", NO_SHOULDER_HERE)
            case "ask":
                return Entrance("distress", question_to(found), SAFE_STOP_WISH, Result.ASKED_BACK)
            case "no_stop" if found.alone and not self._stops_by_plan():
                return Entrance("go_on", GOING_ON)
            case _:
                return None

    @property
    @abstractmethod
    def _question_is_open(self) -> bool:
        """Whether the car waits for a yes or no."""

    @property
    @abstractmethod
    def _was_driven(self) -> bool:
        """Whether something was driven that there can be an opinion on."""

    @abstractmethod
    def _takes_back(self, cancelled: bool) -> bool:
        """Whether there is a wish to take back: one without a plan, or any where it is `cancelled`."""

    def _reaches_shoulder(self) -> bool:
        """Whether a shoulder can be reached from here, as far as is known."""
        return True

    def _stops_by_plan(self) -> bool:
        """Whether the plan that is driven brings the car to a stand."""
        return False
