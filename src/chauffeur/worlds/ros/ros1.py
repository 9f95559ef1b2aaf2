"""The vehicle interface for Autoware.AI over ROS 1, spoken to directly."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Final

from chauffeur.concept import Parameters
from chauffeur.worlds.ros import autoware_ai
from chauffeur.worlds.ros.autoware_ai import AutowareAi
from chauffeur.worlds.ros.base import FRESH_S, Fields, Published, RosVehicleState, TopicMessage
from chauffeur.worlds.ros.limits import CheckedWish
from chauffeur.worlds.ros.node import CHECK_S, Ros1Settings, RosNode
from chauffeur.worlds.ros.stack import StackSetpoints
from chauffeur.worlds.ros.types import Types

_PUBLISHED: Final = {
    autoware_ai.REPLANNER_TOPIC: autoware_ai.REPLANNER_TYPE,
    autoware_ai.FOLLOWER_TOPIC: autoware_ai.FOLLOWER_TYPE,
}
_EXPECTED: Final = {autoware_ai.REPLANNER_TOPIC: "waypoint_replanner", autoware_ai.FOLLOWER_TOPIC: "pure_pursuit"}


class Ros1Vehicle:
    """Publishes to `waypoint_replanner` and `pure_pursuit`, reads `/current_velocity`."""

    def __init__(
        self,
        stack: AutowareAi,
        settings: Ros1Settings,
        *,
        clock: Callable[[], float] = time.time,
        check_s: float = CHECK_S,
    ) -> None:
        """Start to look for the master; does not wait for it.

        Args:
            stack: The messages.
            settings: Where to send them.
            clock: Time of day in s, for message headers.
            check_s: Period of looking after the registration.

        Raises:
            VehicleError: The master's URI or our own address cannot be used.
            MissingExtraError: `rosbags` is not installed.
        """
        self._clock = clock
        self._types = Types(1, autoware_ai.DEFINITIONS)
        # `rosbags` prepares a type when it is first used, which takes some 0.2 s; a caller of `apply` is not to wait.
        slowest = CheckedWish(0.0, stack.limits.look_ahead_m[0], stack.limits.look_ahead_ratio_s[0], 0)
        for message in stack.wished(slowest)[0]:
            self._bytes(message, 0)
        self._node = RosNode(
            settings,
            self._types,
            _PUBLISHED,
            (autoware_ai.VELOCITY_TOPIC, autoware_ai.VELOCITY_TYPE),
            known_md5=autoware_ai.KNOWN_MD5,
            expected=_EXPECTED,
            check_s=check_s,
        )
        self._setpoints = StackSetpoints(stack, self._send)
        self._closing = threading.Lock()

    def apply(self, parameters: Parameters) -> Published:
        """See `VehicleInterface.apply`."""
        self._obey()
        return self._setpoints.apply(parameters)

    def release(self) -> Published:
        """See `VehicleInterface.release`."""
        self._obey()
        return self._setpoints.release()

    def state(self) -> RosVehicleState:
        """See `VehicleInterface.state`."""
        link, words = self._node.link()
        if self._closing.locked():
            link, words = "closed", "Closed; the last wish stays in force in the vehicle."
        receivers, delivered = self._node.receivers()
        return RosVehicleState(
            link=link,
            words=words,
            receivers=receivers,
            delivered=delivered and self._setpoints.number > 0,
            speed_mps=self._speed_mps(),
            counts=self._node.notes.counted(),
            notes=self._node.notes.said(),
        )

    def close(self) -> None:
        """See `VehicleInterface.close`. Under a constant speed, the follower is first set back to planned speeds."""
        if self._closing.acquire(blocking=False):  # never released: closed for good
            self._setpoints.end("This vehicle interface is closed.")
            self._node.close()

    def _obey(self) -> None:
        if why := self._node.ended:
            self._setpoints.abandon(why)

    def _send(self, number: int, messages: tuple[TopicMessage, ...]) -> None:
        ready = [(message.topic, self._bytes(message, number)) for message in messages]
        for topic, data in ready:
            self._node.publish(topic, data)
        self._node.notes.count("published")

    def _bytes(self, message: TopicMessage, number: int) -> bytes:
        fields: Fields = message.fields
        if message.stamped:
            now_s = self._clock()
            stamp: Fields = {"sec": int(now_s), "nanosec": int(now_s % 1.0 * 1e9)}
            fields = {"header": {"seq": number, "stamp": stamp, "frame_id": ""}, **fields}
        return self._types.encode(message.type, fields)

    def _speed_mps(self) -> float | None:
        heard = self._node.inlet.newest(FRESH_S) if self._node.inlet is not None else None
        if heard is None:
            return None
        speed = float(heard.twist.linear.x)
        return speed if math.isfinite(speed) else None
