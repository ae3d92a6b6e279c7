"""Compilation of kernels: with `lanes` the only place that imports numba.

`kernel` compiles a law or a phase that other kernels call. `entry` compiles a function that Python calls, and keeps the
machine code on disk for the next process. Neither uses fast maths (it deletes NaN checks) nor numba's own threads.

numba's own disk cache returns stale code when a helper in another module changes, cannot key a closure over another
kernel, and crashes on a truncated file. This one keys on the sources of all kernels, checks every file it reads, and
where anything is amiss does without. It lives in `DIRT_ENV_CACHE_DIR`, or else in the user's cache directory. Files are
pickles, so a directory that other users can write to is not used.
"""

import gc
import hashlib
import logging
import os
import pickle
import platform
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np
from numba.core import cgutils, types
from numba.core.caching import NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.imputils import impl_ret_borrowed
from numba.core.serialize import dumps
from numba.extending import intrinsic, is_jitted, overload
from numba.np.arrayobj import populate_array

try:
    import fcntl
except ImportError:  # Windows: every cold process compiles for itself; files are still replaced in one piece
    fcntl = None

_LOG = logging.getLogger(__name__)
_PACKAGE = Path(__file__).resolve().parent.parent
KERNEL_PACKAGES = ("sim", "task")  # where kernels may be; their sources name the directory of the cache
_CHECKSUM = hashlib.sha256().digest_size
_LOCK_PATIENCE = 120.0  # s; longer than any compilation, so that only a hung process is overtaken
_STALE_AFTER = 30 * 86400.0  # s
_YOUNG = 10_000  # objects, instead of Python's 700: compilation makes millions, and a search for garbage looks at them
_BEGIN = time.time_ns()
_COUNTING = threading.Lock()


