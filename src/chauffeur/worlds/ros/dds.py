"""ROS 2 topics over DDS with `cyclonedds` (extra `ros`), without a ROS install: names, types and qualities as in ROS 2.

Source of the names: design.ros2.org/articles/topic_and_service_names.html (`rt/` before a topic) and the type names
of `rosidl` (`package::msg::dds_::Type_`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, cast

from chauffeur.concept import MissingExtraError
from chauffeur.worlds.ros.base import Fields, VehicleError

if TYPE_CHECKING:
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader

Definition = Sequence[tuple[str, str]]
"""(type, name) of each field, in order, with types as a `.msg` file writes them."""

_COMMON: Final[dict[str, Definition]] = {
    "builtin_interfaces/msg/Time": (("int32", "sec"), ("uint32", "nanosec")),
    "std_msgs/msg/Header": (("builtin_interfaces/Time", "stamp"), ("string", "frame_id")),
}

_CONFIG: Final = """<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="{address}"/></Interfaces>
<AllowMulticast>{multicast}</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>120</MaxAutoParticipantIndex>
<Peers>{peers}</Peers></Discovery></Domain></CycloneDDS>"""
"""One network interface and no other; without multicast, participants are looked for at the given peers."""


class Participant:
    """Our membership in a ROS 2 graph."""

    def __init__(
        self, domain: int, address: str, peers: tuple[str, ...], definitions: Mapping[str, Definition]
    ) -> None:
        """Join a domain on one network interface. Takes some 0.1 s.

        Args:
            domain: `ROS_DOMAIN_ID`.
            address: Our own address on the interface to use.
            peers: Addresses to look for others at; empty for multicast.
            definitions: Types by name.

        Raises:
            MissingExtraError: `cyclonedds` is not installed.
            VehicleError: The domain cannot be joined.
        """
        try:
            from cyclonedds.core import DDSException
            from cyclonedds.domain import Domain, DomainParticipant
        except ImportError as error:
            raise MissingExtraError("A ROS 2 vehicle needs cyclonedds.", extra="ros") from error
        config = _CONFIG.format(
            address=address,
            multicast="false" if peers else "true",
            peers="".join(f'<Peer address="{peer}"/>' for peer in peers),
        )
        self._definitions = {**_COMMON, **definitions}
        self._types: dict[str, Any] = {}
        self.faults: Final = DDSException
        try:
            self._domain = Domain(domain, config)
            self._participant = DomainParticipant(domain)
        except DDSException as error:
            raise VehicleError(
                f"DDS domain {domain} cannot be joined on {address}: {error}.",
                hint="Is it this machine's address? One program joins a domain with one setting only.",
            ) from error

    def writer(self, topic: str, type_name: str) -> DataWriter[Any]:
        """A writer that is reliable and keeps its newest message for who comes later."""
        from cyclonedds.core import Policy, Qos
        from cyclonedds.pub import DataWriter
        from cyclonedds.util import duration

        quality = Qos(
            Policy.Reliability.Reliable(max_blocking_time=duration(milliseconds=100)),
            Policy.Durability.TransientLocal,
            Policy.History.KeepLast(1),
            Policy.DataRepresentation(use_cdrv0_representation=True),
        )
        return DataWriter(self._participant, self._topic(topic, type_name), qos=quality)

    def reader(self, topic: str, type_name: str, *, kept: bool) -> DataReader[Any]:
        """A reader of the newest message; `kept`: also of one that was written before (transient local)."""
        from cyclonedds.core import Policy, Qos
        from cyclonedds.sub import DataReader
        from cyclonedds.util import duration

        reliable = Policy.Reliability.Reliable(max_blocking_time=duration(milliseconds=100))
        quality = Qos(
            reliable if kept else Policy.Reliability.BestEffort,
            Policy.Durability.TransientLocal if kept else Policy.Durability.Volatile,
            Policy.History.KeepLast(1),
            Policy.DataRepresentation(use_cdrv0_representation=True),
        )
        return DataReader(self._participant, self._topic(topic, type_name), qos=quality)

    def write(self, writer: DataWriter[Any], type_name: str, fields: Fields) -> None:
        """Write a message; waits 100 ms at most.

        Raises:
            VehicleError: It cannot be written now.
        """
        try:
            writer.write(self.message(type_name, fields))
        except self.faults as error:
            raise VehicleError(f"A {type_name} could not be written: {error}.", retryable=True) from error

    def newest(self, reader: DataReader[Any]) -> Any | None:
        """The newest message not yet taken, if there is one."""
        try:
            taken = reader.take(N=8)
        except self.faults:
            return None
        valid = [sample for sample in taken if sample.sample_info.valid_data]
        return valid[-1] if valid else None

    def message(self, type_name: str, fields: Fields) -> Any:
        """A message as an object, made of fields."""
        inner = {kind_name: kind for kind, kind_name in self._definitions[type_name]}
        values: dict[str, Any] = {}
        for name, value in fields.items():
            kind = inner[name]
            values[name] = self.message(_long_name(kind), cast("Fields", value)) if "/" in kind else value
        return self.type_of(type_name)(**values)

    def type_of(self, name: str) -> Any:
        """The type as a class, made of its definition once."""
        if name not in self._types:
            from cyclonedds.idl import make_idl_struct

            fields = {field: self._kind(kind) for kind, field in self._definitions[name]}
            package, _, short = name.split("/")
            self._types[name] = make_idl_struct(short, f"{package}::msg::dds_::{short}_", fields)
        return self._types[name]

    def close(self) -> None:
        """Leave the domain."""
        del self._participant
        del self._domain

    def _topic(self, topic: str, type_name: str) -> Any:
        from cyclonedds.topic import Topic

        return Topic(self._participant, f"rt{topic}", self.type_of(type_name))

    def _kind(self, kind: str) -> Any:
        from cyclonedds.idl import types

        if "/" in kind:
            return self.type_of(_long_name(kind))
        simple: dict[str, Any] = {"bool": bool, "string": str}
        return simple.get(kind) or getattr(types, kind)


def stamp_of(now_s: float) -> Fields:
    """`builtin_interfaces/Time` of a time of day."""
    return {"sec": int(now_s), "nanosec": int(now_s % 1.0 * 1e9)}


def _long_name(name: str) -> str:
    """`std_msgs/Bool` and `std_msgs/msg/Bool` are one type; the latter is how ROS 2 writes it."""
    package, _, rest = name.partition("/")
    return name if rest.startswith("msg/") else f"{package}/msg/{rest}"
