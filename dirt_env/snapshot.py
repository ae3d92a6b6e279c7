"""Bytes of a tree of plain values and arrays, and back: the same tree gives the same bytes. No pickle, no code."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

MAGIC = b"dirt-push state 1\n"
_ARRAY = "\0array"


def pack(tree: Any) -> bytes:
    """Bytes of nested mappings and sequences of None, bool, int, float, str and arrays (of records too)."""
    arrays: list[np.ndarray] = []
    header = json.dumps(_without_arrays(tree, arrays), sort_keys=True).encode()
    return b"".join([MAGIC, len(header).to_bytes(8, "little"), header, *(array.tobytes() for array in arrays)])


def unpack(data: bytes) -> Any:
    """The tree of `pack`; sequences come back as lists, arrays writeable. Raises ValueError for anything else."""
    if not isinstance(data, bytes | bytearray) or not data.startswith(MAGIC):
        raise ValueError(f"state starts with {data[:20]!r}; allowed: what get_state returned")
    start = len(MAGIC) + 8
    end = start + int.from_bytes(data[len(MAGIC) : start], "little")
    try:
        header = json.loads(data[start:end])
        return _with_arrays(header, memoryview(data)[end:])
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"state of {len(data)} bytes is damaged: {error}") from error


def _without_arrays(tree: Any, arrays: list[np.ndarray]) -> Any:
    """The tree with every array replaced by its description; the arrays are appended to `arrays`."""
    if isinstance(tree, Mapping):
        return {key: _without_arrays(value, arrays) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [_without_arrays(value, arrays) for value in tree]
    if isinstance(tree, np.generic):
        return tree.item()
    if not isinstance(tree, np.ndarray):
        return tree
    offset = sum(array.nbytes for array in arrays)
    arrays.append(np.ascontiguousarray(tree))
    kind = tree.dtype.str if tree.dtype.names is None else [list(field) for field in tree.dtype.descr]
    return {_ARRAY: offset, "dtype": kind, "shape": list(tree.shape)}


def _with_arrays(tree: Any, data: memoryview) -> Any:
    """The inverse of `_without_arrays`, given the arrays' bytes."""
    if isinstance(tree, list):
        return [_with_arrays(value, data) for value in tree]
    if not isinstance(tree, dict):
        return tree
    if _ARRAY not in tree:
        return {key: _with_arrays(value, data) for key, value in tree.items()}
    kind = tree["dtype"]
    dtype = np.dtype(kind) if isinstance(kind, str) else np.dtype((np.record, [tuple(field) for field in kind]))
    count = int(np.prod(tree["shape"], dtype=np.int64))
    return np.frombuffer(data, dtype, count, tree[_ARRAY]).reshape(tree["shape"]).copy()