def kernel(function: Callable) -> Callable:
    """Compile a function that other kernels call: all of it goes into each of them.

    Called as a function it would count a reference to every array that it is given, at 20 cycles each, and take dozens
    of arguments over the stack.
    """
    options: dict[str, Any] = {"error_model": "numpy", "nogil": True, "forceinline": True}
    compiled = numba.njit(**options)(function)
    if is_jitted(compiled):  # other kernels get a part, Python a whole function
        options |= {"pipeline_class": _PartCompiler, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        part = numba.njit(**options)(function)
        compiled.get_call_template, compiled.get_overload = part.get_call_template, part.get_overload
    return compiled


def entry(function: Callable) -> Callable:
    """Compile a function that Python calls, with its machine code kept on disk; use as `@entry`."""
    compiled = kernel(function)
    if is_jitted(compiled) and (digest := _digest(function)):  # with NUMBA_DISABLE_JIT=1 it is the plain function
        _keep_on_disk(compiled, digest)
    return compiled


def machine_code(function: Callable, *arguments: Any) -> Callable:
    """An entry for arguments of these types only: compiled if need be, and called without a look at their types.

    That look takes numba longer than all else in a call with dozens of arrays (4 of 6 us with 30). Whoever calls this
    sees to it that the types stay the same; the wrong ones are read as if they were the right ones.
    """
    if not is_jitted(function):  # NUMBA_DISABLE_JIT=1
        return function
    signature = tuple(numba.typeof(argument) for argument in arguments)
    function.compile(signature)
    return function.overloads[signature].entry_point


@intrinsic
def _uncounted(context: Any, arrays: Any) -> tuple:
    """The same arrays without an owner."""

    def strip(context, builder, kind, value):
        if isinstance(kind, types.Array):
            struct = context.make_array(kind)(context, builder, value)
            struct.meminfo = cgutils.get_null_value(struct.meminfo.type)
            return struct._getvalue()
        if isinstance(kind, types.BaseTuple):
            parts = [
                strip(context, builder, part, builder.extract_value(value, i)) for i, part in enumerate(kind.types)
            ]
            return context.make_tuple(builder, kind, parts)
        return value

    def generate(context, builder, signature, values):
        return strip(context, builder, signature.args[0], values[0])

    return arrays(arrays), generate


def uncounted(arrays: Any) -> Any:
    """An array or a (named) tuple with arrays in it, to which an entry counts no references, nor to views of them.

    Counting takes 20 cycles each time, several times in a sweep. Whoever calls the entry holds the arrays meanwhile,
    and it must not return one of them.
    """
    return arrays


@overload(uncounted)
def _compile_uncounted(arrays):
    return lambda arrays: _uncounted(arrays)


@intrinsic
def _flat(context: Any, array: Any) -> Any:
    """The same numbers as an array with one index."""
    array = array.type if isinstance(array, types.Optional) else array  # may be None, but is not where it is used
    if not isinstance(array, types.Array) or array.layout != "C":
        return None
    kind = array.copy(ndim=1)

    def generate(context, builder, signature, values):
        whole, line = context.make_array(array)(context, builder, values[0]), context.make_array(kind)(context, builder)
        populate_array(
            line, whole.data, [whole.nitems], [whole.itemsize], whole.itemsize, whole.meminfo, parent=whole.parent
        )
        return impl_ret_borrowed(context, builder, kind, line._getvalue())

    return kind(array), generate


def flat(array: np.ndarray) -> np.ndarray:
    """The numbers of an array in C order as one line of them, in place; in kernels others are refused, not copied.

    `ravel` does that by a call into numba's library, which takes 10 ns and the registers with it.
    """
    return array.reshape(-1)


@overload(flat)
def _compile_flat(array):
    return lambda array: _flat(array)


@intrinsic
def _prefetch(context: Any, array: Any, place: Any) -> tuple:
    """Ask for the cache line of an element of a contiguous array."""

    def generate(context, builder, signature, values):
        data = context.make_array(signature.args[0])(context, builder, values[0]).data
        word = cgutils.int32_t
        kind = cgutils.ir.FunctionType(cgutils.ir.VoidType(), [cgutils.voidptr_t, word, word, word])
        ask = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        line = builder.bitcast(builder.gep(data, [values[1]]), cgutils.voidptr_t)
        builder.call(ask, [line, word(0), word(3), word(1)])  # to be read, from the nearest cache, data
        return context.get_dummy_value()

    return types.none(array, types.intp), generate


def prefetch(array: Any, place: int) -> None:
    """Ask for the element at `place` of a flat array, so that it is in the caches when it is needed a little later."""


@overload(prefetch)
def _compile_prefetch(array, place):
    return lambda array, place: _prefetch(array, place)


@intrinsic
def _add_shared(context: Any, counts: Any, place: Any, amount: Any) -> Any:
    def generate(context, builder, signature, values):
        data = context.make_array(signature.args[0])(context, builder, values[0]).data
        return builder.atomic_rmw("add", builder.gep(data, [values[1]]), values[2], "acq_rel")

    return types.intp(counts, types.intp, types.intp), generate


def add_shared(counts: np.ndarray, place: int, amount: int) -> int:
    """Add to counts i8[n], which threads share, in one piece; returns what was there before."""
    with _COUNTING:
        counts[place] += amount
        return counts[place] - amount


@overload(add_shared)
def _compile_add_shared(counts, place, amount):
    return lambda counts, place, amount: _add_shared(counts, place, amount)


@intrinsic
def _read_shared(context: Any, counts: Any, place: Any) -> Any:
    def generate(context, builder, signature, values):
        data = context.make_array(signature.args[0])(context, builder, values[0]).data
        if platform.machine().lower() in ("x86_64", "amd64", "i386", "i686"):
            nothing = cgutils.ir.FunctionType(cgutils.ir.VoidType(), [])
            builder.call(cgutils.get_or_insert_function(builder.module, nothing, "llvm.x86.sse2.pause"), [])
        return builder.load_atomic(builder.gep(data, [values[1]]), "acquire", 8)

    return types.intp(counts, types.intp), generate


def read_shared(counts: np.ndarray, place: int) -> int:
    """Read from counts i8[n], which another thread is about to change, and leave it the core for a moment."""
    return int(counts[place])


@overload(read_shared)
def _compile_read_shared(counts, place):
    return lambda counts, place: _read_shared(counts, place)


class _Part(JITCodeLibrary):
    """The code of a kernel that other kernels link in: neither optimised nor made machine code, as they will be.

    numba would do both to every kernel, all those that it calls included: again at each level of calls, which took
    more than half of the time of a first step.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """None: Python cannot call it."""
        return 0

    @property
    def codegen(self) -> Any:
        """Takes the constants for Python's part of a function, of which there is none."""
        return SimpleNamespace(set_env=lambda name, env: None)


class _PartCompiler(Compiler):
    """numba's own passes, with a part for the library that they write to."""

    def define_pipelines(self) -> list:
        """The passes in their order; called once for each compilation."""
        self.state.library = _Part(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super().define_pipelines()


def cache_root() -> Path:
    """Directory under which compiled kernels are kept: `DIRT_ENV_CACHE_DIR`, or the platform's user cache."""
    if chosen := os.environ.get("DIRT_ENV_CACHE_DIR"):
        return Path(chosen).expanduser()
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "dirt_env" / "kernels"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "dirt_env" / "kernels"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "dirt_env" / "kernels"


def _keep_on_disk(dispatcher: Any, digest: str) -> None:
    """Give a numba dispatcher the disk cache, and let go of the cache's lock however its compilation ends."""
    cache = _DiskCache(dispatcher.py_func, digest)
    compile_ = dispatcher.compile

    def compile_once(signature):
        # numba's lock comes first, so that threads take turns before processes do.
        with global_compiler_lock, cache.turn(), _rare_garbage_collection():
            return compile_(signature)

    dispatcher._cache = cache
    dispatcher.compile = compile_once


@contextmanager
def _rare_garbage_collection() -> Iterator[None]:
    """Let Python look for garbage less often, for a tenth of the time that a compilation takes goes into that."""
    young, middle, old = gc.get_threshold()
    if 0 < young < _YOUNG:  # 0: somebody has turned it off
        gc.set_threshold(_YOUNG, middle, old)
    try:
        yield
    finally:
        gc.set_threshold(young, middle, old)


class _DiskCache(NullCache):
    """Machine code of one entry: one file per signature, in a directory named by the digest of all kernel sources."""

    def __init__(self, function: Callable, digest: str) -> None:
        self._name = f"{function.__module__}.{function.__qualname__}".replace("<", "").replace(">", "")
        self._closure = _describe_closure(function)
        self._digest = digest
        self._release: list[Callable] = []

    @property
    def cache_path(self) -> str | None:
        """The directory of this version's files, or None where it is not to be had."""
        directory = _private_directory(self._digest)
        return None if directory is None else str(directory)

    @contextmanager
    def turn(self) -> Iterator[None]:
        """One compilation: a lock that `load_overload` takes on a miss ends with it."""
        held = len(self._release)
        try:
            yield
        finally:
            while len(self._release) > held:
                self._release.pop()()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Compiled code of a signature, or None; of many cold processes the first compiles, the others wait for it."""
        target_context.refresh()
        path = self._path(sig, target_context.codegen())
        if path is None:
            return None
        found = self._read(path, target_context)
        if found is None and self._wait_for_lock(path.with_suffix(".lock")):
            found = self._read(path, target_context)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the compiled code of a signature; a full or vanished disk is no error."""
        path = self._path(sig, data.codegen)
        if path is None or data.library.has_dynamic_globals:
            return
        try:
            payload = dumps(data._reduce())
            _replace(path, hashlib.sha256(payload).digest() + payload)
        except Exception as error:
            _LOG.debug("kernel %s not kept in %s: %r", self._name, path, error)

    def _path(self, sig: Any, codegen: Any) -> Path | None:
        directory = _private_directory(self._digest)
        if directory is None:
            return None
        key = repr((sig, codegen.magic_tuple(), self._closure))
        return directory / f"{self._name}-{hashlib.sha256(key.encode()).hexdigest()[:24]}.kernel"

    def _read(self, path: Path, target_context: Any) -> Any:
        try:
            content = path.read_bytes()
            payload = content[_CHECKSUM:]
            if hashlib.sha256(payload).digest() != content[:_CHECKSUM]:
                raise ValueError("checksum differs")
            return CompileResult._rebuild(target_context, *pickle.loads(payload))
        except FileNotFoundError:
            return None
        except Exception as error:  # whatever is wrong with it, compiling again puts it right
            _LOG.debug("kernel file %s not used: %r", path, error)
            return None

    def _wait_for_lock(self, path: Path) -> bool:
        """Take the lock of one file for this compilation; False if there are no locks here or it takes too long."""
        if fcntl is None:
            return False
        try:
            file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        except OSError as error:
            _LOG.debug("no lock %s: %r", path, error)
            return False
        if not _lock(file):
            os.close(file)
            return False
        self._release.append(partial(os.close, file))
        return True


def _lock(file: int) -> bool:
    """Lock an open file against other processes; the system lets go of it when the process ends, however it ends."""
    deadline = time.monotonic() + _LOCK_PATIENCE
    while time.monotonic() < deadline:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            time.sleep(0.05)
        except OSError:
            return False
    return False


def _digest(function: Callable) -> str | None:
    """Name of a version of the kernels: their sources, and what else the machine code depends on.

    None where they are not to be had (in a zip file, in a notebook), or have been edited since this process began: what
    it has in memory may then be older than what is on disk.
    """
    sources = {path for package in KERNEL_PACKAGES for path in (_PACKAGE / package).rglob("*.py")}
    digest = hashlib.sha256(repr((numba.__version__, sys.version, platform.machine())).encode())
    try:
        for path in sorted(sources | {Path(function.__code__.co_filename)}):
            if path.stat().st_mtime_ns > _BEGIN:
                _LOG.debug("kernels are not kept on disk: %s has been edited", path)
                return None
            text = path.read_bytes()
            digest.update(f"{path.name} {len(text)}\n".encode() + text)
    except OSError as error:
        _LOG.debug("kernels are not kept on disk: %r", error)
        return None
    return digest.hexdigest()[:16] if sources else None


def _describe_closure(function: Callable) -> tuple:
    """What a function has closed over, in words that are the same in every process."""
    return tuple(_describe(cell.cell_contents) for cell in function.__closure__ or ())


def _describe(value: Any) -> Any:
    if is_jitted(value):
        value = value.py_func
    if callable(value) and hasattr(value, "__qualname__"):
        return value.__module__, value.__qualname__, _describe_closure(value) if hasattr(value, "__closure__") else ()
    return hashlib.sha256(dumps(value)).hexdigest()


def _private_directory(digest: str) -> Path | None:
    """The directory of a version's files, made if need be; None where it cannot be had or others could write to it."""
    try:
        directory = cache_root() / digest
        if not directory.is_dir():
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            _forget_old_versions(directory.parent)
        status = directory.stat()
    except (OSError, RuntimeError) as error:  # RuntimeError: there is no home directory
        _LOG.debug("kernels are not kept on disk: %r", error)
        return None
    if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o022):
        _LOG.debug("kernels are not kept on disk: others may write to %s", directory)
        return None
    return directory


def _forget_old_versions(root: Path) -> None:
    """Remove the files of versions that nothing was compiled for in a month."""
    for directory in root.iterdir():
        with suppress(OSError):  # another process tidies up too
            if directory.stat().st_mtime < time.time() - _STALE_AFTER:
                shutil.rmtree(directory, ignore_errors=True)


def _replace(path: Path, content: bytes) -> None:
    """Write a file so that another process sees the old one or the new one, never a part."""
    handle, draft = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".draft")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.replace(draft, path)
    except BaseException:
        os.unlink(draft)
        raise
