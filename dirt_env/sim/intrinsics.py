"""What kernels do with arrays that numba has no words for, or slow ones: flat views, no counting, counts of threads."""

import platform
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, config, types
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

_COUNTING = threading.Lock()


def compiled(plain: Callable) -> Callable[[Callable], Callable]:
    """A function for kernels that does what `plain` does; with NUMBA_DISABLE_JIT=1 it is that.

    It goes into what calls it as it is, where numba's `overload` would compile a function for each type of arguments.
    """
    return lambda build: plain if config.DISABLE_JIT else intrinsic(build)


def _uncounted(arrays: Any) -> Any:
    """An array or a (named) tuple with arrays in it, to which an entry counts no references, nor to views of them.

    Counting takes 20 cycles each time, several times in a sweep. Whoever calls the entry holds the arrays meanwhile,
    and it must not return one of them.
    """
    return arrays


@compiled(_uncounted)
def uncounted(context: Any, arrays: Any) -> tuple:
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


def _flat(array: np.ndarray) -> np.ndarray:
    """The numbers of an array in C order as one line of them, in place; in kernels others are refused, not copied.

    `ravel` does that by a call into numba's library, which takes 10 ns and the registers with it.
    """
    return array.reshape(-1)


@compiled(_flat)
def flat(context: Any, array: Any) -> Any:
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


def _prefetch(array: Any, place: int) -> None:
    """Ask for the element at `place` of a flat array, so that it is in the caches when it is needed a little later."""


@compiled(_prefetch)
def prefetch(context: Any, array: Any, place: Any) -> tuple:
    def generate(context, builder, signature, values):
        data = context.make_array(signature.args[0])(context, builder, values[0]).data
        word = cgutils.int32_t
        kind = ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t, word, word, word])
        ask = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        line = builder.bitcast(builder.gep(data, [values[1]]), cgutils.voidptr_t)
        builder.call(ask, [line, word(0), word(3), word(1)])  # to be read, from the nearest cache, data
        return context.get_dummy_value()

    return types.none(array, types.intp), generate


def _add_shared(counts: np.ndarray, place: int, amount: int) -> int:
    """Add to counts i8[n], which threads share, in one piece; returns what was there before."""
    with _COUNTING:
        counts[place] += amount
        return int(counts[place]) - amount


@compiled(_add_shared)
def add_shared(context: Any, counts: Any, place: Any, amount: Any) -> Any:
    def generate(context, builder, signature, values):
        data = context.make_array(signature.args[0])(context, builder, values[0]).data
        return builder.atomic_rmw("add", builder.gep(data, [values[1]]), values[2], "acq_rel")

    return types.intp(counts, types.intp, types.intp), generate


def _read_shared(counts: np.ndarray, place: int) -> int:
    """Read from counts i8[n], which another thread is about to change; on x86, leave it the core for a moment."""
    return int(counts[place])


@compiled(_read_shared)
def read_shared(context: Any, counts: Any, place: Any) -> Any:
    def generate(context, builder, signature, values):
        data = context.make_array(signature.args[0])(context, builder, values[0]).data
        if platform.machine().lower() in ("x86_64", "amd64", "i386", "i686"):
            nothing = ir.FunctionType(ir.VoidType(), [])
            builder.call(cgutils.get_or_insert_function(builder.module, nothing, "llvm.x86.sse2.pause"), [])
        return builder.load_atomic(builder.gep(data, [values[1]]), "acquire", 8)

    return types.intp(counts, types.intp), generate
