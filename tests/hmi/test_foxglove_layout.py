"""The Foxglove layout that ships shows topics and fields that a recording has."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

import chauffeur
from chauffeur.hmi.document import asset

LAYOUT: dict[str, Any] = json.loads(asset("foxglove-layout.json"))


def leaves(node: Any) -> list[str]:
    return [node] if isinstance(node, str) else [*leaves(node["first"]), *leaves(node["second"])]


def test_every_panel_is_laid_out_once() -> None:
    assert sorted(leaves(LAYOUT["layout"])) == sorted(LAYOUT["configById"])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[set[str], dict[str, Any]]:
    file: Path = tmp_path_factory.mktemp("foxglove") / "trip.mcap"
    chauffeur.drive("Change to the left lane.", scenario="overtake", save=file)
    with file.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        topics = {channel.topic for channel in summary.channels.values()}
        first: dict[str, Any] = {}
        for _, channel, message in reader.iter_messages():
            if channel.message_encoding == "json":
                first.setdefault(channel.topic, json.loads(message.data))
    return topics, first


def test_every_topic_and_field_is_recorded(recorded: tuple[set[str], dict[str, Any]]) -> None:
    topics, first = recorded
    shown = [
        *(path["value"] for panel in LAYOUT["configById"].values() for path in panel.get("paths", ())),
        *(panel["topicPath"] for panel in LAYOUT["configById"].values() if "topicPath" in panel),
    ]
    for path in shown:
        topic, *fields = path.split(".")
        value = first[topic]
        for field in fields:
            assert field in value, path
            value = value[field]
    drawn = {topic for panel in LAYOUT["configById"].values() for topic in panel.get("topics", ())}
    assert (
        drawn | {panel["topicToRender"] for panel in LAYOUT["configById"].values() if "topicToRender" in panel}
        <= topics
    )
