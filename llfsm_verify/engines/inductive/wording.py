"""Invariants in the names that users know, and what stands beside a configuration described by what it is."""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby

from llfsm_verify.backends.smt.arithmetic import OURS, Integers
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.goals.kinds import FormulaGoal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import Proof
from llfsm_verify.diagnostics import counted
from llfsm_verify.engines.inductive.certify import CheckedProof
from llfsm_verify.engines.inductive.invariant import Invariant, formula_text
from llfsm_verify.engines.inductive.observers import FairLoops, Faults, Prefixes, Rounds, Scalar, text_of
from llfsm_verify.engines.inductive.system import System
from llfsm_verify.engines.unrolled.runs import BAD, Table
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.logic.formula import Formula, is_plain, to_text
from llfsm_verify.logic.progression import progress
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.logic.rewriting.simplify import simplified
from llfsm_verify.program.program import Const, Get, Int, Local, Program, Var
from llfsm_verify.program.trees import nodes
from llfsm_verify.values import value_text

CONTROL = {
    "entered": "{0} has run the on_entry of its state",
    "clock": "cycles since the clock of {0}'s state was started",
    "age": "how many of the times that {0}'s state waits for have passed",
    "timely": "{0}'s state does not stay too early forever",
    "finished": "{0} is finished",
    "loaded": "{0} is loaded",
    "suspended": "{0} is suspended",
    "pending": "the command that waits for {0}",
    "remembered": "the state that {0} resumes",
    "turn": "the machine that takes the next turn",
    "ended": "the arrangement has ended",
    "accepting": "every machine has accepted in this cycle so far",
    "begins": "a cycle begins",
}
"""What control variables mean; {0} is the machine or process that they belong to."""
HIDDEN = {
    "$held.": "`{0}`",
    "$before.": "what `{0}` was in the letter before",
    "$first": "no letter has come after the initial one",
}
"""What the variables that words of properties stand for mean, by how their names begin; {0} is what they are about."""


def proof_of(invariant: Invariant, system: System, goal: Goal | None, problem: Problem, found: CheckedProof) -> Proof:
    """A certified invariant as reports show it. `goal` None: it is about faults."""
    names = _Names(invariant, system.program, goal, problem)
    lines = tuple(formula_text(c, names.comparison, names.name) for c in invariant.conjuncts)
    target = invariant.target
    limit = target.bound if isinstance(target, Rounds) else None
    shows, sentence = {
        Faults: ("faults", "no step ends in a fault"),
        Prefixes: ("prefixes", "no run comes to a step after which the property is lost"),
        Rounds: ("rounds", f"no run goes through more than {counted(limit or 0, 'round')} of a violation"),
        FairLoops: ("loops", "no run comes back to where it was, having violated the property in between forever"),
    }[type(target)]
    return Proof(
        shows=shows,  # type: ignore[arg-type]
        sentence=sentence,
        bound=limit,
        unit="cycle" if system.by_cycles else "step",
        invariant=lines,
        legend=tuple(names.legend.items()),
        k=invariant.k,
        checked_by=found.checked_by,
        smt=smt_text(invariant, system.program),
    )


def smt_text(invariant: Invariant, program: Program) -> str:
    """The formula as SMT-LIB 2: numbers are Int, Booleans Bool, names those of `text_of`."""
    arithmetic = Integers()
    beside = {n.name: arithmetic.constant(text_of(n), n.type) for n in nodes(invariant.formula) if isinstance(n, Local)}
    return str(Terms(program, arithmetic).expression(invariant.formula, beside).z3.sexpr())


