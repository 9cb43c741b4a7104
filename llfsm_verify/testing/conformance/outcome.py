"""Cases of a conformance suite, and what comes of one: passed, or what was wrong in a sentence."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib.util import find_spec

from llfsm_verify.testing.conformance.stopping import Overdue, within

PATIENCE = 120.0
"""Seconds of processor time after which a case is ended."""


class Wrong(Exception):
    """What a case found to be wrong, in a sentence without its full stop."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one case."""

    name: str
    passed: bool
    wrong: str = ""
    """What was wrong, in a sentence without its full stop."""
    seconds: float = 0.0
    """Processor time that it took."""


@dataclass(frozen=True, slots=True)
class Case:
    """One thing that is looked at. Calling it gives its outcome."""

    name: str
    about: str
    """What it looks at, in a sentence without its full stop."""
    look: Callable[[], None]
    """Raises Wrong."""
    patience: float = PATIENCE
    """Seconds of processor time after which it is ended, as far as Python code runs in the main thread."""

    def __str__(self) -> str:
        return self.name

    def __call__(self) -> Outcome:
        started = time.process_time()
        wrong = self._wrong()
        return Outcome(self.name, not wrong, wrong, time.process_time() - started)

    def _wrong(self) -> str:
        try:
            with within(self.patience):
                self.look()
        except Wrong as wrong:
            return str(wrong)
        except Overdue:
            return f"it did not end within {self.patience:g} s of processor time"
        except (Exception, SystemExit) as error:  # noqa: BLE001 - whatever an engine of others raises is what is reported
            return f"{type(error).__name__}: {error}".replace("\n", " ").rstrip(".")
        return ""


def outcomes_of(cases: Iterable[Case]) -> list[Outcome]:
    """The outcomes, in the order of the cases."""
    return [case() for case in cases]


def demand_hypothesis() -> None:
    """Raises ModuleNotFoundError where there is no Hypothesis, which draws the random cases."""
    if find_spec("hypothesis") is None:
        install = "pip install 'llfsm-verify[testing]', or ask for none of them (drawn=0)"
        raise ModuleNotFoundError(f"random cases need Hypothesis, which is not installed: {install}", name="hypothesis")
