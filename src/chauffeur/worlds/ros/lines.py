"""Messages as the command lines that would publish the same, for people to read. Nothing here runs them."""

from __future__ import annotations

import json
import shlex
from typing import Literal

from chauffeur.worlds.ros.base import TopicMessage, Value


def command_line(message: TopicMessage, ros: Literal[1, 2] = 1) -> str:
    """`rostopic pub` (or `ros2 topic pub`) of one message, quoted for a shell.

    `header: auto` and `stamp: now` are the tools' own words for what is filled in when the message is sent.
    """
    fields = [f"{name}: {_yaml(value)}" for name, value in message.fields.items()]
    if message.stamped:
        fields.insert(0, f"{message.stamped}: {'auto' if message.stamped == 'header' else 'now'}")
    text = shlex.quote("{" + ", ".join(fields) + "}")
    if ros == 1:
        return f"rostopic pub -1 {message.topic} {message.type} {text}"
    quality = "--qos-reliability reliable --qos-durability transient_local"
    return f"ros2 topic pub --once {quality} {message.topic} {message.type} {text}"


def _yaml(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name}: {_yaml(one)}" for name, one in value.items()) + "}"
    return json.dumps(value)  # numbers as they are, text in double quotes: YAML reads both
