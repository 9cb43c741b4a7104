"""LLVM's optimisations of a module, and what they need freed after them."""

from __future__ import annotations

from typing import Any


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
