"""Short vectors as values in Numba kernels: 8 x float32, 4 x float64 and their masks.

Only this file uses llvmlite. A vector lives in a register: ``load*`` or ``splat*`` create it, ``store``, ``extract`` or
``movemask`` read it. ``+ - * /`` and comparisons work lane by lane. A comparison, also ``!=``, gives a mask that is
unset for NaN; masks have ``&`` and ``|``. No operation has fast-math flags, so nothing becomes a fused multiply-add;
the signs of the edge functions in ``intersect`` depend on that.
"""

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model


class Vector(types.Type):
    """``lanes`` values of ``scalar`` side by side; ``mask`` is a vector of truth values."""

    def __init__(self, scalar: str, lanes: int) -> None:
        self.scalar = scalar
        self.lanes = lanes
        super().__init__(name=f"{scalar}x{lanes}")


F32X8 = Vector("f32", 8)
F64X4 = Vector("f64", 4)
F64X8 = Vector("f64", 8)
I32X8 = Vector("i32", 8)
I64X8 = Vector("i64", 8)
MASK8 = Vector("mask", 8)
MASK4 = Vector("mask", 4)

_ELEMENT = {
    "f32": ir.FloatType(), "f64": ir.DoubleType(), "i32": ir.IntType(32), "i64": ir.IntType(64), "mask": ir.IntType(1),
}  # fmt: skip
_NUMBER = {"f32": types.float32, "f64": types.float64}
_MASK_OF = {8: MASK8, 4: MASK4}


def _llvm(vector: Vector) -> ir.VectorType:
    return ir.VectorType(_ELEMENT[vector.scalar], vector.lanes)


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Vector) -> None:
        super().__init__(dmm, fe_type, _llvm(fe_type))


def _numbers(args: Any) -> Any:
    """The common vector type of two operands: equal float vectors, or one and a number for all lanes."""
    for vector in args:
        if isinstance(vector, Vector) and vector.scalar in _NUMBER:
            fits = all(other in (vector, _NUMBER[vector.scalar]) for other in map(types.unliteral, args))
            return vector if fits and len(args) == 2 else None
    return None


def _spread(builder: Any, vector: Vector, value: Any) -> Any:
    """A vector unchanged; a number in all lanes."""
    if isinstance(value.type, ir.VectorType):
        return value
    one = builder.insert_element(ir.Constant(_llvm(vector), ir.Undefined), value, ir.IntType(32)(0))
    order = ir.Constant(ir.VectorType(ir.IntType(32), vector.lanes), [0] * vector.lanes)
    return builder.shuffle_vector(one, one, order)


def _operator(op: Any, answer: Any, emit: Any) -> None:
    """Define ``op`` for float vectors, and for a vector and a number; ``answer`` is the type of its result."""

    @infer_global(op)
    class _Typing(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            vector = _numbers(args)
            return signature(answer(vector), *map(types.unliteral, args)) if vector is not None else None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return emit(builder, *(_spread(builder, _numbers(sig.args), value) for value in args))

    for kinds in ((Vector, Vector), (Vector, types.Float), (types.Float, Vector)):
        lower_builtin(op, *kinds)(lower)


def _binary(op: Any, emit: Any) -> None:
    _operator(op, lambda vector: vector, emit)


def _comparison(op: Any, predicate: str) -> None:
    _operator(op, lambda vector: _MASK_OF[vector.lanes], lambda b, x, y: b.fcmp_ordered(predicate, x, y))


def _logic(op: Any, emit: Any) -> None:
    @infer_global(op)
    class _Typing(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) == 2 and isinstance(args[0], Vector) and args[0] == args[1] and args[0].scalar == "mask":
                return signature(args[0], *args)
            return None

    @lower_builtin(op, Vector, Vector)
    def _lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return emit(builder, args[0], args[1])


_binary(operator.add, lambda b, x, y: b.fadd(x, y))
_binary(operator.sub, lambda b, x, y: b.fsub(x, y))
_binary(operator.mul, lambda b, x, y: b.fmul(x, y))
_binary(operator.truediv, lambda b, x, y: b.fdiv(x, y))
_comparison(operator.lt, "<")
_comparison(operator.le, "<=")
_comparison(operator.gt, ">")
_comparison(operator.ge, ">=")
_comparison(operator.eq, "==")
_comparison(operator.ne, "!=")
_logic(operator.and_, lambda b, x, y: b.and_(x, y))
_logic(operator.or_, lambda b, x, y: b.or_(x, y))


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, index: Any, vector: ir.VectorType) -> Any:
    """Address of element ``index`` of an array or ``pointer``, as a pointer to a vector."""
    if not isinstance(array_type, types.CPointer):
        array = cgutils.create_struct_proxy(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(array, [index]), vector.as_pointer())


