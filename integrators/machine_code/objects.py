"""From LLVM's language to functions in memory, by llvmlite.

Compiling takes a second; the object that it gives can be stored and is loaded in milliseconds.
llvmlite is imported when one of these functions is called first.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Collection
from typing import Any

__all__ = ["Library", "compiled", "compiled_at_once", "has_wide_vectors", "target_name"]

_lock = threading.RLock()  # LLVM's settings are those of the process


@functools.cache
def _binding() -> Any:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm


def _machine(effort: int = 2) -> Any:
    llvm = _binding()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=llvm.get_host_cpu_features().flatten(),
        opt=effort,
        reloc="pic",
        codemodel="jitdefault",
    )


def target_name() -> str:
    """Return what an object depends on besides its text: LLVM and the processor.

    Returns
    -------
    str
        Objects can be loaded where this text is the same.
    """
    llvm = _binding()
    version = ".".join(map(str, llvm.llvm_version_info))
    features = llvm.get_host_cpu_features().flatten()
    return f"{version} {llvm.get_default_triple()} {llvm.get_host_cpu_name()} {features}"


@functools.cache
def has_wide_vectors() -> bool:
    """Return whether this processor computes eight numbers side by side."""
    return bool(_binding().get_host_cpu_features().get("avx512f"))


def _builder(machine: Any, speed: int, *, vectors: bool = False) -> Any:
    llvm = _binding()
    options = llvm.create_pipeline_tuning_options(speed_level=speed)
    # Short loops are not worth vectors; lanes are.
    options.loop_vectorization = vectors
    options.slp_vectorization = vectors
    return llvm.create_pass_builder(machine, options)


def compiled_at_once(text: str) -> bytes:
    """Return the object of a module in a tenth of the time; it computes the same, more slowly."""
    with _lock:
        module = _parsed(text)
        machine = _machine(0)
        builder = _builder(machine, 0)
        builder.getModulePassManager().run(module, builder)
        return bytes(machine.emit_object(module))


def _parsed(text: str) -> Any:
    module = _binding().parse_assembly(text)
    module.verify()
    return module


def compiled(text: str, hot: Collection[str] | None = None, *, vectors: bool = False) -> bytes:
    """Return the object of a module.

    Parameters
    ----------
    text : str
        From `integrators.machine_code.llvm.llvm_text`.
    hot : collection of str, optional
        The functions in which the time is spent; the others are made only a little slower, in much
        less time. All of them if omitted.
    vectors : bool
        Whether numbers side by side are computed together: the bits are the same.

    Returns
    -------
    bytes
        The object, for this processor.

    Examples
    --------
    >>> text = "define double @half(double %x) { %y = fmul double %x, 0.5 ret double %y }"
    >>> import ctypes
    >>> library = Library(compiled(text))
    >>> ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(library.address("half"))(3.0)
    1.5
    """
    with _lock:
        module = _parsed(text)
        machine = _machine()
        thorough = _builder(machine, 3, vectors=vectors)
        builder = thorough if hot is None else _builder(machine, 1, vectors=vectors)
        builder.getModulePassManager().run(module, builder)
        if hot is not None:
            passes = thorough.getFunctionPassManager()
            for function in module.functions:
                if function.name in hot and not function.is_declaration:
                    passes.run(function, thorough)
        return bytes(machine.emit_object(module))


class Library:
    """An object loaded into this process.

    Parameters
    ----------
    content : bytes
        From `compiled`. Damaged bytes may end the process: whoever stores them compares a hash.
    """

    def __init__(self, content: bytes) -> None:
        self._engines: list[Any] = []
        self.add(content)

    def add(self, content: bytes, known: Collection[str] = ()) -> None:
        """Load a further object, which may call these entries of those before.

        It has an engine of its own: in one, LLVM takes the table of offsets of the first object for
        that of the second, and calls between functions of this one go astray.
        """
        llvm = _binding()
        with _lock:
            module = llvm.parse_assembly("".join(f"declare void @{name}()\n" for name in known))
            engine = llvm.create_mcjit_compiler(module, _machine())
            for name in known:
                engine.add_global_mapping(module.get_function(name), self.address(name))
            engine.add_object_file(llvm.ObjectFileRef.from_data(content))
            engine.finalize_object()
            self._engines.append(engine)

    def address(self, name: str) -> int:
        """Return the address of an entry."""
        found = (each.get_function_address(name) for each in self._engines)
        return next(filter(None, found), 0)

    def variable(self, name: str) -> int:
        """Return the address of a global variable."""
        found: int = self._engines[0].get_global_value_address(name)
        return found
