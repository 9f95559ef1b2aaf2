"""ROS message types: checksums and bytes, by `rosbags` (extra `ros`), from field lists instead of a ROS install."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, Final, Literal

from chauffeur.concept import MissingExtraError
from chauffeur.worlds.ros.base import Fields, VehicleError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

Definition = Sequence[tuple[str, str]]
"""(type, name) of each field, in order, with types as a `.msg` file writes them."""

_MALFORMED: Final = (
    ValueError,
    KeyError,
    IndexError,
    TypeError,
    AttributeError,
    AssertionError,
    OverflowError,
    MemoryError,
    struct.error,
)
"""What unfit values and damaged bytes raise inside `rosbags`."""


class Types:
    """Types of one ROS generation, and of the vehicle's own packages."""

    def __init__(self, ros: Literal[1, 2], definitions: Mapping[str, Definition]) -> None:
        """Register definitions by type name.

        Raises:
            MissingExtraError: `rosbags` is not installed.
        """
        frozen = tuple((name, tuple(definition)) for name, definition in definitions.items())
        self.ros: Final = ros
        self._store, self._unfit = _store_of(ros, frozen)

    def md5(self, name: str) -> str:
        """ROS 1 checksum of a type: both ends of a connection must have the same."""
        return self._store.generate_msgdef(long_name(name), ros_version=1)[1]

    def definition(self, name: str) -> str:
        """Full text of a type, as a ROS 1 connection states it."""
        return self._store.generate_msgdef(long_name(name), ros_version=1)[0]

    def encode(self, name: str, fields: Fields) -> bytes:
        """Bytes of a message.

        Raises:
            VehicleError: A field is missing, unknown or of another kind.
        """
        try:
            message = self._build(long_name(name), fields)
            serialize = self._store.serialize_ros1 if self.ros == 1 else self._store.serialize_cdr
            return bytes(serialize(message, long_name(name)))
        except self._unfit as error:
            raise VehicleError(f"A {name} cannot be made of these values: {error}.") from error

    def decode(self, name: str, data: bytes) -> Any:
        """The message in bytes that came from elsewhere.

        Raises:
            VehicleError: They are none.
        """
        try:
            deserialize = self._store.deserialize_ros1 if self.ros == 1 else self._store.deserialize_cdr
            return deserialize(data, long_name(name))
        except self._unfit as error:
            raise VehicleError(f"{len(data)} bytes that are no {name}: {error!r}.") from error

    def _build(self, name: str, fields: Fields) -> Any:
        wanted = [(field, kind) for field, kind in self._store.fielddefs[name][1]]
        if {field for field, _ in wanted} != set(fields):
            missing = sorted({field for field, _ in wanted} ^ set(fields))
            raise ValueError(f"fields {', '.join(missing)} are missing or unknown")
        values: dict[str, Any] = {}
        for field, (category, inner) in wanted:
            value = fields[field]
            values[field] = self._build(str(inner), value) if isinstance(value, dict) and int(category) == 2 else value
        return self._store.types[name](**values)


@cache
def _store_of(
    ros: Literal[1, 2], definitions: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
) -> tuple[Typestore, tuple[type[Exception], ...]]:
    """The types of `rosbags` with ours among them, and what unfit values raise. Made once: it takes some 0.1 s."""
    try:
        from rosbags.serde.errors import SerdeError
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError as error:
        raise MissingExtraError("A ROS vehicle needs rosbags.", extra="ros") from error
    store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_HUMBLE)
    for name, definition in definitions:
        text = "".join(f"{kind} {field}\n" for kind, field in definition)
        store.register(get_types_from_msg(text, long_name(name)))
    return store, (*_MALFORMED, SerdeError)


def long_name(name: str) -> str:
    """`std_msgs/Bool` and `std_msgs/msg/Bool` are one type; the latter is how ROS 2 and `rosbags` write it."""
    package, _, rest = name.partition("/")
    return name if rest.startswith("msg/") else f"{package}/msg/{rest}"