@intrinsic
def pointer(typingctx, array):
    """The address of an array's first element. The caller of the kernel keeps the array alive."""

    def codegen(context, builder, sig, args):
        return cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0]).data

    return types.CPointer(array.dtype)(array), codegen


@intrinsic
def address(typingctx, array):
    """The address of an array's first element as an int64, for memory with values of more than one type."""

    def codegen(context, builder, sig, args):
        data = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0]).data
        return builder.ptrtoint(data, context.get_value_type(sig.return_type))

    return types.int64(array), codegen


@intrinsic
def doubles_between(typingctx, first, second):
    """The distance from the ``pointer`` ``first`` to ``second``, in float64 numbers."""

    def codegen(context, builder, sig, args):
        word = context.get_value_type(types.int64)
        start, end = (builder.ptrtoint(pointer_, word) for pointer_ in args)
        return builder.ashr(builder.sub(end, start), context.get_constant(types.int64, 3))

    return types.int64(first, second), codegen


def _pointer_to(dtype: Any) -> Any:
    """The function that converts an address, an int64, to a ``pointer`` to values of ``dtype``."""

    @intrinsic
    def pointer_to(typingctx, address):
        def codegen(context, builder, sig, args):
            return builder.inttoptr(args[0], context.get_value_type(sig.return_type))

        return types.CPointer(dtype)(types.int64), codegen

    return pointer_to


float32_pointer = _pointer_to(types.float32)
float64_pointer = _pointer_to(types.float64)
int32_pointer = _pointer_to(types.int32)
int64_pointer = _pointer_to(types.int64)
bool_pointer = _pointer_to(types.boolean)


def _extreme(a: Any, b: Any, predicate: str) -> Any:
    """The second of two values if ``predicate`` puts it before the first, else the first."""
    vector = _numbers((a, b))
    number = types.unliteral(a)

    def codegen(context, builder, sig, args):
        if vector is not None:
            args = [_spread(builder, vector, value) for value in args]
        compare = builder.icmp_signed if isinstance(number, types.Integer) else builder.fcmp_ordered
        return builder.select(compare(predicate, args[1], args[0]), args[1], args[0])

    return (number(number, number) if vector is None else vector(number, types.unliteral(b))), codegen


@intrinsic
def maximum(typingctx, a, b):
    """``max(a, b)`` of two numbers of one type, or of float vectors; a if either is NaN."""
    return _extreme(a, b, ">")


@intrinsic
def minimum(typingctx, a, b):
    """``min(a, b)`` of two numbers of one type, or of float vectors; a if either is NaN."""
    return _extreme(a, b, "<")


# Words of ``local_words``: a frame of less than 4,096 bytes needs no stack probe on Windows.
LOCAL_WORDS = 500


def _local(number: Any, element: ir.Type) -> Any:
    """The intrinsic's result: LOCAL_WORDS numbers in the kernel's own frame."""

    def codegen(context, builder, sig, args):
        words = cgutils.alloca_once(builder, ir.ArrayType(element, LOCAL_WORDS))
        return builder.bitcast(words, element.as_pointer())

    return types.CPointer(number)(), codegen


@intrinsic
def local_words(typingctx):
    """A ``pointer`` to LOCAL_WORDS int64 in the kernel's own frame, uninitialised and gone when it returns."""
    return _local(types.int64, ir.IntType(64))


