"""The results of several searches as one, and what they leave of the time."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import FAULTS, Attempt, FaultResult, Options, PropertyResult, Result, Verdict
from llfsm_verify.kripke.labels.sizes import InputNote


def time_left(options: Options, seconds: float) -> Options | None:
    """The options with what is left of the time; None: nothing is."""
    timeout = options.limits.timeout
    if timeout is None:
        return options
    if seconds >= timeout:
        return None
    return replace(options, limits=options.limits.within(timeout - seconds))


class Merging:
    """The results of several engines as one: for each property, and for faults, that of the first engine to decide."""

    def __init__(self, problem: Problem, *, faults: bool = True) -> None:
        """`faults`: they are also to be decided."""
        self._wants_faults = faults
        self._order = [p.name for p in problem.properties]
        self._results: list[Result] = []
        self._attempts: list[Attempt] = []
        self._found: dict[str, PropertyResult] = {}
        self._faults: FaultResult | None = None
        self._why: dict[str | None, list[tuple[str, str]]] = {None: [], **{name: [] for name in self._order}}
        """Why engines did not decide a property, or faults (None), in their order."""

    @property
    def asked(self) -> bool:
        """An engine has been."""
        return bool(self._results)

    @property
    def last(self) -> Attempt:
        """What the last engine did."""
        return self._attempts[-1]

    @property
    def decided(self) -> bool:
        """Nothing is left to look at."""
        found = self._faults_known or not self._wants_faults
        return self.asked and found and not any(self._is_open(name) for name in self._order)

    @property
    def _faults_known(self) -> bool:
        return self._faults is not None and self._faults.verdict is not Verdict.UNKNOWN

    def _is_open(self, name: str) -> bool:
        found = self._found.get(name)
        return found is None or found.verdict is Verdict.UNKNOWN

    def open(self, problem: Problem) -> Problem:
        """What is left to look at."""
        return replace(problem, properties=tuple(p for p in problem.properties if self._is_open(p.name)))

    def add(self, engine: str, result: Result) -> None:
        """What an engine says about properties that were open, or about all of them."""
        decided: list[str] = []
        whys: list[tuple[str | None, str | None]] = []
        for item in result.properties:
            if item.verdict is Verdict.UNKNOWN:
                whys.append((item.name, item.reason))
                self._found.setdefault(item.name, item)
            else:
                decided.append(item.name)
                if self._is_open(item.name):
                    self._found[item.name] = item
        faults = result.faults
        if faults.verdict is Verdict.UNKNOWN:
            if self._wants_faults:
                whys.append((None, faults.reason))
            self._faults = self._faults or faults
        else:
            decided.append(FAULTS)
            if not self._faults_known:
                self._faults = faults
        for name, reason in whys:
            self._why[name].append((engine, reason or "not decided"))
        reasons = tuple(dict.fromkeys(reason for _, reason in whys if reason is not None))
        self._attempts.append(Attempt(engine, result.seconds, tuple(decided), reasons))
        self._results.append(result)

    def result(self, engine: str, seconds: float) -> Result:
        """All of it, under the name `engine`; of one engine alone its own. The counts are those of the search that came
        farthest."""
        explored = [r for r in self._results if r.exploration.depth is None] or self._results
        base = max(explored, key=lambda r: r.exploration.states)
        if len(self._results) == 1:
            return base
        return replace(self._merged(base, engine, seconds), attempts=tuple(self._attempts))

    def _merged(self, base: Result, engine: str, seconds: float) -> Result:
        """All of it; what is said beside verdicts is that of `base`."""
        assert self._faults is not None
        return replace(
            base,
            engine=engine,
            seconds=seconds,
            properties=tuple(self._said(name) for name in self._order),
            faults=replace(self._faults, reason=self._reason(None, self._faults.verdict)),
            interrupted=any(r.interrupted for r in self._results),
            escape=next((r.escape for r in self._results if r.escape is not None), None),
        )

    def _said(self, name: str) -> PropertyResult:
        found = self._found[name]
        return replace(found, reason=self._reason(name, found.verdict))

    def _reason(self, name: str | None, verdict: Verdict) -> str | None:
        return self._joined(self._why[name]) if verdict is Verdict.UNKNOWN else None

    def _joined(self, whys: Sequence[tuple[str, str]]) -> str:
        return "; ".join(f"{engine}: {reason}" for engine, reason in whys)


class MergingGroups(Merging):
    """The results of one engine for groups of properties as one, which looks as if they were searched together. Of what
    is searched again the last result counts."""

    def add(self, engine: str, result: Result) -> None:
        """What the engine says of a group, and of faults, of which the search that came farthest knows most."""
        super().add(engine, result)
        if self._faults is None or len(result.faults.findings) > len(self._faults.findings):
            self._faults = result.faults

    def result(self, engine: str, seconds: float) -> Result:
        """All of it. The counts are those of the largest group that was explored to its end, if any was."""
        last = {p.name: r for r in self._results for p in r.properties}
        final = tuple({id(r): r for r in last.values()}.values())
        base = max(final, key=lambda r: (r.complete, r.exploration.states))
        notes: dict[tuple[str, ...], InputNote] = {}
        for note in (n for r in final for n in r.exploration.inputs):
            other = notes.setdefault(note.inputs, note)
            if (note.classes or note.values) > (other.classes or other.values):
                notes[note.inputs] = note
        longest = next((r.exploration.longest for r in final if r.exploration.longest is not None), None)
        undecided = [r for name, r in last.items() if self._is_open(name)]
        complete = base.complete and self._faults_known and all(r.complete for r in undecided)
        left_out = tuple(n for n in base.exploration.left_out if all(n in r.exploration.left_out for r in final))
        explored = replace(
            base.exploration, complete=complete, left_out=left_out, inputs=tuple(notes.values()), longest=longest
        )
        return replace(self._merged(base, engine, seconds), complete=complete, exploration=explored)

    def again(self, problem: Problem, reasons: Collection[str]) -> Problem | None:
        """What was last not decided for one of these reasons; None: nothing."""
        lines = tuple(p for p in self.open(problem).properties if self._said(p.name).reason in reasons)
        faults = self._wants_faults and not self._faults_known and self._reason(None, Verdict.UNKNOWN) in reasons
        return replace(problem, properties=lines) if lines or faults else None

    def _joined(self, whys: Sequence[tuple[str, str]]) -> str:
        return whys[-1][1] if whys else ""
