"""The kernels as LLVM text: shipped with the package, or made by numba.

What numba costs at a first run is type inference, which ends in a text that does not depend on the processor. So the
package has these texts, and a first run leaves only their translation into machine code to LLVM
(docs/decisions/0008-kernels.md). They are used where nothing has changed since they were made: the source of the
kernels, LLVM's main version, and the kind of machine. `python -m tools.kernels` makes them, and with ``--check`` makes
them again and compares.
"""

from __future__ import annotations

import json
from functools import cache
from importlib import import_module, resources
from typing import Any

from llfsm_verify.interrupts import whole
from llfsm_verify.kept import fingerprint
from llfsm_verify.kripke.kernels.entries import SHARED

PACKAGE = "llfsm_verify.kripke.kernels"
PREFIX = "llfsm_"
"""What the name of a kernel's function begins with."""
ARCHIVE, INDEX = "texts.zip", "index.json"
"""The file of this package with a text a kernel, and which entry says what they were made from."""


def sources(module: str) -> list[bytes]:
    """The text of everything that decides what the kernels of a module are."""
    return [resources.files(PACKAGE).joinpath(f"{name}.py").read_bytes() for name in (*SHARED, module)]


@cache
def origin(module: str) -> list[str]:
    """What the text of a module's kernels depends on, in words that are equal where the text may be used."""
    import llvmlite.binding as llvm

    return [fingerprint(*sources(module)), f"LLVM {llvm.llvm_version_info[0]}", llvm.get_default_triple()]


def shipped(name: str, module: str) -> str | None:
    """The text of a kernel that came with the package; None: there is none for this installation."""
    from zipfile import ZipFile

    path = resources.files(PACKAGE).joinpath(ARCHIVE)
    if not path.is_file():
        return None
    with path.open("rb") as file, ZipFile(file) as archive:
        made = json.loads(archive.read(INDEX))
        return archive.read(f"{name}.ll").decode() if made.get(name) == origin(module) else None


def translated(name: str, module: str) -> str:
    """The text of a kernel by numba, without its wrappers for Python: the function `llfsm_` and its name, and what that
    calls."""
    import_module(f"{PACKAGE}.{module}")
    return _text(name, import_module(f"{PACKAGE}.words").ENTRIES[name]())


@whole
def _text(name: str, dispatcher: Any) -> str:
    import llvmlite.binding as llvm

    compiled = dispatcher.overloads[dispatcher.signatures[0]]
    module = llvm.parse_assembly(compiled.library.get_llvm_str())
    defined = [f for f in (*module.functions, *module.global_variables) if not f.is_declaration]
    for number, each in enumerate(defined):
        if each.name == compiled.fndesc.llvm_func_name:
            each.name = PREFIX + name
        else:
            each.linkage = "internal"
            each.name = f"{name}_{number}"
    builder = llvm.create_pass_builder(_machine(), llvm.create_pipeline_tuning_options(speed_level=3))
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, builder)
    module.name = name
    return str(module)


def _machine() -> Any:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    return llvm.Target.from_default_triple().create_target_machine()
