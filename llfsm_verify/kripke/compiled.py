"""The kernels as machine code: compiled once per installation, kept as an object file, loaded by llvmlite.

Numba's own cache is not used: it names a kernel by one file, so that an edited helper leaves it stale, it raises where
no folder can be written, and finding a kernel in it costs the import of numba (0.4 s). The object file is named after
everything it depends on, and a later run neither imports numba nor compiles (docs/decisions/0008-kernels.md).
"""

from __future__ import annotations

import ctypes
from functools import cache
from importlib import resources
from typing import Any

from llfsm_verify.diagnostics import tell
from llfsm_verify.interrupts import whole
from llfsm_verify.kept import FOLDER, fingerprint, keep, kept, place
from llfsm_verify.kripke.kernels.entries import MODULES
from llfsm_verify.kripke.texts import PREFIX, shipped, sources, translated
from llfsm_verify.stages import stage


class Kernels:
    """The kernels of this installation, loaded (and before, if need be, compiled) when they are first run."""

    def __init__(self) -> None:
        self._told: set[str] = set()
        """What the user knows already."""
        self._loaded: dict[str, _Loaded] = {}

    def run(self, name: str, block: int) -> int:
        """Call a kernel with the address of its control block; its code. Raises KeyError for an unknown kernel."""
        loaded = self._loaded.get(name)
        if loaded is None:
            loaded = self._loaded[name] = self._load(name)
        return loaded.call(block)

    def load_all(self) -> None:
        """Compile what is not in the cache yet, so that nothing is compiled later on."""
        self.load(*MODULES)

    def load(self, *names: str) -> None:
        """The same for some kernels."""
        for name in names:
            if name not in self._loaded:
                self._loaded[name] = self._load(name)

    def _translated(self, name: str, module: str) -> str:
        self._tell("compiling the search kernels, once for this installation", warns=False)  # it takes some seconds
        return translated(name, module)

    @stage("loading the search kernels")
    def _load(self, name: str) -> _Loaded:
        module = MODULES[name]
        path = place(f"{name}-{_fingerprint(module)}.o")
        code = kept(path)
        if code is None:
            code = _object_file(shipped(name, module) or self._translated(name, module))
            why = keep(path, code)
            if why is not None:
                self._tell(
                    f"the search kernels were compiled for this run only, because {why}; "
                    f"{FOLDER}=FOLDER names another folder"
                )
        return _Loaded(name, code)

    def _tell(self, text: str, *, warns: bool = True) -> None:
        if text not in self._told and tell(text, warns=warns):
            self._told.add(text)


@cache
def kernels() -> Kernels:
    """The kernels of this installation."""
    return Kernels()


class _Loaded:
    """One kernel in memory."""

    @whole
    def __init__(self, name: str, code: bytes) -> None:
        import llvmlite.binding as llvm

        self._name = name
        self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine())
        self._engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        self._engine.finalize_object()
        # What numba makes of int64(int64): status(result*, exception**, argument).
        word, pointer = ctypes.c_int64, ctypes.c_void_p
        address = self._engine.get_function_address(PREFIX + name)
        self._function = ctypes.CFUNCTYPE(ctypes.c_int32, pointer, pointer, word)(address)

    def call(self, block: int) -> int:
        result, exception = ctypes.c_int64(), ctypes.c_void_p()
        if self._function(ctypes.byref(result), ctypes.byref(exception), block):
            raise AssertionError(f"the kernel {self._name} raised an exception")
        return result.value


@cache
@whole
def _fingerprint(module: str) -> str:
    """A name for everything that decides what the object file of a module is."""
    import llvmlite
    import llvmlite.binding as llvm

    here = resources.files("llfsm_verify.kripke")
    parts = [*sources(module), *(here.joinpath(f"{name}.py").read_bytes() for name in ("compiled", "texts"))]
    # Each release of numba needs one of llvmlite, so llvmlite's version stands for both.
    return fingerprint(*parts, llvmlite.__version__, llvm.get_default_triple(), llvm.get_host_cpu_name(), _features())


def _features() -> str:
    import llvmlite.binding as llvm

    features: str = llvm.get_host_cpu_features().flatten()
    return features


def _target_machine() -> Any:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(cpu=llvm.get_host_cpu_name(), features=_features(), opt=3, jit=True)


@whole
def _object_file(text: str) -> bytes:
    """The text of a kernel as machine code for this processor."""
    import llvmlite.binding as llvm

    machine = _target_machine()
    code: bytes = machine.emit_object(llvm.parse_assembly(text))
    return code
