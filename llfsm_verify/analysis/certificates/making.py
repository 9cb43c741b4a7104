"""The certificate of a result: the sections put together, and what of the result is not certified; and a certificate
beside one made anew, where what its verifier only believes is to be the same in both.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

from llfsm_verify.analysis.certificates.inputs import inputs_json
from llfsm_verify.analysis.certificates.proofs import Nodes, RunRecorder, edges_of, explore, follow, proof_of
from llfsm_verify.analysis.certificates.written import MonitorAutomaton, Shelf, formula_json
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.checking.claims import Claim, add_premises, claim_of
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed, bad_prefixes_of
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.verdict import FaultResult, PropertyResult, Result, Verdict
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.product_search import Product
from llfsm_verify.limits import Budget, LimitReached, Limits, tick
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.program.json import program_json

FORMAT = "llfsm-certificate 1"
NOT_NOW = (LimitReached, AutomatonTooLarge, Unconfirmed, MemoryError)
"""What leaves one verdict without a certificate."""


NO_LIMITS = Limits()


@dataclass(frozen=True, slots=True)
class CertificateFile:
    """The text of the file, and the names of the verdicts that it does not certify, each with the reason."""

    text: str
    missing: tuple[tuple[str, str], ...]


def certificate(
    arrangement: Arrangement, properties: PropertySet, result: Result, folder: Path, limits: Limits = NO_LIMITS
) -> CertificateFile:
    """What proves the verdicts of `result` to `llfsm_verify.certificate`; `folder`: where its file will be.

    `limits` are those of this work alone. Raises Disagreement when a verdict cannot be right, KeyboardInterrupt.
    """
    return _Maker(arrangement, properties, result, limits).made(folder)


def canonical(value: Json) -> str:
    """The one text of a value: keys in order, no spaces."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"))


def sign(sections: dict[str, Json]) -> str:
    """The text of a certificate of these sections, with their hashes."""
    digests: dict[str, Json] = {name: sha256(canonical(value).encode()).hexdigest() for name, value in sections.items()}
    return canonical({**sections, "digests": digests}) + "\n"


def _why(stop: BaseException) -> str:
    return str(stop) or "the memory ran out"