@intrinsic
def local_doubles(typingctx):
    """A ``pointer`` to LOCAL_WORDS float64, like ``local_words``."""
    return _local(types.float64, ir.DoubleType())


@intrinsic
def local_floats(typingctx):
    """A ``pointer`` to LOCAL_WORDS float32, like ``local_words``."""
    return _local(types.float32, ir.FloatType())


@intrinsic
def double_of(typingctx, bits):
    """The float64 with the bits of an int64."""

    def codegen(context, builder, sig, args):
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), codegen


@intrinsic
def load(typingctx, base, index):
    """The element at ``index`` of a ``pointer``."""

    def codegen(context, builder, sig, args):
        return context.unpack_value(builder, sig.args[0].dtype, builder.gep(args[0], [args[1]]))

    return base.dtype(base, types.intp), codegen


@intrinsic
def offset(typingctx, base, index):
    """A ``pointer`` to the element at ``index`` of another ``pointer``."""

    def codegen(context, builder, sig, args):
        return builder.gep(args[0], [args[1]])

    return base(base, types.intp), codegen


@intrinsic
def prefetch(typingctx, base, index):
    """Prefetch the cache line of the element at ``index`` of a ``pointer``; any index is allowed."""

    def codegen(context, builder, sig, args):
        byte, word = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, word, word, word])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
        address = builder.bitcast(builder.gep(args[0], [args[1]]), byte)
        # The numbers stand for: to be read, into all levels of the cache, data.
        builder.call(function, [address, word(0), word(3), word(1)])
        return context.get_dummy_value()

    return types.void(base, types.intp), codegen


