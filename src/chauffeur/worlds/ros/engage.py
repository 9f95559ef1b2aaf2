"""Handing the vehicle to its computer, and taking it back: a person's act, and nobody else's.

`/vehicle/engage` (`std_msgs/Bool`) is the drive-by-wire engage of AutonomouStuff's `ssc_interface` and
`pacmod_interface`, which Autoware.AI vehicles use. Nothing that turns a model's output into messages imports this
module, no parameter reaches it, and only the `chauffeur vehicle` command calls it (`tests/worlds/test_ros_laws.py`).
On Autoware (ROS 2) the vehicle is engaged on its own screen; no function here does it.

rosbridge acknowledges nothing; `rosapi`, which is started with it, names the nodes that listen. Engaging is published
only once one does: the message is latched, and must not wait in the server for a node that starts later.
"""

from __future__ import annotations

import json
import secrets
import time
from typing import TYPE_CHECKING, Any, Final

from chauffeur.worlds.ros.base import VehicleError
from chauffeur.worlds.ros.rosbridge import RosbridgeSettings, bridged, needs_websockets

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection

ENGAGE_TOPIC: Final = "/vehicle/engage"
ENGAGE_TYPE: Final = "std_msgs/Bool"

WORDS: Final = ("harbour", "lantern", "meadow", "orchard", "pebble", "saddle", "thimble", "willow")
"""One of these is shown and has to be typed: a hand on the keyboard, and eyes on the screen."""


_ASK_AGAIN_S: Final = 0.1
"""Pause between two questions who listens: a subscriber needs some 10 ms to be known to the ROS master."""

_LOOK: Final = "Look at the vehicle before anything else, and use its own switch."


def word_to_type() -> str:
    """A word for the person to type, another one each time."""
    return secrets.choice(WORDS)


def engage(settings: RosbridgeSettings, shown: str, typed: str, *, within_s: float = 5.0) -> int:
    """Engage drive-by-wire, once.

    Args:
        settings: Where the vehicle's rosbridge server is.
        shown: The word the person was shown.
        typed: The word they typed.
        within_s: How long to look for a node that listens, s.

    Returns:
        How many nodes listen to it.

    Raises:
        VehicleError: Another word was typed, the server cannot be reached, or no node listens in time.
        MissingExtraError: `websockets` is not installed.
    """
    if shown not in WORDS or typed != shown:
        raise VehicleError("That is another word; the vehicle was not engaged.")
    return _tell(settings, True, within_s)


def disengage(settings: RosbridgeSettings, *, within_s: float = 5.0) -> int:
    """Give the vehicle back to its driver, once; see `engage`. Nothing has to be typed for it.

    Raises:
        VehicleError: The server cannot be reached, or no node listens in time.
        MissingExtraError: `websockets` is not installed.
    """
    return _tell(settings, False, within_s)


def _tell(settings: RosbridgeSettings, engaged: bool, within_s: float) -> int:
    needs_websockets()
    from websockets.exceptions import WebSocketException

    end_s = time.monotonic() + within_s
    topic = {"topic": ENGAGE_TOPIC, "type": ENGAGE_TYPE}
    try:
        with bridged(settings.url) as bridge:
            bridge.send(json.dumps({"op": "advertise", "id": "advertise", **topic, "latch": True, "queue_size": 1}))
            message = json.dumps({"op": "publish", "id": "publish", **topic, "msg": {"data": engaged}})
            if not engaged:
                bridge.send(message)
            while time.monotonic() < end_s:
                if listeners := _listeners(bridge, end_s):
                    if engaged:
                        bridge.send(message)
                    return listeners
                time.sleep(_ASK_AGAIN_S)
    except (OSError, WebSocketException, ValueError) as error:
        raise VehicleError(f"The rosbridge server at {settings.url} did not take it: {error}.") from error
    raise VehicleError(
        f"No node listens to {ENGAGE_TOPIC} within {within_s:g} s; is ssc_interface running?", hint=_LOOK
    )


def _listeners(bridge: ClientConnection, end_s: float) -> int:
    """Number of nodes that subscribe to the topic, by `rosapi`."""
    asked = {"op": "call_service", "id": "who", "service": "/rosapi/subscribers", "args": {"topic": ENGAGE_TOPIC}}
    bridge.send(json.dumps(asked))
    while True:
        said: Any = json.loads(bridge.recv(timeout=max(0.0, end_s - time.monotonic())))
        match said:
            case {"op": "status", "level": "error", "msg": words}:
                raise VehicleError(f"The rosbridge server refuses: {str(words)[:300]}", hint=_LOOK)
            case {"op": "service_response", "id": "who", "result": True, "values": {"subscribers": [*nodes]}}:
                return len(nodes)
            case {"op": "service_response", "id": "who"}:
                raise VehicleError(
                    "The rosbridge server cannot say who listens: rosapi does not answer.",
                    hint=f"Start rosapi beside rosbridge_server. {_LOOK}",
                )
            case _:
                continue