class _Maker:
    def __init__(self, arrangement: Arrangement, properties: PropertySet, result: Result, limits: Limits) -> None:
        self._arrangement, self._properties, self._result = arrangement, properties, result
        self._budget = Budget(limits)
        self._problem = bind(arrangement, properties)
        self._program = self._problem.program()
        self._explorer = Explorer(self._program, self._budget)
        self._bits = {name: i for i, name in enumerate(self._explorer.observed)}
        self._shelf = Shelf(self._bits)
        self._fair_bits = [self._bits[f.goal] for f in self._program.fairness if f.premise is None]
        self._missing: list[tuple[str, str]] = []
        self._incomplete: str | None = None

    def made(self, folder: Path) -> CertificateFile:
        with self._budget:
            return self._made(folder)

    def _made(self, folder: Path) -> CertificateFile:
        try:
            listed = self._explore()
            goals, around = self._goals(), self._around()
            items: list[Json] = [
                self._property(line, goal, item, around)
                for line, goal, item in zip(self._problem.properties, goals, self._result.properties, strict=True)
            ]
            faults = self._faults(self._result.faults)
            self._shelf.widen([*self._explorer.graph.alphabet, *self._explorer.first_letters])
            sections: dict[str, Json] = {
                "format": FORMAT,
                "inputs": inputs_json(self._arrangement, self._properties, folder),
                "program": program_json(self._program),
                "assumptions": self._assumptions(around),
                "premises": list(around[len(self._problem.assumptions) :]) if isinstance(around, list) else [],
                "configurations": listed,
                "steps": 0 if listed is None else self._explorer.steps,
                "faults": faults,
                "properties": items,
                "automata": self._shelf.document(),
            }
            return CertificateFile(sign(sections), tuple(self._missing))
        finally:
            self._explorer.close()

    # -------------------------------------------------- what all properties share

    def _explore(self) -> list[Json] | None:
        """All configurations; None: there is no need of them, or a limit was reached."""
        holds = [p.verdict is Verdict.HOLDS for p in self._result.properties]
        if not any(holds) and self._result.faults.verdict is not Verdict.HOLDS:
            self._incomplete = "nothing holds"
            return None
        try:
            explore(self._explorer)
            return self._configurations()
        except NOT_NOW as stop:
            self._incomplete = _why(stop)
            return None

    def _goals(self) -> Sequence[Goal | str]:
        """The goals; or for each why they cannot be made."""
        try:
            return goals_of(self._problem)
        except NOT_NOW as stop:
            return [_why(stop)] * len(self._problem.properties)

    @cached_property
    def _edges(self) -> list[list[tuple[int, int | None]]]:
        return edges_of(self._explorer.graph)

    @cached_property
    def _replayer(self) -> RunRecorder:
        return RunRecorder(Execution(self._program), self._problem.forgetting.moved)

    def _configurations(self) -> list[Json]:
        graph, layout = self._explorer.graph, self._explorer.layout
        nodes = Nodes(self._program, layout)
        found: list[Json] = []
        for node in range(len(graph)):
            tick()
            in_cycle = graph.has_silent_edges and graph.in_cycle(node)
            found.append(list(nodes(graph.record(node), in_cycle=in_cycle)))
        return found

    def _around(self) -> list[int] | str:
        """The automata of the assumptions and of fairness with a premise; or why they cannot be made."""
        claims = [claim_of(p, self._problem.clock) for p in self._problem.assumptions]
        try:
            return [
                *(self._claim(c, f"assume {p.text}") for c, p in zip(claims, self._problem.assumptions, strict=True)),
                *(self._claim(c, f"fairness: {c.formula}") for c in add_premises(self._program)),
            ]
        except NOT_NOW as stop:
            return _why(stop)

    def _claim(self, claim: Claim, about: str) -> int:
        return self._shelf.place(claim, about, claim.atoms, claim.automaton)

    def _assumptions(self, around: list[int] | str) -> list[Json]:
        if isinstance(around, str):
            return []
        return [
            {"name": p.name, "text": p.text, "formula": formula_json(p.formula, self._bits), "automaton": number}
            for p, number in zip(self._problem.assumptions, around, strict=False)
        ]

    # -------------------------------------------------- properties

    def _property(self, line: Property, goal: Goal | str, item: PropertyResult, around: list[int] | str) -> Json:
        found: dict[str, Json] = {
            "name": item.name,
            "kind": item.kind,
            "text": item.text,
            "formula": formula_json(line.formula, self._bits),
            "verdict": item.verdict.value,
        }
        nothing: dict[str, Json] = dict.fromkeys(
            ("reason", "violations", "early", "safe", "prefix", "lasso", "run", "trail")
        )
        nothing["safe"] = False
        try:
            if isinstance(goal, str):
                raise Unconfirmed(goal)
            if isinstance(around, str):
                raise Unconfirmed(around)
            if item.verdict is Verdict.UNKNOWN:
                raise Unconfirmed(item.reason or "its verdict is unknown")
            if item.verdict is Verdict.HOLDS and self._incomplete is not None:
                raise Unconfirmed(self._incomplete)
            return found | nothing | self._proved(goal, item, around)
        except NOT_NOW as stop:
            self._missing.append((item.name, _why(stop)))
            return found | nothing | {"reason": _why(stop)}

    def _proved(self, goal: Goal, item: PropertyResult, around: list[int]) -> dict[str, Json]:
        monitor, safe = bad_prefixes_of(goal)
        early = None
        assumed = bool(self._problem.assumptions)
        lasting = item.trace is not None and item.trace.loop is not None
        finite = item.trace is not None and not lasting
        if monitor is not None and (safe or finite or (not lasting and not assumed and self._explorer.graph.faults)):
            watch = MonitorAutomaton(monitor, len(goal.atoms))
            early = self._shelf.place((goal, "bad"), f"bad prefixes of {item.name}", goal.atoms, lambda: watch)
        wrong = None
        if not safe and not finite:

            def violations() -> Automaton | Lazy:
                return goal.violations()

            wrong = self._shelf.place((goal, "violations"), f"violations of {item.name}", goal.atoms, violations)
        chosen: dict[str, Json] = {"violations": wrong, "early": early, "safe": safe}
        last = early if wrong is None else wrong
        assert last is not None
        if item.trace is not None:
            run = self._replayer.run_of(item.trace)
            product = self._product([*around, last]) if lasting else self._product([last], alone=True)
            run, trail = follow(run, product, item.name)
            return chosen | {"run": run.json(), "trail": trail}
        first = self._explorer.first_letters
        proofs: dict[str, Json] = {}
        if early is not None and not assumed:
            alone = self._product([early], alone=True)
            proofs["prefix"] = proof_of(alone, self._edges, first, item.name)
            if self._shelf.bad(early) is not None:
                raise Disagreement(f"{item.name}: a bad prefix can be reached, although the search found none")
        if not (safe and proofs):
            whole = self._product([*around, last])
            proofs["lasso"] = proof_of(whole, self._edges, first, item.name)
        return chosen | proofs

    def _product(self, numbers: Sequence[int], *, alone: bool = False) -> Product:
        readers = [self._shelf.reader(number) for number in numbers]
        return Product(self._explorer.graph, readers, () if alone else self._fair_bits)

    # -------------------------------------------------- faults

    def _faults(self, faults: FaultResult) -> Json:
        found: dict[str, Json] = {"verdict": faults.verdict.value, "reason": None, "runs": []}
        try:
            if faults.verdict is Verdict.UNKNOWN:
                raise Unconfirmed(faults.reason or "its verdict is unknown")
            if faults.verdict is Verdict.HOLDS and self._incomplete is not None:
                raise Unconfirmed(self._incomplete)
            if faults.verdict is Verdict.HOLDS and self._explorer.graph.faults:
                raise Disagreement("a run ends in a fault, although the search found none")
            runs: list[Json] = []
            for finding in faults.findings:
                site = self._program.faults.index(finding.site)
                runs.append([site, self._replayer.run_of(finding.trace).json()])
            return found | {"runs": runs}
        except NOT_NOW as stop:
            self._missing.append(("faults", _why(stop)))
            return found | {"reason": _why(stop)}


