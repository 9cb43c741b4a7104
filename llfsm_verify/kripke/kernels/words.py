"""Memory by address: what numba needs to know of loads, stores, prefetching and calls of a compiled step program."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

F = TypeVar("F", bound=Callable[..., Any])

ENTRIES: dict[str, Callable[[], Any]] = {}
"""What compiles a kernel, by name."""

_WORD = ir.IntType(64)


def helper(function: F) -> F:
    """A function that kernels call; it is compiled into each of them."""
    return cast(F, njit(error_model="numpy", inline="never")(function))


def kernel(name: str) -> Callable[[F], F]:
    """A kernel of this name: from the address of a control block to a code. It is compiled when `ENTRIES` is asked."""

    def compiled(function: F) -> F:
        ENTRIES[name] = lambda: njit("int64(int64)", error_model="numpy")(function)
        return function

    return compiled


def _load(bits: int) -> Any:
    @intrinsic
    def load(typing_context: Any, address: Any, index: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            start = builder.inttoptr(arguments[0], ir.IntType(bits).as_pointer())
            value = builder.load(builder.gep(start, [arguments[1]]))
            return value if bits == 64 else builder.zext(value, _WORD)

        return types.int64(types.int64, types.int64), generate

    return load


def _store(bits: int) -> Any:
    @intrinsic
    def store(typing_context: Any, address: Any, index: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            kind = ir.IntType(bits)
            start = builder.inttoptr(arguments[0], kind.as_pointer())
            value = arguments[2] if bits == 64 else builder.trunc(arguments[2], kind)
            builder.store(value, builder.gep(start, [arguments[1]]))
            return context.get_dummy_value()

        return types.void(types.int64, types.int64, types.int64), generate

    return store


Load = Callable[[int, int], int]
Store = Callable[[int, int, int], None]
load8, load16, load32, load64 = (cast(Load, _load(bits)) for bits in (8, 16, 32, 64))
"""``load32(address, i)``: element i of an array of unsigned 32-bit numbers (64: signed)."""
store8, store16, store32, store64 = (cast(Store, _store(bits)) for bits in (8, 16, 32, 64))
"""``store32(address, i, value)``: the value's low bits."""


@intrinsic
def _prefetch(typing_context: Any, address: Any) -> Any:
    """Ask for the cache line at an address, to be written soon."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        function = builder.module.declare_intrinsic(
            "llvm.prefetch", [byte], ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        )
        place = builder.inttoptr(arguments[0], byte)
        builder.call(function, [place, number(1), number(3), number(1)])
        return context.get_dummy_value()

    return types.void(types.int64), generate


@intrinsic
def _acquired(typing_context: Any, address: Any, index: Any) -> Any:
    """A word that another thread may change; what that thread wrote before it is there as well."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        start = builder.inttoptr(arguments[0], _WORD.as_pointer())
        return builder.load_atomic(builder.gep(start, [arguments[1]]), "acquire", 8)

    return types.int64(types.int64, types.int64), generate


@intrinsic
def _added(typing_context: Any, address: Any, index: Any, value: Any) -> Any:
    """Add to a word that several threads change; what it was before."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        start = builder.inttoptr(arguments[0], _WORD.as_pointer())
        return builder.atomic_rmw("add", builder.gep(start, [arguments[1]]), arguments[2], "acq_rel")

    return types.int64(types.int64, types.int64, types.int64), generate


@intrinsic
def _exchanged(typing_context: Any, address: Any, index: Any, expected: Any, value: Any) -> Any:
    """Put a value into a word if it is as expected; what it was before."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        start = builder.inttoptr(arguments[0], _WORD.as_pointer())
        place = builder.gep(start, [arguments[1]])
        pair = builder.cmpxchg(place, arguments[2], arguments[3], "acq_rel", "acquire")
        return builder.extract_value(pair, 0)

    return types.int64(types.int64, types.int64, types.int64, types.int64), generate


@intrinsic
def _shifted(typing_context: Any, value: Any, places: Any) -> Any:
    """A logical shift to the right."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.lshr(arguments[0], arguments[1])

    return types.int64(types.int64, types.int64), generate


@intrinsic
def _expand(
    typing_context: Any, function: Any, records: Any, count: Any, buffer: Any, capacity: Any, state: Any
) -> Any:
    """Call the `expand` of a compiled step program (`backends.native.loops`), which is given by its address."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(_WORD, [_WORD] * 5)
        return builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])

    return types.int64(*[types.int64] * 6), generate


prefetch = cast(Callable[[int], None], _prefetch)
shifted = cast(Callable[[int, int], int], _shifted)
acquired = cast(Load, _acquired)
added = cast(Callable[[int, int, int], int], _added)
exchanged = cast(Callable[[int, int, int, int], int], _exchanged)
expand = cast(Callable[[int, int, int, int, int, int], int], _expand)
