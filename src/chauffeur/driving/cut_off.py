"""What stands in an MCAP file that was cut off: a full disk, a lost connection, a process that was killed.

MCAP is made to be read from front to back, so that everything before the cut is whole; of the chunk that was cut, the
records before it are.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final

from mcap.opcode import Opcode
from mcap.records import Chunk

MAGIC: Final = b"\x89MCAP0\r\n"
_HEAD: Final = struct.Struct("<BQ")
"""Opcode and length of a record."""
_CHUNK_HEAD: Final = struct.Struct("<QQQII")
"""Of a chunk: first and last time, size unpacked, CRC of that, length of the name of the compression."""
_DATA_END: Final = _HEAD.pack(Opcode.DATA_END, 4) + bytes(4)


@dataclass(frozen=True, slots=True)
class CutFile:
    """A file that ends before its data do.

    Attributes:
        whole: Its whole records, with an end put behind them.
        chunk: The chunk that it was cut in, as far as it stands there; None where it was cut elsewhere.
    """

    whole: bytes
    chunk: Chunk | None


def cut_file(data: bytes) -> CutFile | None:
    """What stands of a file that was cut off; None where its data section is whole, or it is no MCAP file at all."""
    if MAGIC.startswith(data):
        return CutFile(MAGIC + _DATA_END, None)
    if not data.startswith(MAGIC) or (data.endswith(MAGIC) and len(data) > len(MAGIC)):
        return None
    at = len(MAGIC)
    while at + _HEAD.size <= len(data):
        opcode, length = _HEAD.unpack_from(data, at)
        if at + _HEAD.size + length > len(data):
            chunk = _part_of_chunk(data[at + _HEAD.size :]) if opcode == Opcode.CHUNK else None
            return CutFile(data[:at] + _DATA_END, chunk)
        if opcode == Opcode.DATA_END:
            return None
        at += _HEAD.size + length
    return CutFile(data[:at] + _DATA_END, None)


def whole_records(data: bytes) -> bytes:
    """The records of a chunk's content that are whole, from its front."""
    at = 0
    while at + _HEAD.size <= len(data):
        end = at + _HEAD.size + _HEAD.unpack_from(data, at)[1]
        if end > len(data):
            break
        at = end
    return data[:at]


def _part_of_chunk(content: bytes) -> Chunk | None:
    if len(content) < _CHUNK_HEAD.size:
        return None
    start, end, size, _, length = _CHUNK_HEAD.unpack_from(content)
    at = _CHUNK_HEAD.size + length
    return Chunk(
        compression=content[_CHUNK_HEAD.size : at].decode("ascii", "replace"),
        data=content[at + 8 :],
        message_end_time=end,
        message_start_time=start,
        uncompressed_crc=0,
        uncompressed_size=size,
    )
