"""Compilation of kernels: with `intrinsics` and `lanes` the only place that imports numba.

`kernel` compiles a law or a phase that other kernels call. `entry` compiles a function that Python calls, and keeps the
machine code on disk for the next process. Neither uses fast maths (it deletes NaN checks) nor numba's own threads.

numba's own disk cache returns stale code when a helper in another module changes, cannot key a closure over another
kernel, and crashes on a truncated file. This one keys on the sources of all kernels, checks every file it reads, and
where anything is amiss does without. It lives in `DIRT_ENV_CACHE_DIR`, or else in the user's cache directory. Files are
pickles, so a directory that other users can write to is not used.
"""

import atexit
import gc
import hashlib
import logging
import os
import pickle
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from types import CodeType, SimpleNamespace
from typing import Any

import numba
from numba.core import types
from numba.core.caching import NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.serialize import dumps
from numba.core.typed_passes import InlineOverloads, NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes, InlineInlinables
from numba.extending import is_jitted

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
_HELPER = """
import importlib, pickle, sys
sys.path, module, name = pickle.load(sys.stdin.buffer)
function = getattr(importlib.import_module(module), name)
signature = pickle.load(sys.stdin.buffer)
function._cache.holds_lock = True
function.compile(signature)
"""
_ROOM = 2**22  # bytes on the disk, several times what the code of an entry takes
_USELESS = InlineInlinables, InlineOverloads, NopythonRewrites
_HELPERS: dict[tuple[Callable, tuple], subprocess.Popen] = {}  # by entry and signature


def kernel(function: Callable) -> Callable:
    """Compile a function that other kernels call: all of it goes into each of them.

    Called as a function it would count a reference to every array that it is given, at 20 cycles each, and take dozens
    of arguments over the stack. What a kernel is given is no constant to it, so that it cannot tell parts of a tuple of
    several types, or the fields of a record, by an argument; and sums of whole arrays make arrays in between.
    """
    options: dict[str, Any] = {"error_model": "numpy", "nogil": True, "forceinline": True}
    compiled = numba.njit(**options)(function)
    if is_jitted(compiled):  # other kernels get a part, for any constants; Python a whole function
        options |= {"pipeline_class": _PartCompiler, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        part = numba.njit(**options)(function)
        compiled.get_call_template, compiled.get_overload = _for_any_value(part.get_call_template), part.get_overload
    return compiled


def _for_any_value(get_call_template: Callable) -> Callable:
    """Let what is called with a constant be compiled for its type: for numba, each constant is a type of its own."""

    def template(args: tuple, kws: dict) -> tuple:
        return get_call_template(tuple(map(types.unliteral, args)), {k: types.unliteral(v) for k, v in kws.items()})

    return template


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
    signature = tuple(map(numba.typeof, arguments))
    function.compile(signature)
    _stop_helpers((function, signature))
    return function.overloads[signature].entry_point


def compile_aside(function: Callable, *arguments: Any) -> None:
    """Let a process of its own compile an entry for arguments of these types, while this one does something else.

    What it has made goes into the cache, where `machine_code` waits for it. Nothing happens where it is there already,
    where another process is about to make it, or where no process can be had: then it is compiled when it is called.
    """
    if not isinstance(getattr(function, "_cache", None), _DiskCache):
        return
    signature = tuple(map(numba.typeof, arguments))
    if signature in function.overloads or (function, signature) in _HELPERS:
        return
    try:
        _start_helper(function, signature)
    except Exception as error:
        _LOG.debug("no process to compile %s: %r", function, error)


def _start_helper(function: Callable, signature: tuple) -> None:
    """Start a process that compiles an entry, unless somebody does so already."""
    if not Path(sys.executable or "").name.startswith("python"):  # but a program that Python is a part of
        return
    lock = function._cache.claim(signature, function.targetctx.codegen())
    if lock is None:
        return
    command = sys.executable, "-I", "-c", _HELPER  # -I: whatever else lies in the folder at hand
    silent = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    try:
        message = pickle.dumps((sys.path, function.__module__, function.__name__)) + dumps(signature)
        helper = _HELPERS[function, signature] = subprocess.Popen(command, pass_fds=(lock,), **silent)
        with helper.stdin:
            helper.stdin.write(message)
    finally:
        os.close(lock)  # the helper's as long as it lives


@atexit.register
def _stop_helpers(*keys: tuple) -> None:
    """End the processes that compile these entries and signatures, or all; they are done, or too late."""
    for key in keys or list(_HELPERS):
        if helper := _HELPERS.pop(key, None):
            helper.kill()
            helper.wait()


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
    """numba's own passes, with a part for the library that they write to; without those that find nothing in kernels.

    Those look for functions to be inlined by numba, sums of whole arrays, and functions within a function, where there
    is none; each has numba analyse the function once more.
    """

    def define_pipelines(self) -> list:
        """The passes in their order; called once for each compilation."""
        self.state.library = _Part(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        pipelines, constants = super().define_pipelines(), self.state.func_id.code.co_consts
        has_inner = any(isinstance(constant, CodeType) for constant in constants)
        useless = _USELESS if has_inner else (*_USELESS, InlineClosureLikes)
        for pipeline in pipelines:
            pipeline.passes = [step for step in pipeline.passes if step[0] not in useless]
        return pipelines


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
        self.holds_lock = False  # that of what this process is here to compile, see `compile_aside`

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

    def claim(self, sig: Any, codegen: Any) -> int | None:
        """An open file that holds the lock of a signature; None if there is code for it, or somebody else compiles."""
        path = self._path(sig, codegen)
        file = None if path is None or path.exists() else _open_locked(path.with_suffix(".lock"), 0.0)
        if file is None:
            return None
        try:
            if os.pwrite(file, bytes(_ROOM), 0) < _ROOM:
                raise OSError(f"no room for {_ROOM} bytes")
            return fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, 3)  # where no stream of another process comes to lie
        finally:
            os.truncate(file, 0)
            os.close(file)

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
        file = None if self.holds_lock else _open_locked(path, _LOCK_PATIENCE)
        if file is None:
            return False
        self._release.append(partial(os.close, file))
        return True


def _open_locked(path: Path, patience: float) -> int | None:
    """Open a file and lock it against other processes; None if there are no locks here or it takes so many seconds.

    The system lets go of it when the process ends, however it ends.
    """
    if fcntl is None:
        return None
    try:
        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        _LOG.debug("no lock %s: %r", path, error)
        return None
    deadline = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return file
        except BlockingIOError:
            if time.monotonic() >= deadline:
                break
            time.sleep(0.05)
        except OSError:
            break
        except BaseException:
            os.close(file)
            raise
    os.close(file)
    return None


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
