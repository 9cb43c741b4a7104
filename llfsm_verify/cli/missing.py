"""Packages that are not installed, told as something that the user can mend."""

from __future__ import annotations

from llfsm_verify.diagnostics import Diagnostic

CODE = "E464"
PACKAGES = {
    "lark": "lark",
    "mcap": "mcap",
    "llvmlite": "llvmlite",
    "numba": "numba",
    "numpy": "numpy",
    "paho": "paho-mqtt",
    "pyarrow": "pyarrow",
    "rich": "rich",
    "serial": "pyserial",
    "textual": "textual",
    "vcd": "pyvcd",
    "yaml": "pyyaml",
    "z3": "z3-solver",
}
"""What each module that we import is called by `pip`."""
EXTRAS = {
    "mcap": "trace", "paho": "mqtt", "pyarrow": "parquet", "serial": "serial", "textual": "debug", "vcd": "trace",
}  # fmt: skip
"""The extra that brings a module, where it is no dependency."""


def missing_package(error: ModuleNotFoundError) -> Diagnostic | None:
    """What to install; None: the module is not one of another package, so that it is our mistake."""
    module = (error.name or "").partition(".")[0]
    package = PACKAGES.get(module)
    if package is None:
        return None
    message = f"this needs the package {package}, which is not installed"
    wanted = f"'llfsm-verify[{EXTRAS[module]}]'" if module in EXTRAS else package
    return Diagnostic(CODE, message, hint=f"install it with `pip install {wanted}`")
