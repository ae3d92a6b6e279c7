"""Arrays by name and metadata in one .npz: without pickles, so that reading one runs no code."""

import io
import json
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

UNREADABLE = (EOFError, OSError, TypeError, ValueError, NotImplementedError, zipfile.BadZipFile, zlib.error)


def packed(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any], compressed: bool = False) -> bytes:
    """A file's content; `metadata` are plain values, `format` among them. The same values give the same bytes."""
    text = json.dumps(metadata, sort_keys=True, allow_nan=False).encode()
    content = io.BytesIO()
    save = np.savez_compressed if compressed else np.savez
    save(content, metadata=np.frombuffer(text, np.uint8), **arrays)
    return content.getvalue()


def unpacked(path: Path, form: str) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Arrays and metadata of a file of that format; ValueError says what is wrong with it."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except UNREADABLE as error:  # in words of its own: numpy advises to load it unsafely
        raise ValueError("it cannot be read as a .npz of plain arrays") from error
    try:
        metadata = json.loads(bytes(arrays.pop("metadata", np.empty(0, np.uint8))))
    except ValueError as error:
        raise ValueError("it has no metadata in JSON") from error
    found = metadata.get("format") if isinstance(metadata, dict) else None
    if found != form:
        raise ValueError(f"its format is {found!r}; allowed: {form!r}")
    return arrays, metadata
