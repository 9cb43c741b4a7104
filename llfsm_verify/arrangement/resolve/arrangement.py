"""From a draft to a validated arrangement, or to everything that is wrong with it; of formats nothing is known here."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import cast, get_args

from llfsm_verify.arrangement.draft import (
    ArrangementDraft,
    Draft,
    InstanceDraft,
    MachineDraft,
    PlantDraft,
    Unreadable,
    has_unreadable,
)
from llfsm_verify.arrangement.keys import VOCABULARY
from llfsm_verify.arrangement.model import (
    BETWEEN_STEPS,
    POLICY,
    REPLACE,
    Access,
    Arrangement,
    Fairness,
    Finished,
    Machine,
    Observe,
    OnFault,
    Operator,
    Process,
    Profile,
    Suppression,
    WhiteboardVariable,
)
from llfsm_verify.arrangement.plants import use_plant
from llfsm_verify.arrangement.resolve.access import check_access, check_replaceable, resolve_access, resolve_operators
from llfsm_verify.arrangement.resolve.constant_comparisons import constant_comparisons
from llfsm_verify.arrangement.resolve.initial import resolve_tables
from llfsm_verify.arrangement.resolve.instance import InstanceChecker, InstanceText
from llfsm_verify.arrangement.resolve.knowledge import check_knowledge, parse_knowledge
from llfsm_verify.arrangement.resolve.machine import MachineResolver, MachineText
from llfsm_verify.arrangement.resolve.nesting import nest
from llfsm_verify.arrangement.resolve.processes import resolve_processes, resolve_surroundings
from llfsm_verify.arrangement.resolve.timing import check_time, resolve_profile, resolve_timing
from llfsm_verify.arrangement.resolve.type_table import TypeTable
from llfsm_verify.arrangement.resolve.whiteboard import resolve_whiteboard
from llfsm_verify.arrangement.suppressions import resolve_suppressions
from llfsm_verify.collector import paused_collector
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span
from llfsm_verify.kept import fingerprint, installation, kept_or_computed
from llfsm_verify.language.scope import STEP_WORDS, Scope, enumerators_of
from llfsm_verify.language.types import EnumType
from llfsm_verify.packing import PackingError, pack
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Mapping, mark
from llfsm_verify.yaml.tables import TRUTHS

MAX_DIAGNOSTICS = 50
WORTH_KEEPING = 50_000
"""Characters of actions, those of each instance counted, from which an arrangement is kept: about 0.2 s of work."""


@paused_collector(lasting=True)
def resolve(draft: Draft, *, integer_guards: bool = False) -> Arrangement:
    """The arrangement that a draft describes.

    With `integer_guards` an integer where a condition is expected is read as `!= 0`, as in C. Raises DiagnosticError
    with everything found wrong, by the reader and here, sorted by place, at most 50 diagnostics. ValueError: a part is
    `Unreadable`, and no error says why, which is a mistake of the reader. That of a large draft is kept for later runs
    (docs/decisions/0055-large-arrangements.md).
    """
    name = _kept_as(draft, integer_guards=integer_guards)
    if name is None:
        return _resolved(draft, integer_guards=integer_guards)
    compute = partial(_resolved, draft, integer_guards=integer_guards)
    return kept_or_computed("arrangement", name, draft.sources, compute)


def _kept_as(draft: Draft, *, integer_guards: bool) -> str | None:
    """A name for everything that decides what the arrangement is; None: it is not worth keeping, or cannot be named."""
    if isinstance(draft.arrangement, Unreadable) or isinstance(draft.arrangement.machines, Unreadable):
        return None
    machines = (i.machine for i in draft.arrangement.machines if isinstance(i.machine, MachineDraft))
    states = (state for m in machines if not isinstance(m.states, Unreadable) for state in m.states)
    if sum(len(action.text) for state in states for action in state.actions.values()) < WORTH_KEEPING:
        return None
    installed = installation()
    if installed is None or any(type(source) is not Source for source in draft.sources):
        return None  # the places in Python data are not in its text
    texts = (part for source in draft.sources for part in (source.name, source.text))
    with suppress(PackingError):  # a reader's own parts
        return fingerprint(installed, str(integer_guards), pack(draft, draft.sources), *texts)
    return None


def _resolved(draft: Draft, *, integer_guards: bool) -> Arrangement:
    report = Report(VOCABULARY)
    report.diagnostics += draft.diagnostics
    arrangement = None
    if not isinstance(draft.arrangement, Unreadable):
        arrangement = _Resolver(report, draft.arrangement, integer_guards).resolve(draft.path, draft.digest)
    diagnostics = _ordered(report.diagnostics, [source.name for source in draft.sources])
    errors = [d for d in diagnostics if d.is_error]
    if errors:
        raise DiagnosticError(errors[:MAX_DIAGNOSTICS] if draft.instead is None else draft.instead)
    if arrangement is None or isinstance(draft.arrangement, Unreadable) or has_unreadable(draft.arrangement):
        raise ValueError("a part of the draft is unreadable, and no error in the draft says why")
    return replace(arrangement, warnings=tuple(diagnostics[:MAX_DIAGNOSTICS]))


def _taken(name: str) -> str:
    return f"`{name}` is what properties call the model of the surroundings"


def _ordered(diagnostics: list[Diagnostic], sources: list[str]) -> list[Diagnostic]:
    """Without repetitions (two instances of one machine have the same mistakes), sorted by place."""
    unique: dict[tuple[str, str, int], Diagnostic] = {}
    eaten: set[tuple[str, int]] = set()
    for d in diagnostics:
        place = (d.span.source.name, d.span.start) if d.span else (d.file or "", -1)
        if place not in eaten:
            unique.setdefault((d.code, *place), d)
        if d.code == "E016":
            eaten.add(place)  # what comes after a tag is not a mistake of its own

    def key(d: Diagnostic) -> tuple[int, int]:
        name = d.span.source.name if d.span else d.file or ""
        number = sources.index(name) if name in sources else len(sources)
        return number, d.span.start if d.span else -1

    return sorted(unique.values(), key=key)


class _Resolver:
    """The passes over a draft, in their order; each says what is wrong, and the next ones go on without that part."""

    timing: tuple[bool, Fraction | None]
    """Whether cycles have a length, and theirs in milliseconds."""
    types: TypeTable
    world: Scope
    whiteboard: tuple[WhiteboardVariable, ...]
    instances: dict[str, InstanceText]
    plants: dict[str, InstanceText]
    suppressions: list[Suppression]
    processes: tuple[Process, ...]
    observe: str
    profile: Profile
    checkers: dict[str, InstanceChecker]
    machines: tuple[Machine, ...]
    surroundings: tuple[Machine, ...]
    operators: tuple[Operator, ...]
    access: Access | None

    def __init__(self, report: Report, draft: ArrangementDraft, integer_guards: bool) -> None:
        self.report = report
        self.draft = draft
        self.integer_guards = integer_guards
        self.broken: set[str] = set()
        """Names whose declaration is wrong: using them is not a further error."""
        self.texts: dict[int, tuple[MachineDraft, MachineText | None]] = {}
        """The machines that are resolved, by the identity of their drafts: instances share them."""
        self.used: set[str] = set()
        """The plants that are there already."""

    def resolve(self, path: str, digest: str) -> Arrangement:
        name = self._name()
        self.timing = resolve_timing(self.report, self.draft.timing, self.draft.cycle_ms)
        self._declare()
        self._read_machines()
        self._check_names()
        self._schedule()
        self._check_machines()
        self._operate()
        timed, period = self.timing
        check_time(self.report, [root for c in self.checkers.values() for root in c.timed], timed, period)
        self._warn_unused()
        self.report.diagnostics += constant_comparisons((*self.machines, *self.surroundings))
        choice, draft = self.report.choice, self.draft
        return Arrangement(
            name=name,
            path=path,
            digest=digest,
            profile=self.profile,
            observe=cast(Observe, self.observe),
            timing="timed" if timed else "untimed",
            cycle_ms=period,
            finished=cast(Finished, choice(draft.finished, "`finished`", get_args(Finished), "leave")),
            fairness=cast(Fairness, choice(draft.fairness, "`fairness`", get_args(Fairness), "processes")),
            types=self.types.types,
            enumerations=tuple(dict.fromkeys(t for t in self.types.types.values() if isinstance(t, EnumType))),
            tables=self.world.tables,
            whiteboard=self.whiteboard,
            machines=self.machines,
            processes=self.processes,
            warnings=(),
            span=draft.span,
            suppressions=tuple(self.suppressions),
            plants=self.surroundings,
            operators=tuple(o for o in self.operators if o.kind not in BETWEEN_STEPS),
            replaceable=tuple(o for o in self.operators if o.kind == REPLACE),
            policy_users=tuple(o for o in self.operators if o.kind == POLICY),
            access=self.access,
            declared_types=self.types.declared(),
            knowledge=self.world.knowledge,
        )

    @property
    def _places(self) -> dict[str, Span]:
        """Where the instances are named."""
        return {name: instance.span for name, instance in self.instances.items()}

    def _declare(self) -> None:
        """Types and the whiteboard, which know no machine."""
        self.types = TypeTable(self.report, self.draft.types)
        types = self.types.types
        self.world = Scope(
            {}, {}, {}, (), "", types, enumerators_of(types.values()), frozenset(), integer_guards=self.integer_guards
        )
        found, broken, accepted = resolve_whiteboard(self.report, self.draft.whiteboard, self.types, self.world)
        self.whiteboard = found
        self.broken |= broken
        self.suppressions = [*resolve_suppressions(self.report, self.draft.lint, whole=True), *accepted]

    def _read_machines(self) -> None:
        """The machines of the instances and of the surroundings, which know no other machine yet."""
        drafts = () if isinstance(self.draft.machines, Unreadable) else self.draft.machines
        self.instances = self._instances(drafts)
        self.plants = self._instances(self.draft.plants, surroundings=True)
        for text in {id(i.text): i.text for i in self._all().values()}.values():
            self.suppressions += text.suppressions

    def _all(self) -> dict[str, InstanceText]:
        return self.plants | self.instances

    def _schedule(self) -> None:
        """Whose turn comes when, and what is only with one process."""
        report, draft = self.report, self.draft
        self.processes = resolve_processes(
            report, draft.processes, self._places, self.broken, draft.span, tuple(self.plants)
        )
        several = len(self.processes) > 1
        if draft.plants and several:
            hint = "several processes have no common cycle that it could begin: use one process"
            message = "a model of the surroundings needs a single process"
            report.error("E086", message, draft.plants[0].name.span, hint)
        self.observe = report.choice(draft.observe, "`observe`", get_args(Observe), "ringlet")
        if self.observe == "cycle" and draft.observe is not None and several:
            hint = "several processes have no common cycle: write `observe: ringlet`"
            report.error("E085", "`observe: cycle` needs a single process", mark(draft.observe), hint)
        self.profile = resolve_profile(report, draft.profile)
        if self.profile.snapshot == "cycle" and several:
            hint = "several processes have no common cycle: use `snapshot: ringlet`, or `changes: cycle` on the inputs"
            items = draft.profile.items if isinstance(draft.profile, Mapping) else ()
            place = next(mark(value) for key, value in items if key.text == "snapshot")
            report.error("E085", "`snapshot: cycle` needs a single process", place, hint)

    def _check_machines(self) -> None:
        """Guards and actions, now that all names are known; machines inside states; the models of the surroundings."""
        report, variables = self.report, {w.variable.name: w.variable for w in self.whiteboard}
        order = [m for p in self.processes for m in p.schedule]
        world = self.world = replace(
            self.world,
            variables=variables,
            machines={n: i.signature() for n, i in self.instances.items()},
            others=tuple(order),
            tables=resolve_tables(report, self.draft.tables, {**self.world.enumerators, **self.instances, **variables}),
            inputs=frozenset(w.variable.name for w in self.whiteboard if w.role == "input"),
            unseen=tuple(self.plants),
        )
        self._know()
        world, broken = self.world, frozenset(self.broken)
        self.checkers = {n: InstanceChecker(report, world, i, broken) for n, i in self.instances.items()}
        checked = {n: c.check() for n, c in self.checkers.items()}
        pooled = {m for p in self.processes for m in p.pool}
        machines = tuple(replace(checked[n], loaded=n not in pooled) for n in order)
        self.machines = nest(report, machines, {k: v for c in self.checkers.values() for k, v in c.places.items()})
        for machine in self.machines:
            if machine.suspended and not machine.loaded:
                hint = f"load it with `load_suspended({machine.name})`"
                message = f"machine `{machine.name}` of the pool is not loaded at first, so it cannot be suspended"
                report.error("E089", message, machine.span, hint)
        plants = {name: InstanceChecker(report, world, plant, broken) for name, plant in self.plants.items()}
        self.checkers |= plants
        models = []
        for name, checker in plants.items():
            before = len(report.diagnostics)
            models.append(checker.check())
            if name in self.used and any(d.is_error for d in report.diagnostics[:before]):
                del report.diagnostics[before:]  # it follows from those, and is not in the user's text
        self.surroundings, self.whiteboard = resolve_surroundings(report, models, self.whiteboard, self.used)

    def _know(self) -> None:
        """What theories say to all machines."""
        texts, broken = parse_knowledge(self.report, self.draft.knowledge)
        world, self.broken = self.world, self.broken | broken
        names = {*world.variables, *world.machines, *world.tables, *world.enumerators, *world.unseen}

        def taken(name: str, span: Span) -> bool:
            if name in STEP_WORDS:
                message = f"`{name}` is a word of the property language and cannot be the name of what a theory says"
                self.report.error("E119", message, span, "choose another name")
            elif name in names:
                self.report.error("E118", f"there is already something called `{name}`", span, "choose another name")
            return name in names or name in STEP_WORDS

        known, broken = check_knowledge(self.report, texts, world, self.broken, taken)
        self.world, self.broken = replace(world, knowledge=known), self.broken | broken

    def _operate(self) -> None:
        """What operators may command, and who may do what."""
        report, draft, machines = self.report, self.draft, self.machines
        operators = resolve_operators(report, draft.operators, self._places, self.whiteboard, self.broken)
        self.operators = operators
        for operator in operators:
            if operator.kind == REPLACE:
                check_replaceable(report, operator, machines)
            elif "load" in operator.kind and any(m.nested for m in machines if m.name == operator.target):
                message = f"`{operator.target}` runs inside a state, so only its owner starts and stops it"
                report.error("E159", message, operator.span, "let operators suspend or restart it")
        mistakes = len(report.diagnostics)
        policy = None if isinstance(draft.access, Unreadable) else draft.access
        self.access = resolve_access(report, policy, self._places, self.whiteboard, self.broken)
        if draft.access is None:
            for operator in (o for o in operators if o.kind == POLICY):
                report.error("E098", "there is no policy that anybody could change", operator.span, "write `access`")
        if self.access is not None and len(report.diagnostics) == mistakes:  # else it is not what was meant
            check_access(report, self.access, machines, operators, self.whiteboard)

    def _name(self) -> str:
        if isinstance(self.draft.name, str):
            return self.draft.name
        scalar = self.report.scalar(self.draft.name, "`name`")
        return scalar.text if scalar is not None else "?"

    def _check_names(self) -> None:
        """What has one name is there once, which not every format sees to."""
        draft, check = self.draft, self.report.distinct
        check(name for name, _ in draft.types)
        check(name for name, _ in draft.tables)
        check(variable.name for variable in draft.whiteboard)
        if not isinstance(draft.processes, Unreadable):
            check(process.name for process in draft.processes if process.name is not None)
        for variable in (w.variable for w in self.whiteboard if w.variable.name in self._all()):
            message = f"there is also a machine `{variable.name}`"
            if variable.name in self.plants:
                message = _taken(variable.name)
            self.report.error("E118", message, variable.span, "properties could not tell them apart: rename one")

    # ------------------------------------------------------------ machines

    def _instances(
        self, drafts: Iterable[InstanceDraft | PlantDraft], *, surroundings: bool = False
    ) -> dict[str, InstanceText]:
        drafts = tuple(drafts)
        self.report.distinct(draft.name for draft in drafts)
        found: dict[str, InstanceText] = {}
        for draft in drafts:
            instance = self._instance(draft, surroundings=surroundings)
            if instance is None:
                self.broken.add(draft.name.text)
            else:
                found[instance.name] = instance
        return found

    def _used(self, draft: PlantDraft) -> InstanceText | None:
        """A plant that is there already. Where its name is also that of a slot, its machine has another one."""
        name = self.report.name(draft.name, "the name of a plant")
        taken = {*self.world.enumerators, *self.types.types, *self.instances}
        used = use_plant(self.report, draft, self.whiteboard, taken, self.timing[1], self.broken)
        text = None if used is None else self._machine(used.machine)
        if name is None or used is None or text is None:
            return None
        if any(entry.variable.name == name for entry in self.whiteboard):
            name = f"{name}_plant"
            if name in {*self.instances, *(plant.name.text for plant in self.draft.plants)}:
                message = f"`{name}` is what properties would call this plant, and something else has this name"
                self.report.error("E118", message, draft.name.span, "choose another name")
                return None
        self.used.add(name)
        return InstanceText(name, text, {}, False, draft.name.span, surroundings=True, request=used.request)

    def _instance(self, draft: InstanceDraft | PlantDraft, *, surroundings: bool = False) -> InstanceText | None:
        if isinstance(draft, PlantDraft):
            return self._used(draft)
        name = self.report.name(draft.name, "the name of a machine")
        text = None if isinstance(draft.machine, Unreadable) else self._machine(draft.machine)
        suspended = self.report.choice(draft.suspended, "`suspended`", TRUTHS, "false") == "true"
        model = self.report.choice(draft.model, "`model`", TRUTHS, "false") == "true"
        on_fault = self.report.choice(draft.on_fault, "`on_fault`", get_args(OnFault), "end")
        self.report.distinct(argument for argument, _ in draft.arguments)
        if name is None or text is None:
            return None
        arguments = {argument.text: (argument, value) for argument, value in draft.arguments}
        if surroundings:
            if isinstance(draft.machine, MachineDraft) and draft.machine.suspend is not None:
                message = "the model of the surroundings is never suspended"
                self.report.error("E087", message, mark(draft.machine.suspend), "remove `suspend`")
        elif name in {plant.name.text for plant in self.draft.plants}:
            self.report.error("E118", _taken(name), draft.name.span, "choose another name")
        return InstanceText(
            name, text, arguments, suspended, draft.name.span, model, surroundings, cast(OnFault, on_fault)
        )

    def _machine(self, draft: MachineDraft) -> MachineText | None:
        if id(draft) not in self.texts:
            before = len(self.report.diagnostics)
            text = MachineResolver(self.report, self.types).resolve(draft)
            if draft.instead is not None and any(d.is_error for d in self.report.diagnostics[before:]):
                self.report.diagnostics[before:] = [draft.instead]
                text = None
            self.texts[id(draft)] = draft, text  # which keeps the draft, and so its number
        return self.texts[id(draft)][1]

    def _warn_unused(self) -> None:
        for instance in self._all().values():
            for parameter in instance.text.parameters:
                if parameter.name not in instance.text.words:
                    message = f"parameter `{parameter.name}` of machine `{instance.text.kind}` is never used"
                    self.report.diagnostics.append(Diagnostic("W001", message, parameter.span, hint="remove it"))
