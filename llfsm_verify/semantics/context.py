"""What the lowering of one arrangement has collected so far: the tables of its step program."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.model import Arrangement, Machine
from llfsm_verify.diagnostics import Span
from llfsm_verify.program.program import Block, Choice, Expr, FaultSite, Int, Origin, Stmt, Type, Var
from llfsm_verify.semantics.vocabulary import Control, InputScalar, Samples

if TYPE_CHECKING:
    from llfsm_verify.semantics.parts import Parts
    from llfsm_verify.semantics.probes import Probes


@dataclass(slots=True)
class Context:
    """Collects the program's tables while the blocks are lowered."""

    arrangement: Arrangement
    keep_all_bits: bool
    mentioned: frozenset[str] = frozenset()
    """Scalars of unstored inputs that atoms mention."""
    controls: dict[str, Control] = field(default_factory=dict)
    """The scheduled machines."""
    plants: dict[str, Control] = field(default_factory=dict)
    """The models of the surroundings."""
    surroundings: Block = ()
    """Their ringlets."""
    inputs: dict[str, InputScalar] = field(default_factory=dict)
    variables: dict[str, Var] = field(default_factory=dict)
    choices: dict[str, Choice] = field(default_factory=dict)
    faults: dict[FaultSite, int] = field(default_factory=dict)
    refusals: dict[FaultSite, int] = field(default_factory=dict)
    commanded: dict[str, frozenset[str]] = field(default_factory=dict)
    """By machine: the machines that its actions command."""
    probes: Probes | None = None
    parts: Parts | None = None
    """Steps also tell what comes out at each place."""
    samples: Samples = field(default_factory=Samples)
    """What atoms ask about samples."""
    edges: list[Block] = field(default_factory=list)
    """What a letter does to tell how it differs from the one before, inner ones first."""
    defined: dict[str, Expr] = field(default_factory=dict)
    """What the definitions of the formula that is lowered now are."""
    found: dict[int, Expr] = field(default_factory=dict)
    """By what is defined (its `id`) where the letter has it."""
    known: list[Stmt] = field(default_factory=list)
    """How the letter makes definitions of what theories say."""
    spelt: dict[str, Expr] = field(default_factory=dict)
    """These by the names of locals, each spelt out."""
    shown: list[Stmt] = field(default_factory=list)
    """The outputs of atoms."""
    entered: frozenset[str] = frozenset()
    """The machines whose entered flag atoms ask for, so that it stays as it is."""
    _reads: int = 0
    _chosen: Counter[str] = field(default_factory=Counter)

    # -------------------------------------------------- tables

    def add(self, var: Var) -> None:
        assert var.name not in self.variables, var.name
        self.variables[var.name] = var

    def control_var(
        self,
        name: str,
        kind: Type,
        init: int,
        machine: str = "",
        labels: tuple[str, ...] = (),
        output: bool = False,
    ) -> None:
        origin = Origin("output" if output else "control", machine, labels)
        self.add(Var(name, kind, init, origin, output=output))

    def fault(self, code: str, message: str, span: Span | None, variable: str = "") -> int:
        """The number of a fault site (equal ones are shared: a machine file used twice, an unrolled loop)."""
        return self.faults.setdefault(FaultSite(code, message, span, variable), len(self.faults))

    def refusal(self, message: str, span: Span) -> int:
        """The number of a place where a machine is refused something."""
        return self.refusals.setdefault(FaultSite("E157", message, span), len(self.refusals))

    def new_read(self, scalar: InputScalar) -> str:
        """A choice for one evaluated read (`snapshot: none`)."""
        self._reads += 1
        name = f"{scalar.name}#{self._reads}"
        self.choices[name] = Choice(name, scalar.type, "read", scalar.name, scalar.labels)
        return name

    def new_choice(self, machine: str, target: str, kind: Int, labels: tuple[str, ...]) -> str:
        """A choice for one evaluated `target = choose(…)` of a machine."""
        name = f"{machine}.choose({target})"
        self._chosen[name] += 1
        if self._chosen[name] > 1:
            name = f"{name}#{self._chosen[name]}"
        self.choices[name] = Choice(name, kind, "choose", "", labels)
        return name

    def operator_choice(self, name: str, kind: Int, labels: tuple[str, ...] = ()) -> str:
        """A choice of an operator, which every slot that can begin a cycle may make."""
        self.choices[name] = Choice(name, kind, "choose", "", labels)
        return name

    def letter_choice(self, scalar: InputScalar) -> str:
        """The choice by which a letter shows an input that its step has not read."""
        name = f"{scalar.name}#letter"
        if name not in self.choices:
            self.choices[name] = Choice(name, scalar.type, "input", scalar.name, scalar.labels)
        return name

    def control(self, machine: str) -> Control:
        return self.plants[machine] if machine in self.plants else self.controls[machine]

    def owners(self) -> list[Machine]:
        """The machines with states that run others, owners before what they run."""
        above = {name: m.name for m in self.arrangement.machines for s in m.states for name in s.runs}

        def depth(name: str) -> int:
            return 1 + depth(above[name]) if name in above else 0

        owners = [m for m in self.arrangement.machines if any(s.runs for s in m.states)]
        return sorted(owners, key=lambda m: depth(m.name))

    def affected(self, machine: str) -> list[str]:
        """The machines that the ringlet of a machine may give commands, owners before what they run."""
        found = set(self.commanded[machine])
        for owner in self.owners():
            if owner.name in found:
                found |= {name for s in owner.states for name in s.runs}
        order = {m.name: i for i, m in enumerate(self.owners())}
        return sorted(found, key=lambda m: (order.get(m, len(order)), list(self.controls).index(m)))

    def inside(self, machine: str) -> list[str]:
        """The machines that its states run, and those inside their states, owners before what they run."""
        own = self.control(machine).owned
        return [*own, *(name for inner in own for name in self.inside(inner))]

    def loads(self, machine: str) -> bool:
        """A command may load or unload the machine."""
        control = self.control(machine)
        return control.absents or control.reloads

    @property
    def every_control(self) -> list[Control]:
        """Of the scheduled machines, and of the models of the surroundings."""
        return [*self.controls.values(), *self.plants.values()]

    @property
    def input_variables(self) -> frozenset[str]:
        """The whiteboard variables that are inputs."""
        return frozenset(e.variable.name for e in self.arrangement.whiteboard if e.role == "input")

    @property
    def tracks_samples(self) -> bool:
        """The letter cannot simply sample again: it shows a read's own choice, or an earlier ringlet's sample."""
        return self.arrangement.profile.snapshot == "none" or self.arrangement.observe == "cycle"
