"""TCPROS framing: headers of `name=value` fields, and messages with their length before them (little endian).

Source: wiki.ros.org/ROS/TCPROS and wiki.ros.org/ROS/Connection Header.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Final

LARGEST_HEADER: Final = 64 * 1024
"""Bytes of a connection header; a message definition of ours takes 1 kB."""

LENGTH: Final = struct.Struct("<I")


class WireError(ValueError):
    """Bytes that are no TCPROS header."""


def frame(data: bytes) -> bytes:
    """The data with its length before it."""
    return LENGTH.pack(len(data)) + data


def header_bytes(fields: Mapping[str, str]) -> bytes:
    """A connection header, with its length."""
    return frame(b"".join(frame(f"{name}={value}".encode()) for name, value in fields.items()))


def header_fields(data: bytes) -> dict[str, str]:
    """Fields of a connection header, given without its length.

    Raises:
        WireError: A field ends beyond the data, holds no `=`, or is no text.
    """
    fields: dict[str, str] = {}
    at = 0
    while at < len(data):
        if at + LENGTH.size > len(data):
            raise WireError("a field's length is cut off")
        (length,) = LENGTH.unpack_from(data, at)
        at += LENGTH.size
        if at + length > len(data):
            raise WireError("a field ends beyond the header")
        try:
            name, equals, value = data[at : at + length].decode().partition("=")
        except UnicodeDecodeError as error:
            raise WireError("a field is no text") from error
        if not equals:
            raise WireError("a field has no value")
        fields[name] = value
        at += length
    return fields
