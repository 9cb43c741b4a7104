"""Packages that are not installed, told as something that the user can mend."""

from __future__ import annotations

from llfsm_verify.diagnostics import Diagnostic
from llfsm_verify.registry import extensions

CODE = "E464"
PACKAGES = {
    "lark": "lark",
    "llvmlite": "llvmlite",
    "numba": "numba",
    "numpy": "numpy",
    "rich": "rich",
    "yaml": "pyyaml",
    "z3": "z3-solver",
}
"""What each module that we import is called by `pip`."""


def missing_package(error: ModuleNotFoundError) -> Diagnostic | None:
    """What to install; None: the module is not one of another package, so that it is our mistake."""
    entries = [entry for group in extensions().values() for entry in group]
    names = PACKAGES | {entry.package.module: entry.package.name for entry in entries if entry.package}
    extras = {entry.package.module: entry.package.extra for entry in entries if entry.package}
    module = (error.name or "").partition(".")[0]
    package = names.get(module)
    if package is None:
        return None
    message = f"this needs the package {package}, which is not installed"
    ours = f", or in our folder with `pip install -e '.[{extras[module]}]'`" if module in extras else ""
    return Diagnostic(CODE, message, hint=f"install it with `pip install {package}`{ours}")
