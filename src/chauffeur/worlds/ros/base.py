"""The contract of vehicle interfaces: parameters in, published messages out. It knows nothing of language.

A vehicle interface is no `World`: a real vehicle is not stepped, and nothing here actuates. It asks the vehicle's own
planner for a speed cap and a look-ahead; the vehicle's planner, its obstacle stops and its driver keep the last word.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Literal, Protocol, TypeAlias, runtime_checkable

from chauffeur.concept import ChauffeurError, Parameters

FRESH_S: Final = 1.0
"""A velocity older than this is not the present one; vehicles publish it 10 times a second and more."""

Fields: TypeAlias = "dict[str, Value]"
"""Fields of a ROS message by name, in the order of its definition."""

Value: TypeAlias = "bool | int | float | str | Fields"


class VehicleError(ChauffeurError):
    """The vehicle cannot be reached, or what was asked cannot be published."""


class VehicleRefusalError(VehicleError):
    """The parameters are not fit to be published to this vehicle; nothing was published."""


@dataclass(frozen=True, slots=True)
class TopicMessage:
    """One message for one topic, every field filled.

    Attributes:
        topic: Name of the topic, e.g. `/config/waypoint_follower`.
        type: Its type as ROS writes it, e.g. `std_msgs/Bool` (ROS 1) or `std_msgs/msg/Bool` (ROS 2).
        fields: The values, without those that are filled in when it is sent.
        stamped: The field that is filled in first: `header` (ROS 1: number, time, empty frame), `stamp` (ROS 2: time).
    """

    topic: str
    type: str
    fields: Fields = field(hash=False)
    stamped: Literal["", "header", "stamp"] = ""


Asked: TypeAlias = tuple[tuple[TopicMessage, ...], str]
"""Messages to publish, and what they mean in words."""


@dataclass(frozen=True, slots=True)
class Published:
    """Messages that `apply` handed to the vehicle.

    Attributes:
        number: 1 for the first of this interface, 2 for the next, ...
        messages: The messages, in order.
        words: The same in words, for the person and the record.
    """

    number: int
    messages: tuple[TopicMessage, ...]
    words: str


Link = Literal["dry-run", "connecting", "waiting", "up", "refused", "closed"]
"""`connecting`: no graph or server answers (yet, or any more). `waiting`: nobody listens to what is published.
`up`: somebody does. `refused`: who listens expects another message."""


@dataclass(frozen=True, slots=True)
class RosVehicleState:
    """State of the vehicle and of the link to it, at the time of asking.

    Attributes:
        link: How the way to the vehicle is.
        words: The same in words, with the remedy where something is wrong.
        receivers: Who takes what is published: connections or matched readers.
        delivered: Whether every receiver was handed the newest messages; False without receivers.
        speed_mps: The vehicle's own speed; None when it was not heard within the last second.
        mode: The vehicle's mode of operation where it tells one, e.g. `stop` or `autonomous`; else empty.
        counts: Named counters, e.g. ("published", 3).
        notes: The last things worth telling, oldest first.
    """

    link: Link
    words: str
    receivers: int = 0
    delivered: bool = False
    speed_mps: float | None = None
    mode: str = ""
    counts: tuple[tuple[str, int], ...] = ()
    notes: tuple[str, ...] = ()


@runtime_checkable
class VehicleInterface(Protocol):
    """A way to ask a vehicle for parameters. No method waits for the network, but `close` for a bounded time."""

    def apply(self, parameters: Parameters) -> Published:
        """Ask the vehicle for these parameters; newer ones take the place of older ones not yet sent.

        Raises:
            VehicleRefusalError: A value is no number or outside the vehicle's own limits, or the wish cannot be
                published to this vehicle; nothing of it was.
            VehicleError: The interface is closed.
        """
        ...

    def release(self) -> Published:
        """Take the wish back: the vehicle drives as its own planner would. It may become faster by that, so it is
        for a person to call, not for a planner. Raises VehicleError when the interface is closed."""
        ...

    def state(self) -> RosVehicleState:
        """The present state; never waits."""
        ...

    def close(self) -> None:
        """End. The last wish stays in force in the vehicle: a program that ends is no reason to drive faster."""
        ...
