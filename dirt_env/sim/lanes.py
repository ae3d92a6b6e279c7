"""Eight or sixteen numbers at a time: vectors that the compiler keeps in registers, for loops over parts of a map.

Compilers make vectors of long loops by themselves. Around a blade a row has six cells, and what such a loop needs
before and after its vectors then takes longer than they do; nor do they make them of sums, whose order that would
change. Here the order is written down: `total` adds in pairs, on every machine alike.

In kernels, lanes of one type are added, subtracted, multiplied, divided and compared with each other and with numbers;
comparisons give lanes of truth values, for `&`, `|`, `choose` and `some`. Arrays are flat, and heights in them are
`float32` or `float64`. What makes lanes makes LANES of them, but for `wide_ramp`; what takes lanes takes either number
of them. With NUMBA_DISABLE_JIT=1 lanes are numpy's arrays.
"""

import operator
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import lower_builtin, models, register_model

from dirt_env.sim.intrinsics import compiled

LANES, WIDE = 8, 16
_I1, _I32, _I64 = ir.IntType(1), ir.IntType(32), ir.IntType(64)


class _Lanes(types.Type):
    """So many numbers, or truth values, of one type."""

    def __init__(self, dtype: types.Type, count: int = LANES) -> None:
        self.dtype, self.count = dtype, count
        super().__init__(f"lanes({dtype} x {count})")

    def of(self, dtype: types.Type) -> "_Lanes":
        """As many of another type."""
        return _Lanes(dtype, self.count)


_TRUTHS, _DOUBLES = _Lanes(types.boolean), _Lanes(types.float64)


@register_model(_Lanes)
class _Model(models.PrimitiveModel):
    """A vector of LLVM."""

    def __init__(self, manager: Any, kind: _Lanes) -> None:
        super().__init__(manager, kind, _vector(kind.dtype, kind.count))


def _vector(dtype: types.Type, count: int = LANES) -> ir.VectorType:
    if isinstance(dtype, types.Float):
        return ir.VectorType(ir.FloatType() if dtype.bitwidth == 32 else ir.DoubleType(), count)
    return ir.VectorType(_I1 if dtype == types.boolean else ir.IntType(dtype.bitwidth), count)


def _indices(places: Any) -> ir.Constant:
    return ir.Constant(ir.VectorType(_I32, len(places)), list(places))


def _same(builder: Any, number: Any, count: int = LANES) -> Any:
    """The number in all lanes."""
    one = builder.insert_element(ir.Constant(ir.VectorType(number.type, count), ir.Undefined), number, _I32(0))
    return builder.shuffle_vector(one, one, _indices([0] * count))


def _first_lanes(builder: Any, count: Any, of: int = LANES) -> Any:
    ramp = ir.Constant(ir.VectorType(count.type, of), list(range(of)))
    return builder.icmp_signed("<", ramp, _same(builder, count, of))


def _as_lanes(context: Any, builder: Any, value: Any, kind: types.Type, wanted: _Lanes) -> Any:
    if isinstance(kind, _Lanes):
        return value
    return _same(builder, context.cast(builder, value, kind, wanted.dtype), wanted.count)


def _common(*kinds: types.Type) -> _Lanes | None:
    """The type of the lanes among them, if it is one and all others are numbers."""
    found = {kind for kind in kinds if isinstance(kind, _Lanes)}
    others = [kind for kind in kinds if not isinstance(kind, _Lanes | types.Number)]
    return found.pop() if len(found) == 1 and not others else None


# Operators


def _operator(name: str, is_comparison: bool, build: Callable) -> None:
    """Let kernels apply an operator to lanes and lanes, or to lanes and a number; `build(builder, dtype, a, b)`."""

    class Template(AbstractTemplate):
        metadata: ClassVar = {"target": "cpu"}  # looked at before those for any target, of which there are dozens

        def generic(self, args: tuple, _: dict) -> Any:
            wanted = _common(*args) if len(args) == 2 else None
            return None if wanted is None else (wanted.of(types.boolean) if is_comparison else wanted)(*args)

    def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        wanted = _common(*signature.args)
        pair = [_as_lanes(context, builder, v, k, wanted) for v, k in zip(values, signature.args, strict=True)]
        return build(builder, wanted.dtype, *pair)

    names = [name] if is_comparison else [name, "i" + name.rstrip("_")]  # `a += b` too
    for function in [getattr(operator, name) for name in names]:
        infer_global(function)(type("Template", (Template,), {}))
        for kinds in ((_Lanes, _Lanes), (_Lanes, types.Number), (types.Number, _Lanes)):
            lower_builtin(function, *kinds)(lower)


