"""The choice of a kernel when its caller is compiled, by the type of an argument: the others are not compiled."""

from numba import types
from numba.extending import intrinsic


@intrinsic
def of_kind(typingctx, array, of_int64, of_others):
    """The first of two kernels for an array of int64, else the second."""
    chosen = of_int64 if array.dtype == types.int64 else of_others
    return chosen(array, of_int64, of_others), lambda context, builder, sig, args: context.get_dummy_value()


@intrinsic
def of_none(typingctx, value, for_none, of_others):
    """The first of two kernels for None, else the second."""
    chosen = for_none if isinstance(value, types.NoneType) else of_others
    return chosen(value, for_none, of_others), lambda context, builder, sig, args: context.get_dummy_value()