class _Names:
    """How the scalars of one invariant are written; `legend` grows with those that need an explanation."""

    def __init__(self, invariant: Invariant, program: Program, goal: Goal | None, problem: Problem) -> None:
        self._vars = {v.name: v for v in program.vars}
        self._target = invariant.target
        self._goal = goal
        self._assumed = problem.assumptions
        self.legend: dict[str, str] = {}

    def name(self, scalar: Scalar) -> str:
        """The scalar as a value."""
        if isinstance(scalar, Get):
            return self._variable(scalar)
        return self._beside(scalar.name)

    def comparison(self, scalar: Scalar, holds: Callable[[int], bool]) -> str | None:
        """That a scalar has one of the values for which something `holds`; None: it has no names for them."""
        saved = isinstance(scalar, Local) and scalar.name.startswith("copy:")
        text = scalar.name.removeprefix("copy:") if isinstance(scalar, Local) else scalar.var
        var = self._vars.get(text)
        if var is None or var.length is not None or not var.origin.labels or not isinstance(var.type, Int):
            return None
        if isinstance(scalar, Local) and not saved:
            return None
        written = [_label(var, v) for v in range(var.type.low, var.type.high + 1) if holds(v)]
        others = [_label(var, v) for v in range(var.type.low, var.type.high + 1) if not holds(v)]
        if saved:
            self._explain_saved()
        if not others or not written:
            return "true" if not others else "false"
        if len(others) == 1 and len(written) > 1:
            return f"!{_wrapped(others[0], saved=saved)}"
        joined = " || ".join(_wrapped(w, saved=saved) for w in written)
        return joined if len(written) == 1 else f"({joined})"

    def _variable(self, scalar: Get) -> str:
        var = self._vars[scalar.var]
        if var.length is not None:
            assert isinstance(scalar.index, Const)
            return _element(var, scalar.index.value)
        return self._plain(var)

    def _plain(self, var: Var) -> str:
        for beginning, said in HIDDEN.items():
            if var.name.startswith(beginning):
                return self._own(var.name.removeprefix("$").replace(".", ""), said.format(var.origin.about))
        owner, _, what = var.name.partition(".$")
        if what.startswith("sampled."):
            return f"{'' if owner == '$any' else f'{owner}.'}sampled({what.removeprefix('sampled.')})"
        if not what:
            return var.name
        text = f"{owner}.{what}"
        word, _, input_ = what.partition(".")
        meaning = CONTROL.get(word)
        if word == "seen":
            meaning = f"the sample of {input_} that {{0}} has taken"
        if meaning is not None:
            self.legend.setdefault(text, meaning.format(owner))
        return text

    def _beside(self, name: str) -> str:
        if name.startswith("copy:"):
            self._explain_saved()
            return f"then({self._copied(name.removeprefix('copy:'))})"
        if name == "saved":
            return self._own(name, "the configuration in which the loop begins has been passed")
        if name == "rounds":
            return self._own(name, "how often all that a violation needs forever has happened so far")
        if name.startswith("met"):
            return self._met(int(name.removeprefix("met")))
        which, _, state = name.partition("=")
        return self._automaton(which, int(state))

    def _copied(self, name: str) -> str:
        if name.startswith(OURS):
            return self._beside(name.removeprefix(OURS))
        base, _, index = name.partition("[")
        var = self._vars.get(base)
        if var is not None and index:
            return _element(var, int(index.removesuffix("]")))
        return self._plain(self._vars[name])

    def _explain_saved(self) -> None:
        self.legend.setdefault("then(…)", "what held in the configuration in which the loop begins")

    def _met(self, number: int) -> str:
        assert isinstance(self._target, (Rounds, FairLoops))
        owners = [i for i, t in enumerate(self._target.automata) for _ in range(t.acceptance_sets)]
        if number < len(owners):
            meaning = f"{self._automaton_name(owners[number])} has come on since"
        else:
            meaning = f"{self._target.fair[number - len(owners)]} has been since"
        return self._own(f"met{number}", meaning)

    def _own(self, word: str, meaning: str) -> str:
        """A word of ours, told from a variable of that name."""
        text = f"#{word}" if word in self._vars else word
        self.legend.setdefault(text, meaning)
        return text

    def _automaton_name(self, number: int) -> str:
        if number == 0:
            return "the violation"
        if number <= len(self._assumed):
            return f"the assumption {self._assumed[number - 1].name}"
        return "a condition of fairness"

    def _automaton(self, which: str, state: int) -> str:
        if which == "monitor":
            text = f"#{state}"
            assert isinstance(self._target, Prefixes)
            if self._goal is not None:
                self.legend.setdefault(text, monitor_states(self._target.table, self._goal)[state])
            return text
        number = int(which.removeprefix("automaton"))
        text = f"#{number}.{state}"
        self.legend.setdefault(text, f"{self._automaton_name(number)}: its automaton is in state {state}")
        return text


def _label(var: Var, value: int) -> str:
    owner, _, what = var.name.partition(".$")
    text = value_text(var.type, var.origin.labels, value)
    if what.startswith("sampled."):
        return f"{'' if owner == '$any' else f'{owner}.'}sampled({what.removeprefix('sampled.')}) == {text}"
    if what == "state":
        return f"{owner}@{text}"
    return f"{owner}.{what} == {text}" if what else f"{var.name} == {text}"


def _wrapped(text: str, *, saved: bool) -> str:
    if saved:
        return f"then({text})"
    return text


def _element(var: Var, index: int) -> str:
    places: list[int] = []
    for size in reversed(var.origin.shape):
        index, place = divmod(index, size)
        places.insert(0, place)
    return var.origin.pattern.format(*places)


# ---- What a monitor remembers, in words: what is left to satisfy, or by what letters it is remembered


MAX_TEXT = 160
"""Characters up to which a formula says more than letters do."""


def monitor_states(table: Table, goal: Goal) -> tuple[str, ...]:
    """For each state of the monitor of a goal what it stands for."""
    words = _shortest(table)
    plain = isinstance(goal, FormulaGoal) and is_plain(goal.claim.formula)
    found: list[str] = []
    for word in words:
        text = _left(goal.claim.formula, table, word) if plain and isinstance(goal, FormulaGoal) else None
        found.append(text or _letters(table, word))
    return tuple(found)


def _shortest(table: Table) -> list[tuple[int, ...]]:
    """Letters that lead to each state."""
    words: dict[int, tuple[int, ...]] = {0: ()}
    queue = [0]
    for state in queue:
        for move in table.moves:
            if move.source == state and move.target != BAD and move.target not in words:
                words[move.target] = (*words[state], min(positive for positive, _ in move.cubes))
                queue.append(move.target)
    return [words.get(i, ()) for i in range(table.states)]


def _left(formula: Formula, table: Table, word: tuple[int, ...]) -> str | None:
    rest = nnf(formula)
    for letter in word:
        rest = progress(rest, frozenset(a for i, a in enumerate(table.atoms) if letter >> i & 1))
    text = to_text(simplified(rest), MAX_TEXT)
    return f"from here on the run has to satisfy {text}" if len(text) < MAX_TEXT else None


def _letters(table: Table, word: tuple[int, ...]) -> str:
    if not word:
        return "nothing was shown yet"
    parts: list[str] = []
    for letter, same in groupby(word):
        times = len(list(same))
        text = " && ".join(_literal(a, bool(letter >> i & 1)) for i, a in enumerate(table.atoms)) or "true"
        parts.append(f"`{text}`" if times == 1 else f"{times} times `{text}`")
    return f"what was shown leaves as much open as {', then '.join(parts)}"


def _literal(key: str, holds: bool) -> str:
    text = "cycle" if key == TICK else key
    return text if holds else f"!{text}"