def _compare(sign: str, builder: Any, dtype: types.Type, a: Any, b: Any) -> Any:
    if not isinstance(dtype, types.Float):
        return (builder.icmp_signed if dtype.signed else builder.icmp_unsigned)(sign, a, b)
    return builder.fcmp_unordered(sign, a, b) if sign == "!=" else builder.fcmp_ordered(sign, a, b)


def _calculate(name: str, builder: Any, dtype: types.Type, a: Any, b: Any) -> Any:
    return getattr(builder, ("f" if isinstance(dtype, types.Float) else "") + name)(a, b)


def _divide(builder: Any, _: types.Type, a: Any, b: Any) -> Any:
    return builder.fdiv(a, b)


for _name in ("add", "sub", "mul", "and_", "or_"):
    _operator(_name, False, partial(_calculate, _name))
_operator("truediv", False, _divide)
for _name, _sign in (("lt", "<"), ("le", "<="), ("gt", ">"), ("ge", ">="), ("ne", "!=")):
    _operator(_name, True, partial(_compare, _sign))


# Functions: first what each does, in plain Python, then how it is compiled.


def _load(array: np.ndarray, place: int, count: int) -> np.ndarray:
    """LANES numbers from `place` on, or only the first `count`, and 0 in the other lanes, which are not looked at."""
    found, n = np.zeros(LANES, np.uint8 if array.dtype == bool else array.dtype), min(max(count, 0), LANES)
    found[:n] = array[place : place + n]
    return found


def _load_all(array: np.ndarray, place: int) -> np.ndarray:
    """LANES numbers from `place` on; all have to be there."""
    return array[place : place + LANES].copy()


def _store(array: np.ndarray, place: int, lanes: np.ndarray, count: int) -> None:
    """Write the lanes, or only the first `count`, from `place` on; slower than `store_all`."""
    n = min(max(count, 0), len(lanes))
    array[place : place + n] = lanes[:n]


def _store_all(array: np.ndarray, place: int, lanes: np.ndarray) -> None:
    """Write all lanes from `place` on; there has to be room for them."""
    array[place : place + len(lanes)] = lanes


def _spread(number: Any) -> np.ndarray:
    """The same number in all lanes; its type is theirs."""
    return np.full(LANES, number)


def _ramp(start: Any, step: Any) -> np.ndarray:
    """start, start + step, start + 2 step ..., of two f4 or f8."""
    return start + np.arange(LANES, dtype=type(start)) * step


def _wide_ramp(start: Any, step: Any) -> np.ndarray:
    """`ramp` of WIDE numbers: as many of single precision as the widest registers hold."""
    return start + np.arange(WIDE, dtype=type(start)) * step


def _none() -> np.ndarray:
    """Not true in any lane."""
    return np.zeros(LANES, bool)


def _among(count: int) -> np.ndarray:
    """True in the first `count` lanes."""
    return np.arange(LANES) < count


def _choose(truth: np.ndarray, yes: Any, no: Any) -> np.ndarray:
    """`yes` where it is true, else `no`; they may be numbers, two of one type."""
    return np.where(truth, yes, no)


def _clamp(lanes: np.ndarray, low: Any, high: Any) -> np.ndarray:
    """The numbers, no less than `low` and no more than `high`, which may be lanes or numbers; `low` for NaN."""
    lanes = np.where(lanes > low, lanes, low)
    return np.where(lanes < high, lanes, high)


def _doubles(lanes: np.ndarray) -> np.ndarray:
    """The same numbers as f8."""
    return lanes.astype(np.float64)


def _whole(lanes: np.ndarray) -> np.ndarray:
    """Numbers without what comes after the point, i4."""
    return lanes.astype(np.int32)


def _floors(lanes: np.ndarray) -> np.ndarray:
    """The largest whole number that is no more than each, i4."""
    return np.floor(lanes).astype(np.int32)


