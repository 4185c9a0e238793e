# SPDX-License-Identifier: Apache-2.0
"""Compiles loops of `vector_code`, each for itself, and calls them by address.

A loop depends on how many bits its arrays have, and the compiled code that calls it does not, so
that is compiled once for all pixel types. Only the loops that a picture takes are compiled.
"""

from collections.abc import Callable
from contextlib import suppress
from inspect import Parameter, Signature, signature
from pathlib import Path
from threading import Lock
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target
from numba.extending import intrinsic

from plenofir.ground import compiling
from plenofir.ground.kept_code import KeptCode, nowhere_to_keep
from plenofir.refocus.compiled import vector_code
from plenofir.refocus.compiled.vector_code import Array, Value

_SHARED = (Path(__file__), Path(vector_code.__file__))
_NUMBER = ir.IntType(64)


def _kind(arguments: int) -> Any:
    """Type of a loop with so many arguments."""
    return ir.FunctionType(ir.VoidType(), [_NUMBER] * arguments)


class Loop:
    """A function that writes a loop: arguments are addresses of arrays and numbers of 64 bits.

    Parameters that are an `int` are constants of the code: each value has code of its own.
    """

    def __init__(self, write: Callable[..., None]) -> None:
        self._write, self._parameters = write, signature(write).parameters.values()
        # Names of the arguments.
        self.names = [p.name for p in self._parameters if p.annotation is not int]
        # By constants: a library, which keeps its code in memory, and where the code begins.
        self._libraries: dict[tuple[int, ...], tuple[Any, int]] = {}
        self._lock = Lock()

    def address(self, *constants: int) -> int:
        """Where the machine code begins; cached on disk if possible.

        `constants`: in the order of parameters the bits of each array, and each constant.
        """
        with self._lock:
            if constants not in self._libraries:
                self._libraries[constants] = self._compiled(constants)
            return self._libraries[constants][1]

    @global_compiler_lock  # type: ignore[untyped-decorator]
    def _compiled(self, constants: tuple[int, ...]) -> tuple[Any, int]:
        # All code is in one table of symbols, so loops of two modules need two names.
        names = self._write.__module__, self._write.__name__
        name = ".".join((*names, *map(str, constants)))
        codegen = cpu_target.target_context.codegen()
        files, key = None, (codegen.magic_tuple(), constants)
        try:
            files = KeptCode(self._write, _SHARED).files
        except (RuntimeError, OSError):
            nowhere_to_keep()
        content = files.load(key) if files else None
        if content:
            library = codegen.unserialize_library(content)
        else:
            compiling.begin(self._write.__name__)
            library = codegen.create_library(name)
            library.enable_object_caching()
            module = library.create_ir_module(name)
            self._fill(ir.Function(module, _kind(len(self.names)), name), constants)
            library.add_ir_module(module)
            library.finalize()
            compiling.end(self._write.__name__)
            with suppress(OSError):
                if files:
                    files.save(key, library.serialize_using_object_code())
        return library, library.get_pointer_to_function(name)

    def _fill(self, function: Any, constants: tuple[int, ...]) -> None:
        """Write the loop as a function."""
        builder = ir.IRBuilder(function.append_basic_block())
        arguments, fixed, operands = iter(function.args), iter(constants), list[Any]()
        for parameter in self._parameters:
            if parameter.annotation is int:
                operands.append(next(fixed))
            elif parameter.annotation is Array:
                operands.append(Array(builder, next(arguments), next(fixed)))
            else:
                operands.append(Value(builder, next(arguments)))
        self._write(*operands)
        builder.ret_void()


def loop(write: Callable[..., None]) -> Any:
    """Function for code that numba compiles: the loop's address, then its arguments.

    Its attribute `address` compiles it (`Loop.address`).
    """
    written = Loop(write)

    def typing(_: Any, address: Any, *kinds: Any) -> Any:
        def generate(context: Any, builder: Any, call: Any, arguments: Any) -> Any:
            address, *values = arguments
            for n, kind in enumerate(call.args[1:]):
                if isinstance(kind, types.Array):
                    array = context.make_array(kind)(context, builder, values[n])
                    values[n] = builder.ptrtoint(array.data, _NUMBER)
            pointer = builder.inttoptr(address, _kind(len(values)).as_pointer())
            builder.call(pointer, values)
            return context.get_dummy_value()

        taking = [kind if isinstance(kind, types.Array) else types.int64 for kind in kinds]
        return types.void(types.int64, *taking), generate

    typing.__name__ = write.__name__
    names = ["context", "address", *written.names]
    # numba needs the arguments' names.
    typing.__signature__ = Signature(  # type: ignore[attr-defined]
        [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in names]
    )
    function: Any = intrinsic(typing)
    function.address = written.address
    return function
