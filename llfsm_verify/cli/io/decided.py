"""What is said of properties that were decided on something that happened."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from llfsm_verify.cli.io.output import Output
from llfsm_verify.logic.properties import asked_text
from llfsm_verify.report.wording import name_cell
from llfsm_verify.runtime.deciding.recordings import Decided

if TYPE_CHECKING:
    from llfsm_verify.runtime.deciding.frames import FrameMonitors
    from llfsm_verify.runtime.deciding.surroundings import Followed

VIOLATED, UNDECIDED = 1, 4


def say_decided(found: Sequence[tuple[Decided, str]], *, allow_undecided: bool = False) -> int:
    """Prints each verdict and what there is to say of it; returns the exit code."""
    width = max((len(d.verdict) for d, _ in found), default=0)
    names = max((len(name_cell(d.line.name)) for d, _ in found), default=0)
    output = Output()
    for decided, said in found:
        line = decided.line
        below = f"{' ' * (width + names + 4)}{said}\n" if said else ""
        asked = asked_text(line.kind, line.text)
        output.plain(f"{decided.verdict:{width}}  {name_cell(line.name):{names}}  {asked}\n{below}")
    verdicts = {d.verdict for d, _ in found}
    open_ones = "undecided" in verdicts and not allow_undecided
    return VIOLATED if "violated" in verdicts else UNDECIDED if open_ones else 0


def say_followed(followed: Followed, *, allow_undecided: bool = False) -> int:
    """The same of what surroundings did, compared with their models."""
    named = ", ".join(f"`{name}`" for name in followed.plants)
    verdict = followed.verdict
    below = f"{' ' * len(verdict)}  {'because ' if verdict == 'undecided' else ''}{followed.said}"
    Output().plain(f"{verdict}  the run keeps to {named} of `environment`\n{below}\n")
    return VIOLATED if verdict == "violated" else UNDECIDED if verdict == "undecided" and not allow_undecided else 0


def when_decided(decided: Decided) -> str:
    """The step and frame, or why it is undecided."""
    if decided.step == 0:
        return "before the first step"
    if decided.step is not None:
        return f"at step {decided.step:,}, in frame {decided.frame:,}"
    return f"because {decided.reason}" if decided.reason else ""


def say_results(monitors: FrameMonitors) -> int:
    """The same of properties that were decided on frames."""
    if monitors.first not in (None, 1):
        Output().plain(f"everything is as from frame {monitors.first:,}, the first one that was read\n")
    return say_decided([(d, when_decided(d)) for d in monitors.results])