def _gather(array: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The numbers at these places, i4; all have to be there."""
    return array[places]


def _has(lanes: np.ndarray, bits: int) -> np.ndarray:
    """Whether some of these bits are set in whole numbers."""
    return (lanes & bits) != 0


def _some(truth: np.ndarray) -> bool:
    """Whether it is true in a lane."""
    return bool(truth.any())


def _first_of(truth: np.ndarray) -> int:
    """The first lane in which it is true; there has to be one."""
    return int(truth.argmax())


def _last_of(truth: np.ndarray) -> int:
    """The last lane in which it is true; there has to be one."""
    return len(truth) - 1 - int(truth[::-1].argmax())


def _total(lanes: np.ndarray) -> Any:
    """The sum of the lanes: both halves are added to each other until one number is left."""
    while len(lanes) > 1:
        lanes = lanes[: len(lanes) // 2] + lanes[len(lanes) // 2 :]
    return lanes[0]


def _is_flat(array: Any) -> bool:
    return isinstance(array, types.Array) and array.layout == "C" and array.ndim == 1


def _stored(array: types.Array) -> types.Type:
    """The type of an array's numbers; truth values lie in memory as bytes."""
    return types.uint8 if array.dtype == types.boolean else array.dtype


def _address(context: Any, builder: Any, array: types.Array, value: Any, place: Any, vector: ir.VectorType) -> Any:
    data = context.make_array(array)(context, builder, value).data
    return builder.bitcast(builder.gep(data, [place]), vector.as_pointer())


def _masked(builder: Any, what: str, vector: ir.VectorType, code: ir.FunctionType) -> Any:
    """LLVM's function that loads or stores some lanes, and leaves the places of the others alone."""
    return cgutils.get_or_insert_function(builder.module, code, f"llvm.masked.{what}.{_name(vector)}.p0")


def _name(vector: ir.VectorType) -> str:
    """What LLVM calls the type in the names of functions."""
    return f"v{vector.count}" + {"float": "f32", "double": "f64"}.get(str(vector.element), str(vector.element))


@compiled(_load)
def load(context: Any, array: Any, place: Any, count: Any) -> Any:
    if not _is_flat(array):
        return None
    dtype = _stored(array)

    def generate(context, builder, signature, values):
        vector, mask = _vector(dtype), _first_lanes(builder, values[2])
        address = _address(context, builder, array, *values[:2], vector)
        function = _masked(
            builder, "load", vector, ir.FunctionType(vector, [vector.as_pointer(), _I32, mask.type, vector])
        )
        return builder.call(function, [address, _I32(dtype.bitwidth // 8), mask, ir.Constant(vector, None)])

    return _Lanes(dtype)(array, types.intp, types.intp), generate


@compiled(_load_all)
def load_all(context: Any, array: Any, place: Any) -> Any:
    if not _is_flat(array):
        return None
    dtype = _stored(array)

    def generate(context, builder, signature, values):
        return builder.load(_address(context, builder, array, *values, _vector(dtype)), align=dtype.bitwidth // 8)

    return _Lanes(dtype)(array, types.intp), generate


@compiled(_store)
def store(context: Any, array: Any, place: Any, lanes: Any, count: Any) -> Any:
    if not _is_flat(array) or not isinstance(lanes, _Lanes) or lanes.dtype != array.dtype:
        return None

    def generate(context, builder, signature, values):
        vector, mask = values[2].type, _first_lanes(builder, values[3], lanes.count)
        address = _address(context, builder, array, *values[:2], vector)
        code = ir.FunctionType(ir.VoidType(), [vector, vector.as_pointer(), _I32, mask.type])
        arguments = [values[2], address, _I32(array.dtype.bitwidth // 8), mask]
        builder.call(_masked(builder, "store", vector, code), arguments)
        return context.get_dummy_value()

    return types.none(array, types.intp, lanes, types.intp), generate


@compiled(_store_all)
def store_all(context: Any, array: Any, place: Any, lanes: Any) -> Any:
    if not _is_flat(array) or not isinstance(lanes, _Lanes) or lanes.dtype != array.dtype:
        return None

    def generate(context, builder, signature, values):
        address = _address(context, builder, array, *values[:2], values[2].type)
        builder.store(values[2], address, align=array.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.none(array, types.intp, lanes), generate


@compiled(_spread)
def spread(context: Any, number: Any) -> Any:
    return _Lanes(number)(number), lambda context, builder, signature, values: _same(builder, values[0])


def _count_up(start: Any, step: Any, count: int) -> Any:
    if start != step or not isinstance(start, types.Float):
        return None

    def generate(context, builder, signature, values):
        counts = ir.Constant(_vector(start, count), [float(k) for k in range(count)])
        first, further = [_same(builder, value, count) for value in values]
        return builder.fadd(first, builder.fmul(counts, further))

    return _Lanes(start, count)(start, step), generate


@compiled(_ramp)
def ramp(context: Any, start: Any, step: Any) -> Any:
    return _count_up(start, step, LANES)


@compiled(_wide_ramp)
def wide_ramp(context: Any, start: Any, step: Any) -> Any:
    return _count_up(start, step, WIDE)


@compiled(_none)
def none(context: Any) -> Any:
    return _TRUTHS(), lambda context, builder, signature, values: ir.Constant(_vector(types.boolean), None)


@compiled(_among)
def among(context: Any, count: Any) -> Any:
    return _TRUTHS(types.intp), lambda context, builder, signature, values: _first_lanes(builder, values[0])


@compiled(_choose)
def choose(context: Any, truth: Any, yes: Any, no: Any) -> Any:
    if not isinstance(truth, _Lanes) or truth.dtype != types.boolean:
        return None
    wanted = truth.of(yes) if yes == no and isinstance(yes, types.Number) else _common(yes, no)
    if wanted is None or wanted.count != truth.count:
        return None

    def generate(context, builder, signature, values):
        kinds = signature.args[1:]
        pair = [_as_lanes(context, builder, v, k, wanted) for v, k in zip(values[1:], kinds, strict=True)]
        return builder.select(values[0], *pair)

    return wanted(truth, yes, no), generate


@compiled(_clamp)
def clamp(context: Any, lanes: Any, low: Any, high: Any) -> Any:
    if not isinstance(lanes, _Lanes) or _common(lanes, low, high) is None:
        return None

    def generate(context, builder, signature, values):
        number = values[0]
        for sign, value, kind in ((">", values[1], low), ("<", values[2], high)):
            end = _as_lanes(context, builder, value, kind, lanes)
            number = builder.select(_compare(sign, builder, lanes.dtype, number, end), number, end)
        return number

    return lanes(lanes, low, high), generate


@compiled(_doubles)
def doubles(context: Any, lanes: Any) -> Any:
    def generate(context, builder, signature, values):
        if lanes.dtype == types.float64:
            return values[0]
        if isinstance(lanes.dtype, types.Float):
            convert = builder.fpext
        else:
            convert = builder.sitofp if lanes.dtype.signed else builder.uitofp
        return convert(values[0], _vector(types.float64, lanes.count))

    return lanes.of(types.float64)(lanes), generate


@compiled(_whole)
def whole(context: Any, lanes: Any) -> Any:
    if not isinstance(lanes.dtype, types.Float):
        return None

    def generate(context, builder, signature, values):
        return builder.fptosi(values[0], _vector(types.int32, lanes.count))

    return lanes.of(types.int32)(lanes), generate


@compiled(_floors)
def floors(context: Any, lanes: Any) -> Any:
    if not isinstance(lanes.dtype, types.Float):
        return None

    def generate(context, builder, signature, values):
        vector = values[0].type
        code = ir.FunctionType(vector, [vector])
        function = cgutils.get_or_insert_function(builder.module, code, f"llvm.floor.{_name(vector)}")
        return builder.fptosi(builder.call(function, values), _vector(types.int32, lanes.count))

    return lanes.of(types.int32)(lanes), generate


@compiled(_gather)
def gather(context: Any, array: Any, places: Any) -> Any:
    if not _is_flat(array) or not isinstance(places, _Lanes) or places.dtype != types.int32:
        return None
    dtype, count = _stored(array), places.count

    def generate(context, builder, signature, values):
        data, vector = context.make_array(array)(context, builder, values[0]).data, _vector(dtype, count)
        addresses = builder.gep(data, [_I32(0)])
        addresses.indices = [values[1]]
        addresses.type = ir.VectorType(ir.PointerType(), count)
        mask = ir.Constant(_vector(types.boolean, count), [1] * count)
        code = ir.FunctionType(vector, [addresses.type, _I32, mask.type, vector])
        name = f"llvm.masked.gather.{_name(vector)}.v{count}p0"
        function = cgutils.get_or_insert_function(builder.module, code, name)
        return builder.call(function, [addresses, _I32(dtype.bitwidth // 8), mask, ir.Constant(vector, ir.Undefined)])

    return places.of(dtype)(array, places), generate


@compiled(_has)
def has(context: Any, lanes: Any, bits: Any) -> Any:
    def generate(context, builder, signature, values):
        wanted = _same(builder, context.cast(builder, values[1], bits, lanes.dtype), lanes.count)
        return builder.icmp_unsigned("!=", builder.and_(values[0], wanted), ir.Constant(wanted.type, None))

    return lanes.of(types.boolean)(lanes, bits), generate


def _as_bits(builder: Any, truth: Any) -> Any:
    return builder.zext(builder.bitcast(truth, ir.IntType(truth.type.count)), _I64)


@compiled(_some)
def some(context: Any, truth: Any) -> Any:
    def generate(context, builder, signature, values):
        return builder.icmp_unsigned("!=", _as_bits(builder, values[0]), _I64(0))

    return types.boolean(truth), generate


@compiled(_first_of)
def first_of(context: Any, truth: Any) -> Any:
    def generate(context, builder, signature, values):
        return builder.cttz(_as_bits(builder, values[0]), _I1(0))

    return types.int64(truth), generate


@compiled(_last_of)
def last_of(context: Any, truth: Any) -> Any:
    def generate(context, builder, signature, values):
        return builder.sub(_I64(63), builder.ctlz(_as_bits(builder, values[0]), _I1(0)))

    return types.int64(truth), generate


@compiled(_total)
def total(context: Any, lanes: Any) -> Any:
    def generate(context, builder, signature, values):
        number, size = values[0], lanes.count
        while size > 1:
            size //= 2
            halves = [builder.shuffle_vector(number, number, _indices(range(k, k + size))) for k in (0, size)]
            number = builder.fadd(*halves)
        return builder.extract_element(number, _I32(0))

    return lanes.dtype(lanes), generate
