"""The kernels as machine code: compiled by numba once per installation, kept as an object file, loaded by llvmlite.

Numba's own cache is not used: it names a kernel by one file, so that an edited helper leaves it stale, it raises where
no folder can be written, and finding a kernel in it costs the import of numba (0.4 s). The object file is named after
everything it depends on, and a later run neither imports numba nor compiles (docs/decisions/0008-kernels.md).
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from importlib import import_module, resources
from pathlib import Path
from typing import Any

from llfsm_verify.backends.native.uninterrupted import whole
from llfsm_verify.files import read_regular, replacing
from llfsm_verify.kripke.kernels.entries import MODULES, SHARED
from llfsm_verify.stages import stage

PACKAGE = "llfsm_verify.kripke.kernels"
FOLDER = "LLFSM_CACHE"
"""The environment variable that names the folder for compiled kernels; else the user's cache folder is taken."""
PREFIX = "llfsm_"
LARGEST = 1 << 26
"""Bytes of a cached file; ours have some ten thousand."""
DIGEST = 32
"""Bytes of the check sum at the beginning of the cached file."""


class Kernels:
    """The kernels of this installation, loaded (and before, if need be, compiled) when they are first run."""

    def __init__(self) -> None:
        self.note: str | None = None
        """What to tell the user when compiled kernels could not be kept for the next run."""
        self.announce: Callable[[str], None] | None = None
        """Takes a sentence before the first compilation, which takes some seconds."""
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

    @stage("loading the search kernels")
    def _load(self, name: str) -> _Loaded:
        module = MODULES[name]
        folder = cache_folder()
        path = None if folder is None else folder / f"{name}-{_fingerprint(module)}.o"
        code = None if path is None else _cached(path)
        if code is None:
            if self.announce is not None:
                self.announce("compiling the search kernels, once for this installation")
                self.announce = None
            code = _compile(name, module)
            self.note = _keep(path, code) or self.note
        return _Loaded(name, code)


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


def cache_folder() -> Path | None:
    """Where compiled kernels are kept; None: nowhere is said, and the user has no home directory."""
    named, user = os.environ.get(FOLDER), os.environ.get("XDG_CACHE_HOME")
    try:
        if named:
            return Path(named).expanduser()
        if user and Path(user).is_absolute():
            return Path(user) / "llfsm-verify"
        return Path("~").expanduser() / ".cache" / "llfsm-verify"
    except RuntimeError:  # the user is unknown to this system, such as in a container
        return None


def _cached(path: Path) -> bytes | None:
    """The object file, unless it is missing, unreadable or damaged."""
    try:
        data = read_regular(path, LARGEST)
    except OSError:
        return None
    digest, code = data[:DIGEST], data[DIGEST:]
    return code if _check_sum(path, code) == digest else None


def _check_sum(path: Path, code: bytes) -> bytes:
    """Also of the file's name: a file that has come to the name of another holds no such kernel."""
    return sha256(path.name.encode() + b"\0" + code).digest()


def _keep(path: Path | None, code: bytes) -> str | None:
    """Write the object file, whole or not at all; else what to tell the user."""
    if path is None:
        return _not_kept("the user has no home directory")
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with replacing(path) as file:
            file.write(_check_sum(path, code) + code)
    except OSError as error:
        return _not_kept(f"{path.parent} cannot be written ({error.strerror or error})")
    return None


def _not_kept(why: str) -> str:
    return f"the search kernels were compiled for this run only, because {why}; {FOLDER}=FOLDER names another folder"


@cache
@whole
def _fingerprint(module: str) -> str:
    """A name for everything that decides what the object file of a module is."""
    import llvmlite
    import llvmlite.binding as llvm

    parts = [resources.files(PACKAGE).joinpath(f"{name}.py").read_bytes() for name in (*SHARED, module)]
    parts.append(resources.files("llfsm_verify.kripke").joinpath("compiled.py").read_bytes())
    # Each release of numba needs one of llvmlite, so llvmlite's version stands for both.
    about = [llvmlite.__version__, llvm.get_default_triple(), llvm.get_host_cpu_name(), _features()]
    parts += [text.encode() for text in about]
    return sha256(b"\0".join(sha256(p).digest() for p in parts)).hexdigest()[:32]


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


def _compile(name: str, module: str) -> bytes:
    """A kernel compiled by numba, as an object file without numba's wrappers for Python."""
    import_module(f"{PACKAGE}.{module}")
    return _object_file(name, import_module(f"{PACKAGE}.words").ENTRIES[name])


@whole
def _object_file(name: str, make: Callable[[], Any]) -> bytes:
    import llvmlite.binding as llvm

    dispatcher = make()
    compiled = dispatcher.overloads[dispatcher.signatures[0]]
    whole = llvm.parse_assembly(compiled.library.get_llvm_str())
    for function in whole.functions:
        if function.name == compiled.fndesc.llvm_func_name:
            function.name = PREFIX + name
        elif not function.is_declaration:
            function.linkage = "internal"
    for variable in whole.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    machine = _target_machine()
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(whole, builder)
    code: bytes = machine.emit_object(whole)
    return code