def _put(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    context.pack_value(builder, sig.args[0].dtype, args[2], builder.gep(args[0], [args[1]]))
    return context.get_dummy_value()


def _load(builder: Any, pointer: Any, array_type: Any) -> Any:
    loaded = builder.load(pointer)
    loaded.align = array_type.dtype.bitwidth // 8
    return loaded


@intrinsic
def load8(typingctx, array, index):
    """Eight float32, float64, int32 or int64 of a one-dimensional array or ``pointer`` of such, from ``index`` on."""
    vector = {types.float32: F32X8, types.float64: F64X8, types.int32: I32X8, types.int64: I64X8}[array.dtype]

    def codegen(context, builder, sig, args):
        return _load(builder, _pointer(context, builder, sig.args[0], *args, _llvm(vector)), sig.args[0])

    return vector(array, types.intp), codegen


@intrinsic
def load4(typingctx, array, index):
    """Four values from a float32 or float64 array as float64; float32 widens exactly."""

    def codegen(context, builder, sig, args):
        element = _ELEMENT["f32"] if sig.args[0].dtype == types.float32 else _ELEMENT["f64"]
        pointer = _pointer(context, builder, sig.args[0], *args, ir.VectorType(element, 4))
        loaded = _load(builder, pointer, sig.args[0])
        return builder.fpext(loaded, _llvm(F64X4)) if element == _ELEMENT["f32"] else loaded

    return F64X4(array, types.intp), codegen


@intrinsic
def equal4(typingctx, array, index, value):
    """The bits of those of four int32 from ``index`` on that equal an int64."""

    def codegen(context, builder, sig, args):
        word = ir.VectorType(ir.IntType(32), 4)
        four = _load(builder, _pointer(context, builder, sig.args[0], args[0], args[1], word), sig.args[0])
        same = builder.icmp_signed("==", four, _spread(builder, Vector("i32", 4), builder.trunc(args[2], word.element)))
        return builder.zext(builder.bitcast(same, ir.IntType(4)), ir.IntType(64))

    return types.int64(array, types.intp, types.int64), codegen


@intrinsic
def gather8(typingctx, base, rows, step, column):
    """Eight float64, ``base[row * step + column]`` for the eight row numbers at ``rows``."""

    def codegen(context, builder, sig, args):
        base, rows, step, column = args
        found, word = ir.Constant(_llvm(F64X8), ir.Undefined), ir.IntType(64)
        for lane in range(8):
            row = builder.load(builder.gep(rows, [word(lane)]))
            value = builder.load(builder.gep(base, [builder.add(builder.mul(row, step), column)]))
            found = builder.insert_element(found, value, ir.IntType(32)(lane))
        return found

    return F64X8(base, rows, types.int64, types.int64), codegen


@intrinsic
def load_strided8(typingctx, base, first, step):
    """Eight float64 of a ``pointer``, each ``step`` after the previous one."""

    def codegen(context, builder, sig, args):
        base, index, step = args
        found = ir.Constant(_llvm(F64X8), ir.Undefined)
        for lane in range(8):
            found = builder.insert_element(found, builder.load(builder.gep(base, [index])), ir.IntType(32)(lane))
            index = builder.add(index, step)
        return found

    return F64X8(base, types.int64, types.int64), codegen


@intrinsic
def narrow(typingctx, number):
    """A float64, or eight, rounded to float32."""
    single, many = types.float32(types.float64), F32X8(F64X8)
    return (many if isinstance(number, Vector) else single), lambda context, builder, sig, args: builder.fptrunc(
        args[0], context.get_value_type(sig.return_type)
    )


@intrinsic
def widen(typingctx, number):
    """A float32, or eight, as float64."""
    single, many = types.float64(types.float32), F64X8(F32X8)
    return (many if isinstance(number, Vector) else single), lambda context, builder, sig, args: builder.fpext(
        args[0], context.get_value_type(sig.return_type)
    )


@intrinsic
def is_negative(typingctx, number):
    """Whether the sign bit of a float64, or of each of eight, is set."""

    def codegen(context, builder, sig, args):
        word = ir.VectorType(ir.IntType(64), 8) if isinstance(number, Vector) else ir.IntType(64)
        return builder.icmp_signed("<", builder.bitcast(args[0], word), ir.Constant(word, None))

    return (MASK8 if isinstance(number, Vector) else types.boolean)(types.unliteral(number)), codegen


@intrinsic
def broadcast_like(typingctx, number, other):
    """A number; or, if ``other`` is a vector of eight, eight copies of it."""
    number = types.unliteral(number)
    kind = _lanes_of(MASK8, number) if isinstance(other, Vector) else number

    def codegen(context, builder, sig, args):
        return _spread(builder, kind, args[0]) if kind != number else args[0]

    return kind(number, other), codegen


@intrinsic
def store(typingctx, array, index, vector):
    """Write a vector's lanes to ``array[index:index + lanes]``, or a number to one place; types must be equal."""
    if not isinstance(vector, Vector):
        return types.void(array, types.intp, array.dtype), _put

    def codegen(context, builder, sig, args):
        pointer = _pointer(context, builder, sig.args[0], args[0], args[1], _llvm(sig.args[2]))
        builder.store(args[2], pointer, align=sig.args[0].dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, types.intp, vector), codegen


def _splat(vector: Vector) -> Any:
    return lambda context, builder, sig, args: _spread(builder, vector, args[0])


@intrinsic
def splat8(typingctx, value):
    """One float32 in all eight lanes."""
    return F32X8(types.float32), _splat(F32X8)


@intrinsic
def splat4(typingctx, value):
    """One float64 in all four lanes."""
    return F64X4(types.float64), _splat(F64X4)


def _lanes_of(mask: Any, number: Any) -> Any:
    """The type of a number or vector used with a mask, which may be a bool."""
    number = types.unliteral(number)
    if not isinstance(mask, Vector) or isinstance(number, Vector):
        return number
    return {types.float32: F32X8, types.float64: F64X8, types.int64: I64X8}[number]


@intrinsic
def select(typingctx, mask, chosen, other):
    """Lane by lane, ``chosen`` where the mask is set, else ``other``; numbers are used for all lanes. No branch."""
    kind = _lanes_of(mask, chosen)

    def codegen(context, builder, sig, args):
        both = [_spread(builder, kind, value) if isinstance(mask, Vector) else value for value in args[1:]]
        return builder.select(args[0], *both)

    return kind(mask, types.unliteral(chosen), types.unliteral(other)), codegen


def _call(builder: Any, name: str, vector: Vector, value: Any) -> Any:
    """Call one of LLVM's intrinsics on a vector or number."""
    suffix = f"v{vector.lanes}{vector.scalar}" if isinstance(vector, Vector) else f"f{vector.bitwidth}"
    kind, name = value.type, f"llvm.{name}.{suffix}"
    return builder.call(cgutils.get_or_insert_function(builder.module, ir.FunctionType(kind, [kind]), name), [value])


@intrinsic
def fabs(typingctx, vector):
    """The absolute value of a number, or of each lane."""

    def codegen(context, builder, sig, args):
        return _call(builder, "fabs", sig.args[0], args[0])

    return vector(vector), codegen


@intrinsic
def square_root(typingctx, vector):
    """Square roots, lane by lane, rounded by IEEE 754; NaN below 0."""

    def codegen(context, builder, sig, args):
        return _call(builder, "sqrt", sig.args[0], args[0])

    return vector(vector), codegen


@intrinsic
def swap_halves(typingctx, vector):
    """Eight lanes with the last four first."""

    def codegen(context, builder, sig, args):
        order = ir.Constant(ir.VectorType(ir.IntType(32), 8), [4, 5, 6, 7, 0, 1, 2, 3])
        return builder.shuffle_vector(args[0], args[0], order)

    return vector(vector), codegen


@intrinsic
def extract(typingctx, vector, index):
    """The value in one lane; the index may vary at run time."""

    def codegen(context, builder, sig, args):
        return builder.extract_element(args[0], builder.trunc(args[1], ir.IntType(32)))

    return _lane(vector)(vector, types.intp), codegen


def _lane(vector: Vector) -> Any:
    """The type of a vector's lanes."""
    return types.float32 if vector.scalar == "f32" else types.float64


def _fold(predicate: str) -> Any:
    """The lane of a vector without NaN that ``predicate`` puts before all others."""

    def codegen(context, builder, sig, args):
        vector, lanes = args[0], sig.args[0].lanes
        step = lanes // 2
        while step > 0:
            order = [(i + step) % lanes for i in range(lanes)]
            turned = builder.shuffle_vector(vector, vector, ir.Constant(ir.VectorType(ir.IntType(32), lanes), order))
            vector = builder.select(builder.fcmp_ordered(predicate, turned, vector), turned, vector)
            step //= 2
        return builder.extract_element(vector, ir.IntType(32)(0))

    return codegen


@intrinsic
def reduce_min(typingctx, vector):
    """The smallest lane of a vector without NaN."""
    return _lane(vector)(vector), _fold("<")


@intrinsic
def reduce_max(typingctx, vector):
    """The largest lane of a vector without NaN."""
    return _lane(vector)(vector), _fold(">")


@intrinsic
def movemask(typingctx, mask):
    """The mask as an integer, lane i in bit i."""

    def codegen(context, builder, sig, args):
        bits = builder.bitcast(args[0], ir.IntType(sig.args[0].lanes))
        return builder.zext(bits, ir.IntType(64))

    return types.int64(mask), codegen


@intrinsic
def unlikely(typingctx, condition):
    """The condition, with a hint that it is nearly always false: keeps registers for the common path."""

    def codegen(context, builder, sig, args):
        bit = ir.IntType(1)
        expect = cgutils.get_or_insert_function(builder.module, ir.FunctionType(bit, [bit, bit]), "llvm.expect.i1")
        return builder.call(expect, [args[0], bit(0)])

    return types.boolean(types.boolean), codegen


@intrinsic
def lowest_bit(typingctx, bits):
    """Index of the lowest set bit of a non-zero int64."""

    def codegen(context, builder, sig, args):
        return builder.cttz(args[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), codegen


@intrinsic
def count_bits(typingctx, bits):
    """Number of set bits of an int64."""

    def codegen(context, builder, sig, args):
        return builder.ctpop(args[0])

    return types.int64(types.int64), codegen


@intrinsic
def bits_float(typingctx, bits):
    """The float32 with the bits in the low half of an int64."""

    def codegen(context, builder, sig, args):
        return builder.bitcast(builder.trunc(args[0], ir.IntType(32)), ir.FloatType())

    return types.float32(types.int64), codegen


def _permuted(builder: Any, vector: Any, places: Any) -> Any:
    """The lanes of eight named by a vector of eight numbers from 0 to 7. LLVM makes one AVX2 instruction of it."""
    found = ir.Constant(vector.type, ir.Undefined)
    for lane in map(ir.IntType(32), range(8)):
        value = builder.extract_element(vector, builder.extract_element(places, lane))
        found = builder.insert_element(found, value, lane)
    # Merged with what follows it would not be seen as one: a fence, which is for floats alone, keeps it apart.
    floats = _llvm(F32X8)
    kind = ir.FunctionType(floats, [floats])
    fence = cgutils.get_or_insert_function(builder.module, kind, "llvm.arithmetic.fence.v8f32")
    return builder.bitcast(builder.call(fence, [builder.bitcast(found, floats)]), vector.type)


@intrinsic
def permuted(typingctx, vector, lanes):
    """The lanes of eight float32 or int32, or of a mask of eight, that eight int32 from 0 to 7 name."""

    def codegen(context, builder, sig, args):
        if vector != MASK8:
            return _permuted(builder, *args)
        word = _llvm(I32X8)
        return builder.icmp_signed(
            "<", _permuted(builder, builder.sext(args[0], word), args[1]), ir.Constant(word, None)
        )

    return vector(vector, lanes), codegen


@intrinsic
def octal8(typingctx, digits):
    """The eight lowest octal digits of an int32 as int32, the lowest first."""

    def codegen(context, builder, sig, args):
        word = _llvm(I32X8)
        shifted = builder.lshr(_spread(builder, I32X8, args[0]), ir.Constant(word, [3 * k for k in range(8)]))
        return builder.and_(shifted, ir.Constant(word, [7] * 8))

    return I32X8(types.int32), codegen


# For each mask of eight lanes, those that are set and then the others.
_SET_FIRST = [sorted(range(8), key=lambda lane: mask >> lane & 1 == 0) for mask in range(256)]


@intrinsic
def set_first(typingctx, bits):
    """The numbers of eight lanes as int32, those whose bits are set first."""

    def codegen(context, builder, sig, args):
        byte, wide = ir.IntType(8), ir.IntType(64)
        row = ir.VectorType(byte, 8)
        table = ir.Constant(ir.ArrayType(row, 256), [ir.Constant(row, order) for order in _SET_FIRST])
        at = builder.and_(args[0], wide(255))
        order = builder.load(builder.gep(cgutils.global_constant(builder, "set_first", table), [wide(0), at]))
        return builder.zext(order, _llvm(I32X8))

    return I32X8(types.int64), codegen


@intrinsic
def add_each(typingctx, words, number):
    """Eight int32, to each of which the low half of an int64 is added."""

    def codegen(context, builder, sig, args):
        return builder.add(args[0], _spread(builder, I32X8, builder.trunc(args[1], ir.IntType(32))))

    return I32X8(I32X8, types.int64), codegen


@intrinsic
def joined(typingctx, low, high):
    """Eight int64: the bits of eight int32 below those of eight float32."""

    def codegen(context, builder, sig, args):
        pairs = ir.Constant(ir.VectorType(ir.IntType(32), 16), [i // 2 + 8 * (i % 2) for i in range(16)])
        high = builder.bitcast(args[1], _llvm(I32X8))
        return builder.bitcast(builder.shuffle_vector(args[0], high, pairs), _llvm(I64X8))

    return I64X8(I32X8, F32X8), codegen


@intrinsic
def counting8(typingctx, first, step):
    """Eight int64 from ``first`` on, each a step more than the previous one."""

    def codegen(context, builder, sig, args):
        first, step = (_spread(builder, I64X8, value) for value in args)
        return builder.add(first, builder.mul(step, ir.Constant(_llvm(I64X8), list(range(8)))))

    return I64X8(types.int64, types.int64), codegen
