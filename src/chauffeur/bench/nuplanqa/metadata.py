"""The metadata of samples: which pictures belong to a token, what came before it, and where its cameras are mounted.

NuPlanQA publishes them as a pickle of 343 MB that names classes of nuplan-devkit. It is read with an unpickler that
builds plain containers, NumPy arrays and inert stand-ins for nuplan's classes, and refuses everything else: a pickle
can name any function of this machine. Data sets made here are JSON with the same keys.
"""

from __future__ import annotations

import io
import json
import pickle  # only through the restricted unpickler below
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, cast

from chauffeur.concept import DataError

METADATA_FILES: Final = ("metadata.json", "nuplan_metadata.json", "nuplan_metadata.pkl")
"""Names under which a data set's metadata are looked for beside its questions."""

_PLAIN: Final = frozenset(
    {
        ("builtins", "dict"),
        ("builtins", "list"),
        ("builtins", "set"),
        ("builtins", "tuple"),
        ("builtins", "complex"),
        ("builtins", "bytearray"),
        ("collections", "OrderedDict"),
        ("collections", "defaultdict"),
        ("numpy", "ndarray"),
        ("numpy", "dtype"),
        ("numpy.core.multiarray", "_reconstruct"),
        ("numpy.core.multiarray", "scalar"),
        ("numpy._core.multiarray", "_reconstruct"),
        ("numpy._core.multiarray", "scalar"),
    }
)
"""Names allowed in a pickle besides nuplan's own classes: containers and arrays, none of which runs anything."""


class NuplanStandIn:
    """Takes the place of a class of nuplan-devkit: keeps what it is given and does nothing."""

    def __init__(self, *given: Any) -> None:
        self.given = given

    def __setstate__(self, state: Any) -> None:
        """Keep the state as it is."""
        self.state = state


class _PlainUnpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str, /) -> Any:
        if (module, name) in _PLAIN:
            return super().find_class(module, name)
        if module.partition(".")[0] == "nuplan":
            return NuplanStandIn
        raise DataError(
            f"The pickle names {module}.{name}, which is no part of metadata.",
            hint="Do not open it with pickle: it can run code. Get the file from its authors.",
        )


def load_metadata(path: Path) -> Mapping[str, Mapping[str, Any]]:
    """Metadata by token.

    Raises:
        DataError: There is none, it is of another form, or it is a pickle that names what metadata never hold.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DataError(f"Cannot read the metadata {path}: {error.strerror}.") from error
    if content.startswith(b"version https://git-lfs"):
        raise DataError(f"{path} is a pointer of Git LFS, not the file.", hint="Fetch it: git lfs pull")
    try:
        found: Any = json.loads(content) if path.suffix == ".json" else _PlainUnpickler(io.BytesIO(content)).load()
    except DataError:
        raise
    except Exception as error:  # a damaged pickle can raise anything
        raise DataError(f"The metadata {path} cannot be read: {type(error).__name__}: {error}.") from error
    if isinstance(found, list):
        found = {str(entry.get("token", "")): entry for entry in cast("list[Mapping[str, Any]]", found)}
    if not isinstance(found, dict) or not all(
        isinstance(one, Mapping) for one in cast("dict[str, Any]", found).values()
    ):
        raise DataError(f"The metadata {path} are no mapping of samples by token.")
    return cast("dict[str, Mapping[str, Any]]", found)


def find_metadata(folder: Path) -> Path | None:
    """The metadata file beside a data set's questions; None where there is none."""
    return next((folder / name for name in METADATA_FILES if (folder / name).is_file()), None)
