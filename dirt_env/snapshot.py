"""Bytes of a tree of plain values and arrays, and back: the same tree gives the same bytes. No pickle, no code."""

import json
from collections.abc import Mapping
from hashlib import sha256
from sys import float_info
from typing import Any

import numpy as np

MAGIC = b"dirt-push state 5\n"
_BODY = len(MAGIC) + sha256().digest_size  # the magic, the body's checksum, the body
_ARRAY = "\0array"
_UNREADABLE = (ArithmeticError, LookupError, RecursionError, SyntaxError, TypeError, ValueError)


def pack(tree: Any) -> bytes:
    """Bytes of nested mappings and sequences of None, bool, int, float, str and arrays (of records too)."""
    arrays: list[np.ndarray] = []
    header = json.dumps(_without_arrays(tree, arrays), sort_keys=True).encode()
    body = b"".join([len(header).to_bytes(8, "little"), header, *(array.tobytes() for array in arrays)])
    return MAGIC + sha256(body).digest() + body


def unpack(data: bytes) -> Any:
    """The tree of `pack`; sequences come back as lists, arrays writeable. Raises ValueError for anything else."""
    if not isinstance(data, bytes | bytearray):
        raise ValueError(f"state is a {type(data).__name__}; allowed: the bytes that get_state returned")
    if not data.startswith(MAGIC):
        start = bytes(data[: len(MAGIC)])
        raise ValueError(f"state is damaged or of another version: it starts with {start!r}; allowed: {MAGIC!r}")
    body = memoryview(data)[_BODY:]
    if sha256(body).digest() != data[len(MAGIC) : _BODY]:
        raise ValueError(f"state is damaged: its {len(data)} bytes do not fit its checksum; allowed: all, unchanged")
    try:
        end = 8 + int.from_bytes(body[:8], "little")
        return _with_arrays(json.loads(bytes(body[8:end])), body[end:])
    except _UNREADABLE as error:
        raise ValueError(f"state is damaged: {error}; allowed: what get_state returned") from error


def check(value: Any, form: Any, name: str) -> None:
    """Raise ValueError, saying where in `name`, if a tree of `unpack` does not have the form.

    A form is a mapping or list of forms; a tuple (None, form); an array, for its type and its shape, in which 0 is any
    size; a type; or None. Numbers have to be finite, and `float` takes whole ones too.
    """
    if isinstance(form, tuple):
        form = None if value is None else form[1]
    if isinstance(form, Mapping) and isinstance(value, dict) and value.keys() == form.keys():
        for key, part in form.items():
            check(value[key], part, f"{name}.{key}")
    elif isinstance(form, list) and isinstance(value, list) and len(value) == len(form):
        for i, part in enumerate(form):
            check(value[i], part, f"{name}[{i}]")
    elif not _is_leaf(value, form):
        raise ValueError(f"{name} is {_describe(value)}; allowed: {_describe(form)}, all numbers finite")


def _is_leaf(value: Any, form: Any) -> bool:
    """Whether a value that has no parts has the form."""
    if isinstance(form, np.ndarray):
        return isinstance(value, np.ndarray) and _is_array(value, form)
    if form is float:
        return type(value) in (int, float) and -float_info.max <= value <= float_info.max
    return value is None if form is None else type(value) is form


def _is_array(array: np.ndarray, form: np.ndarray) -> bool:
    """Whether an array has the form's type and shape, and finite numbers."""
    if array.dtype != form.dtype or array.ndim != form.ndim:
        return False
    if any(size != (asked or size) or not size for size, asked in zip(array.shape, form.shape, strict=True)):
        return False
    fields = [array] if array.dtype.names is None else [array[name] for name in array.dtype.names]
    return all(np.isfinite(field).all() for field in fields)


def _describe(value: Any) -> str:
    """A value or a form, in few words."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype.str} {value.shape}"
    if isinstance(value, Mapping):
        return f"a table of {', '.join(map(str, value)) or 'nothing'}"
    if isinstance(value, type):
        return f"one {value.__name__}"
    return f"a list of {len(value)}" if isinstance(value, list) else repr(value)[:60]


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
