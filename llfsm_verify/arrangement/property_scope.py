"""What the properties of an arrangement can name."""

from __future__ import annotations

from llfsm_verify.arrangement.model import Arrangement, Machine
from llfsm_verify.language.atoms import MachineView, PropertyScope
from llfsm_verify.language.scope import MachineSignature, enumerators_of


def property_scope(arrangement: Arrangement) -> PropertyScope:
    """The scope in which `language.atoms.check_atom` checks the atoms of properties of `arrangement`."""
    return PropertyScope(
        whiteboard={w.variable.name: w.variable for w in arrangement.whiteboard},
        machines={m.name: _view(m) for m in arrangement.machines},
        types=arrangement.types,
        enumerators=enumerators_of(arrangement.types.values()),
    )


def _view(machine: Machine) -> MachineView:
    states = tuple(s.name for s in machine.states)
    prefix = len(machine.name) + 1
    return MachineView(
        signature=MachineSignature(machine.name, states, machine.suspend),
        variables={v.name[prefix:]: v for v in machine.variables},
        state_variables={
            s.name: {v.name[prefix + len(s.name) + 1 :]: v for v in s.variables} for s in machine.states if s.variables
        },
        transitions=tuple(len(s.transitions) for s in machine.states),
    )
