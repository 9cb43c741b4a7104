"""An arrangement and the state formulas of its properties become one step program."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.collector import paused_collector
from llfsm_verify.kept import fingerprint, kept_or_computed
from llfsm_verify.packing import PackingError, pack
from llfsm_verify.program.program import BOOL, Block, If, Int, Origin, Program, Var
from llfsm_verify.program.terms import get
from llfsm_verify.semantics.canonical import canonical_start
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.cycle import declare_processes, lower_process
from llfsm_verify.semantics.declaring import declare, declare_controls, machine_infos, unstored_inputs
from llfsm_verify.semantics.letters import (
    Observed,
    TimePasses,
    declare_observations,
    entered_wanted,
    finished_wanted,
    formula,
    letter_block,
    lower_atoms,
    lower_fairness,
    mentioned_inputs,
)
from llfsm_verify.semantics.ringlet import entry_inputs, lower_slot, lower_surroundings
from llfsm_verify.semantics.samples import declare_samples, wanted_samples
from llfsm_verify.semantics.vocabulary import CYCLE, FIRED, RAN, SPENT

if TYPE_CHECKING:
    from llfsm_verify.semantics.parts import Parts
    from llfsm_verify.semantics.probes import Probes


@paused_collector(lasting=True)
def lower(
    arrangement: Arrangement,
    atoms: Sequence[Observed] = (),
    *,
    keep_all_bits: bool = False,
    probes: Probes | None = None,
    parts: Parts | None = None,
) -> Program:
    """The step program of `arrangement`, whose letters show `atoms` (in this order, names unique).

    `keep_all_bits` leaves out the canonical blocks, so entered flags and clocks that no longer matter stay visible.
    With `probes` the steps also set outputs, which their owner declares (`transforms.probing.probed`). With `parts`
    they also tell the values of the parts of guards, by events.
    That of a kept arrangement is kept as well, unless it has probes or parts.
    Raises DiagnosticError where the arrangement asks for something that has no meaning (E19x).
    """
    compute = partial(_lowered, arrangement, atoms, keep_all_bits=keep_all_bits, probes=probes, parts=parts)
    if arrangement.kept_as is None or probes is not None or parts is not None:
        return compute()
    places = [arrangement.span, *(state.span for machine in arrangement.texts for state in machine.states)]
    places += [a.expression.span for a in atoms if not isinstance(a.expression, TimePasses)]
    sources = tuple({id(place.source): place.source for place in places}.values())
    texts = (part for source in sources for part in (source.name, source.text))
    try:
        packed = pack(tuple(atoms), sources, shared=False)
    except PackingError:
        return compute()  # an atom is nested too deeply
    name = fingerprint(arrangement.kept_as, str(keep_all_bits), packed, *texts)
    return kept_or_computed("lowered", name, sources, compute)


def _lowered(
    arrangement: Arrangement,
    atoms: Sequence[Observed],
    *,
    keep_all_bits: bool,
    probes: Probes | None,
    parts: Parts | None,
) -> Program:
    context = Context(arrangement, keep_all_bits, probes=probes, parts=parts)
    declare(context)
    context.mentioned = mentioned_inputs(context, atoms)
    context.entered = entered_wanted(atoms)
    context.samples = wanted_samples(context, [a.expression for a in atoms if not isinstance(a.expression, TimePasses)])
    declare_samples(context, partial(formula, context))
    declare_controls(context, finished_wanted(atoms))
    declare_processes(context)
    _declare_outputs(context)
    declare_observations(context, atoms)
    if not keep_all_bits:
        canonical_start(context)
    context.surroundings = lower_surroundings(context)
    controls = list(context.controls.values())
    slots = tuple(lower_slot(context, control, i) for i, control in enumerate(controls))
    processes = tuple(
        lower_process(context, i, tuple(list(context.controls).index(m) for m in process.schedule))
        for i, process in enumerate(arrangement.processes)
    )
    lowered = lower_atoms(context, atoms)
    fairness, conditions = lower_fairness(context)
    letter = letter_block(context, conditions)
    observed: Block = (If(get(CYCLE, BOOL), letter),) if letter and arrangement.observe == "cycle" else letter
    return Program(
        name=arrangement.name,
        observe=arrangement.observe,
        vars=tuple(context.variables.values()),
        choices=tuple(context.choices.values()),
        inputs=unstored_inputs(context),
        machines=machine_infos(context),
        slots=slots,
        processes=processes,
        letter=observed,
        letter_stutter=letter,
        atoms=lowered,
        fairness=fairness,
        faults=tuple(context.faults),
        ran=RAN,
        cycle=CYCLE,
        fired=FIRED,
        spent=SPENT,
        refusals=tuple(context.refusals),
        period=arrangement.cycle_ms,
    )


def _declare_outputs(context: Context) -> None:
    controls = list(context.controls.values())
    transitions = max((len(s.transitions) for c in controls for s in c.states), default=0)
    names = ("", *(c.machine.name for c in controls))
    outputs = (
        (RAN, Int(0, len(controls)), names),
        (SPENT, Int(0, max(len(c.states) for c in controls) - 1), ()),
        (FIRED, Int(0, transitions), ()),
        (CYCLE, BOOL, ()),
    )
    for name, kind, labels in outputs:
        context.add(Var(name, kind, 0, Origin("output", "", labels), output=True))
    if context.arrangement.profile.snapshot == "after_entry":
        for control in controls:
            for name in entry_inputs(context, control):
                scalar = context.inputs[name]
                seen = f"{control.machine.name}.$seen.{name}"
                context.control_var(seen, scalar.type, scalar.init, control.machine.name, scalar.labels)
