"""The machine code of one LLVM module: compiled, or loaded where an earlier run has kept it (decision 8).

LLVM cannot be interrupted. Where there is a time limit, a process of its own compiles what takes long (decision 63).
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib import resources
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Literal

from llfsm_verify.interrupts import whole
from llfsm_verify.kept import fingerprint, keep_newest, keeping_meanwhile, kept, place
from llfsm_verify.limits import budget_in_force

Effort = Literal["quick", "full", "thorough"]
LEVELS: dict[Effort, int] = {"quick": 0, "full": 1, "thorough": 2}
SECONDS_A_LINE: dict[Effort, float] = {"quick": 3.5e-6, "full": 50e-6, "thorough": 90e-6}
"""About what a line of LLVM text costs to compile (2 GHz, LLVM 22)."""
WORTH_A_PROCESS = 0.4
"""Seconds from which a process compiles, which itself takes 0.2 s to begin, where there is a time limit."""
LOOK_SECONDS = 0.05
"""How often the limit is looked at meanwhile."""
WORTH_KEEPING = 0.1
"""Seconds from which machine code is kept: small modules are compiled faster than many files are looked after."""
COUNT = 8
"""Bytes before kept machine code that count the lines of its text."""
MOST_KEPT = 32
"""Modules whose machine code is kept; the one that was compiled longest ago goes first."""


class MachineCode:
    """The compiled module; it lives as long as this object.

    Quick: locals in registers, tidy branches, the fast instruction selector. Full: LLVM's -O1, which also inlines.
    Thorough: -O2, for loops that go round for hours.
    """

    @whole
    def __init__(self, text: Callable[[], str], effort: Effort, name: str | None = None) -> None:
        """`text` writes the module. `name`: says all that decides what it writes, so that code, however
        small, is kept under it, and loaded without the text; None: nothing shorter than the text does, and code is kept
        that took long."""
        import llvmlite.binding as llvm

        self.effort = effort
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        path, module = None if name is None else _path(name, effort), ""
        found = kept(path)
        if found is None:
            module = text()
            self.lines = module.count("\n")
            if path is None and self.lines * SECONDS_A_LINE[effort] >= WORTH_KEEPING:
                path = _path(module, effort)
                found = kept(path)
        if found is None:
            budget = budget_in_force()
            with keeping_meanwhile():
                if budget is None or not budget.has_end or self.lines * SECONDS_A_LINE[effort] < WORTH_A_PROCESS:
                    self._engine = _compiled(module, effort, path)
                else:
                    made = compiled_apart(module, effort, budget.check_time)
                    self._engine = _loaded(_kept(path, module, made), effort)
        else:
            self.lines = int.from_bytes(found[:COUNT], "little")
            self._engine = _loaded(found[COUNT:], effort)

    def address(self, function: str) -> int:
        """The address of an exported function."""
        found: int = self._engine.get_function_address(function)
        return found


def _target_machine(effort: Effort) -> Any:
    import llvmlite.binding as llvm

    return llvm.Target.from_default_triple().create_target_machine(cpu=llvm.get_host_cpu_name(), opt=LEVELS[effort])


def _compiled(text: str, effort: Effort, path: Path | None) -> Any:
    """The engine with the module, compiled; its object file is kept at `path`, where that can be."""
    import llvmlite.binding as llvm

    machine = _target_machine(effort)
    module = llvm.parse_assembly(text)
    optimise(module, machine, LEVELS[effort])
    engine = llvm.create_mcjit_compiler(module, machine)
    if path is None:
        engine.finalize_object()
        return engine
    made: list[bytes] = []
    engine.set_object_cache(lambda _, code: made.append(code))
    engine.finalize_object()
    _kept(path, text, made[-1])
    return engine


def _kept(path: Path | None, text: str, code: bytes) -> bytes:
    """The machine code, kept for later runs where there is a path; where that fails, it is compiled in each run."""
    if path is not None:
        keep_newest(path, text.count("\n").to_bytes(COUNT, "little") + code, MOST_KEPT)
    return code


def compiled_apart(text: str, effort: Effort, check: Callable[[], None]) -> bytes:
    """The object file of a module, which another process makes; what `check` raises, now and then, ends it.

    RuntimeError: it has ended without one."""
    command = [sys.executable, "-c", f"from {__name__} import main; main()", effort]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    pipe = subprocess.PIPE
    with TemporaryFile() as given:
        given.write(text.encode())
        given.seek(0)
        # A session of its own: Ctrl-C is for this process, which then ends the other.
        with subprocess.Popen(  # noqa: S603 - our own code, and nothing of the user's is in the command
            command, stdin=given, stdout=pipe, stderr=pipe, env=environment, start_new_session=True
        ) as process:
            try:
                while True:
                    with suppress(subprocess.TimeoutExpired):
                        code, errors = process.communicate(timeout=LOOK_SECONDS)
                        break
                    check()
            finally:
                process.kill()
    if process.returncode or not code:
        raise RuntimeError(f"compiling to machine code failed (status {process.returncode}): {errors.decode()[-500:]}")
    return code


def main() -> None:
    """The process that compiles: the module comes on standard input, the object file goes to standard output."""
    effort: Effort = sys.argv[1]  # type: ignore[assignment]
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine, module = _target_machine(effort), llvm.parse_assembly(sys.stdin.buffer.read().decode())
    optimise(module, machine, LEVELS[effort])
    sys.stdout.buffer.write(machine.emit_object(module))


def _loaded(code: bytes, effort: Effort) -> Any:
    """The engine with a module that an earlier run has compiled."""
    import llvmlite.binding as llvm

    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine(effort))
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


def _path(origin: str, effort: Effort) -> Path | None:
    """The file for the machine code of a module, named after everything that decides it: its text or what decides that,
    and the compiler."""
    return place(f"program-{fingerprint(origin, effort, *_compiler())}.o")


@cache
def _compiler() -> tuple[bytes | str, ...]:
    """What decides the machine code beside the module: this file, LLVM, and the processor."""
    import llvmlite
    import llvmlite.binding as llvm

    here = resources.files("llfsm_verify.backends.native").joinpath("machine_code.py").read_bytes()
    features = llvm.get_host_cpu_features().flatten()
    return here, llvmlite.__version__, llvm.get_default_triple(), llvm.get_host_cpu_name(), features


# ---- LLVM's optimisations of a module, and what they need freed after them


def optimise(module: Any, machine: Any, level: int) -> None:
    """LLVM's -O1 to -O3; 0: only locals in registers and tidy branches, without what takes long."""
    import llvmlite.binding as llvm
    from llvmlite.binding.newpassmanagers import NewPassManager

    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=max(1, level)))
    if level:
        passes = builder.getModulePassManager()
    else:
        passes = llvm.create_new_module_pass_manager()
        passes.add_sroa_pass()
        passes.add_simplify_cfg_pass()
    passes.run(module, builder)
    # In llvmlite (0.45 to 0.50) a `ModulePassManager` inherits `_dispose` from a class where it does nothing, so each
    # would keep 0.1 MB.
    NewPassManager._dispose(passes)
    passes.detach()
