"""Handing the vehicle to its computer, and taking it back: a person's act, and nobody else's.

`/vehicle/engage` (`std_msgs/Bool`) is the drive-by-wire engage of AutonomouStuff's `ssc_interface` and
`pacmod_interface`, which Autoware.AI vehicles use. Nothing that turns a model's output into messages imports this
module, no parameter reaches it, and only the `chauffeur vehicle` command calls it (`tests/worlds/test_ros_laws.py`).
On Autoware (ROS 2) the vehicle is engaged on its own screen; no function here does it.
"""

from __future__ import annotations

import secrets
import time
from dataclasses import replace
from typing import Final

from chauffeur.worlds.ros.base import VehicleError
from chauffeur.worlds.ros.node import Ros1Settings, RosNode
from chauffeur.worlds.ros.types import Types

ENGAGE_TOPIC: Final = "/vehicle/engage"
ENGAGE_TYPE: Final = "std_msgs/Bool"

WORDS: Final = ("harbour", "lantern", "meadow", "orchard", "pebble", "saddle", "thimble", "willow")
"""One of these is shown and has to be typed: a hand on the keyboard, and eyes on the screen."""


def word_to_type() -> str:
    """A word for the person to type, another one each time."""
    return secrets.choice(WORDS)


def engage(settings: Ros1Settings, shown: str, typed: str, *, within_s: float = 5.0) -> int:
    """Engage drive-by-wire, once.

    Args:
        settings: Where the vehicle is.
        shown: The word the person was shown.
        typed: The word they typed.
        within_s: How long to look for the vehicle.

    Returns:
        How many nodes took it.

    Raises:
        VehicleError: Another word was typed, or no node took it in time.
    """
    if shown not in WORDS or typed != shown:
        raise VehicleError("That is another word; the vehicle was not engaged.")
    return _tell(settings, True, within_s)


def disengage(settings: Ros1Settings, *, within_s: float = 5.0) -> int:
    """Give the vehicle back to its driver, once; see `engage`. Nothing has to be typed for it.

    Raises:
        VehicleError: No node took it in time.
    """
    return _tell(settings, False, within_s)


def _tell(settings: Ros1Settings, engaged: bool, within_s: float) -> int:
    types = Types(1, {})
    # A name of its own: a second node of one name ends the first.
    node = RosNode(
        replace(settings, node=""), types, {ENGAGE_TOPIC: ENGAGE_TYPE}, expected={ENGAGE_TOPIC: "ssc_interface"}
    )
    try:
        node.publish(ENGAGE_TOPIC, types.encode(ENGAGE_TYPE, {"data": engaged}))
        end_s = time.monotonic() + within_s
        while time.monotonic() < end_s and not node.ended:
            receivers, delivered = node.receivers()
            if delivered:
                return receivers
            time.sleep(0.02)
        raise VehicleError(f"Nobody took it within {within_s:g} s. {node.link()[1]}")
    finally:
        node.close()
