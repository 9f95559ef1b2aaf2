"""Reading a ring whose numbers somebody has scribbled over: neither deaf for ever, nor hearing old messages anew."""

from __future__ import annotations

import mmap
import os
import struct

import pytest

from chauffeur.driving.live.ring import Reader, Ring

HEAD_AT = 64


@pytest.fixture
def ring(tmp_path):
    with Ring(tmp_path / "ring", 8, 64, create=True) as made:
        yield made


def scribble(path, number: int) -> None:
    handle = os.open(path, os.O_RDWR)
    with mmap.mmap(handle, 0) as memory:
        struct.pack_into("=Q", memory, HEAD_AT, number)
    os.close(handle)


def heard(reader: Reader) -> list[bytes]:
    return [message.payload for message in reader.news()[0]]


def test_it_reads_each_message_once(ring) -> None:
    reader = Reader(ring)
    ring.write(b"one")
    ring.write(b"two")
    assert heard(reader) == [b"one", b"two"]
    assert heard(reader) == []
    for number in range(20):
        ring.write(b"%d" % number)
    messages, lost = reader.news()
    assert [message.payload for message in messages] == [b"%d" % number for number in range(12, 20)]
    assert lost == 12


def test_what_was_there_before_is_read_on_demand_only(ring) -> None:
    ring.write(b"old")
    assert heard(Reader(ring)) == []
    assert heard(Reader(ring, old=True)) == [b"old"]


@pytest.mark.parametrize("number", [1 << 40, (1 << 62) + 5, 2, 0])
def test_a_scribbled_number_makes_it_neither_deaf_nor_repeat(ring, tmp_path, number: int) -> None:
    reader = Reader(ring)
    for k in range(6):
        ring.write(b"old %d" % k)
    assert len(heard(reader)) == 6
    scribble(tmp_path / "ring", number)
    assert heard(reader) == []
    ring.write(b"new")
    assert heard(reader) == [b"new"]


def test_a_new_writer_that_counts_anew_is_heard(ring, tmp_path) -> None:
    reader = Reader(ring)
    for k in range(6):
        ring.write(b"old %d" % k)
    assert len(heard(reader)) == 6
    scribble(tmp_path / "ring", 1 << 63)
    with Ring(tmp_path / "ring", 8, 64) as other:
        other.write(b"from the new one")
    assert heard(reader) == [b"from the new one"]


def test_another_writers_message_with_the_newest_number_does_not_hide_the_real_one(ring, tmp_path) -> None:
    reader = Reader(ring)
    with Ring(tmp_path / "ring", 8, 64) as intruder:
        intruder.write(b"false")
    assert heard(reader) == [b"false"]
    ring.write(b"true")  # the same number once more
    assert heard(reader) == [b"true"]


def test_a_message_from_the_far_future_is_not_believed_and_hides_nothing(ring) -> None:
    reader = Reader(ring)
    ring.write(b"false", now_ns=(1 << 62))
    assert heard(reader) == []
    ring.write(b"true")
    assert heard(reader) == [b"true"]


def test_a_ring_whose_mark_was_scribbled_over_can_be_opened_after_renewal(ring, tmp_path) -> None:
    path = tmp_path / "ring"
    with path.open("r+b") as file:
        file.write(b"\0" * 16)
    ring.renew()
    with Ring(path, 8, 64) as again:
        assert again.head == 0
