"""No library reports home: switches that have to stand in the environment before a library is first imported.

Chauffeur works offline, and opens no connection that nobody asked for. Some libraries that it uses, or that an extra
brings along, count their users unless told not to. `import chauffeur` comes before every import of theirs, in each
process, and what stands in the environment is handed on to processes started later.
"""

from __future__ import annotations

import os
from collections.abc import MutableMapping
from typing import Final

SWITCHES: Final = {
    "ORT_DISABLE_TELEMETRY": "1",  # onnxruntime 1.31 and later: device, system and path, to its maker's event host
    "HF_HUB_DISABLE_TELEMETRY": "1",  # huggingface_hub, under transformers and faster-whisper
    "ANONYMIZED_TELEMETRY": "False",  # chromadb
    "RAY_USAGE_STATS_ENABLED": "0",  # ray
    "DO_NOT_TRACK": "1",  # what newer tools agree on
}
"""Names and values that the libraries document for "off"."""


def switch_off(environment: MutableMapping[str, str] | None = None) -> None:
    """Turn the telemetry of every library off that has a switch; who has set one deliberately keeps it.

    Args:
        environment: Where the switches are set; this process's own if None.
    """
    where = os.environ if environment is None else environment
    for name, off in SWITCHES.items():
        if not where.get(name):  # some take an empty value for "on"
            where[name] = off