SECTIONS = {
    "format": "its format is another one",
    "inputs": "its input files are others, or have changed",
    "program": "its step program is not that of the arrangement",
}
OF_PROOFS = {
    "automata": "its automata are not those of the properties",
    "assumptions": "its assumptions are not those of the properties",
    "premises": "its fairness is not that of the arrangement",
}
"""Sections that hold only what is certified: a certificate that a limit has cut short has less of them."""
OTHERS = "its properties, or the verdicts in it, are not those of the files"
NAMED = ("name", "kind", "text", "formula")
OF_PROPERTIES = (*NAMED, "verdict", "violations", "early", "safe")

Sections = dict[str, Any]
"""A certificate that the verifier has accepted: its shape is known."""


def differences(given: str, anew: str) -> tuple[list[str], list[str]]:
    """What of the text `given`, which the verifier has accepted, is not as in `anew`: a sentence for each part; and
    what cannot be compared, because only one of the two certifies it."""
    first, second = json.loads(given), json.loads(anew)
    unlike = [*_certified_once(first, second)]
    if unlike:
        found, more = _differences_in_parts(first, second)
        return found, [*unlike, *more]
    found = [said for name, said in (SECTIONS | OF_PROOFS).items() if canonical(first[name]) != canonical(second[name])]
    if _of_properties(first, OF_PROPERTIES) != _of_properties(second, OF_PROPERTIES) or (
        first["faults"]["verdict"] != second["faults"]["verdict"]
    ):
        found.append(OTHERS)
    return found, []


def _certified_once(first: Sections, second: Sections) -> Iterator[str]:
    listed = [[*side["properties"], {**side["faults"], "name": "faults"}] for side in (first, second)]
    if [p["name"] for p in listed[0]] != [p["name"] for p in listed[1]]:
        return  # then it is another certificate
    for one, other in zip(*listed, strict=True):
        if (one["reason"] is None) != (other["reason"] is None):
            where, reason = ("there", one["reason"]) if other["reason"] is None else ("now", other["reason"])
            plain = "".join(
                c if c.isprintable() else " " for c in f"{one['name']}, because it is not certified {where}: {reason}"
            )
            yield f"not compared: {plain}"


def _of_properties(side: Sections, keys: tuple[str, ...]) -> str:
    return canonical([[p[key] for key in keys] for p in side["properties"]])


# ---------------------------------------------------------------- where one of the two certifies less


def _differences_in_parts(first: Sections, second: Sections) -> tuple[list[str], list[str]]:
    """The same property by property, for those that both certify."""
    found = [said for name, said in SECTIONS.items() if canonical(first[name]) != canonical(second[name])]
    if _of_properties(first, NAMED) != _of_properties(second, NAMED):
        return [*found, OTHERS], []
    unlike: list[str] = []
    # Of assumptions more is written out the more is certified, and what is explored shapes the automata of a violation.
    alike = canonical(first["configurations"]) == canonical(second["configurations"])
    comparable = alike and not (second["assumptions"] or second["premises"] or second["configurations"] is None)
    pairs = [*zip(first["properties"], second["properties"], strict=True), (first["faults"], second["faults"])]
    for one, other in pairs:
        if one["reason"] is not None or other["reason"] is not None:
            continue
        if one["verdict"] != other["verdict"]:
            found.append(OTHERS)
        elif "name" in one and canonical(_believed(first, one)) != canonical(_believed(second, other)):
            if comparable:
                found.append(OF_PROOFS["automata"])
            else:
                unlike.append(f"not compared: {one['name']}, because its automata are not written out alike in both")
    return list(dict.fromkeys(found)), unlike


def _believed(side: Sections, of: Sections) -> Json:
    """What the verifier believes of a property, with its automata, and those of the assumptions, in full."""
    automata = side["automata"]
    assumed = [[a["name"], a["text"], a["formula"], automata[a["automaton"]]] for a in side["assumptions"]]
    premises = [automata[number] for number in side["premises"]]
    own = [None if number is None else automata[number] for number in (of["violations"], of["early"])]
    return [of["safe"], *own, assumed, premises]
