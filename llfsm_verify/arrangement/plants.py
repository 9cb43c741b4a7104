"""Models of the surroundings that are there already (`use`), by name: the other sides of services and of actions.

    environment:
      locate: {use: service, ask: locate, state: locate_state, answers: [fruits], timeout: 2s}
      arm: {use: action, ask: reach, state: arm_state, answers: [reached], feedback: [distance]}

Each is a machine of one state that makes every order of events which the handshake of `requests.py` allows. It knows
`seen`, what its port has last seen of `ask`: in each cycle the port looks, or does not, and then makes one move that
what it has seen allows, or none. Answers come with an end, feedback while it is under way, both with any values. With
`timeout` it counts the cycles for which it owes a move, and makes one at the latest when the port does, with SLACK.

    $ llfsm verify picking.yaml -p 'G (locate -> F (!locate || locate_state != IDLE && locate_state != WAITING))'

What is wrong in it is said at its place in the file:

    environment: {locate: {use: servce, …}}          there is no plant `servce` to use          (E533)
    … state: locate_state                            the type of `locate_state` lacks TIMED_OUT (E534)
    … state: locate_state, with `init: DONE`         `locate_state` is DONE at first             (E534)
    … timeout: 2s, in an untimed arrangement         a cycle has no length here                 (E535)
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import Protocol

from llfsm_verify.arrangement.draft import MachineDraft, PlantDraft, StateDraft, VariableDraft
from llfsm_verify.arrangement.model import WhiteboardVariable
from llfsm_verify.arrangement.requests import IDLE, MOVES, STATES, UNDER_WAY, Request, RequestKind
from llfsm_verify.diagnostics import Source, Span
from llfsm_verify.language.scope import did_you_mean
from llfsm_verify.language.typed import Variable
from llfsm_verify.language.types import (
    ArrayType,
    BoolType,
    DecimalType,
    EnumType,
    FixedType,
    RangeType,
    RecordType,
    Type,
    decimal_text,
)
from llfsm_verify.registry import Entry, Registry, Unusable
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, Scalar, implied, mark, written
from llfsm_verify.yaml.tables import ByName, Field, Several, Shared, Single, Table

UNKNOWN, UNFIT, UNTIMED = "E533", "E534", "E535"
SLACK_CYCLES, SLACK_MS = 5, 100
"""How much later than it should a port may move: so many cycles, and so long."""


@dataclass(frozen=True, slots=True)
class Site:
    """Where a plant is used: its name and keys, and what they may speak of."""

    report: Report
    name: Scalar
    keys: Mapping[str, Node]
    whiteboard: Mapping[str, WhiteboardVariable]
    taken: frozenset[str]
    """Names that mean something to every machine."""
    cycle_ms: Fraction | None
    broken: Collection[str] = ()
    """Names whose declaration is wrong, which was said."""

    def free(self, wanted: str) -> str:
        """`wanted`, or with as many `_` behind it as make it a new name."""
        while wanted in self.taken:
            wanted += "_"
        return wanted

    def slots(self, key: str, suits: str) -> tuple[WhiteboardVariable, ...] | None:
        """The slots that are named under a key, none where it is missing; `suits`: their `role`, or "" for any that
        machines write. None: something is wrong, and was said (E534)."""
        node = self.keys.get(key)
        if node is None:
            return ()
        listed = node if key in LISTS else None
        sequence = None if listed is None else self.report.sequence(listed, f"`{key}`")
        if listed is not None and sequence is None:
            return None
        items = (node,) if sequence is None else sequence.items
        self.report.distinct(item for item in items if isinstance(item, Scalar))
        found = [self._slot(item, key, suits) for item in items]
        return None if None in found else tuple(one for one in found if one is not None)

    def _slot(self, node: Node, key: str, suits: str) -> WhiteboardVariable | None:
        scalar = self.report.scalar(node, f"`{key}`")
        if scalar is None:
            return None
        slot = self.whiteboard.get(scalar.text)
        if scalar.text in self.broken:
            pass
        elif slot is None:
            hint = did_you_mean(scalar.text, self.whiteboard) or "declare it on the `whiteboard`"
            self.report.error(UNFIT, f"there is no variable `{scalar.text[:60]}` for `{key}`", mark(scalar), hint)
        elif (slot.role == "input") != (suits == "input"):
            what, hint = ("not an input", "input") if suits == "input" else ("an input", "output")
            message = f"`{key}` names `{scalar.text}`, which is {what}"
            self.report.error(UNFIT, message, mark(scalar), f"give it `role: {hint}`, or name another variable")
        else:
            return slot
        return None


@dataclass(frozen=True, slots=True)
class UsedPlant:
    """What `use` makes of its keys: a machine without parameters, and the request that it answers, if it does."""

    machine: MachineDraft
    request: Request | None = None


class Plant(Protocol):
    """A plant that is there already. What it is given is in its `table`."""

    table: Table

    def use(self, site: Site) -> UsedPlant | None:
        """The machine for these keys, which are in the table; None: something is wrong, and was said."""


LISTS = ("answers", "feedback")
_NAME, _NAMES = Shared("name"), Several(Shared("name"), least=0, different=True)
_REQUEST = (
    Field("ask", "the slot that asks: `bool`, written by machines", _NAME, required=True),
    Field("state", "the input that says how far the request is", _NAME, required=True),
    Field("answers", "the inputs that an answer gives values", _NAMES),
    Field("timeout", "within which time the request ends, such as `2s`", Single(("string",))),
    Field("values", "which values of `state` stand for those that its type lacks", ByName(_NAME)),
)
SERVICE_KEYS = Table("a service: it answers, fails or times out", _REQUEST)
ACTION_KEYS = Table(
    "an action: it goes on for a while, and can be cancelled",
    (*_REQUEST, Field("feedback", "the inputs that its feedback gives values", _NAMES)),
)


@dataclass(frozen=True, slots=True)
class RequestPlant:
    """The other side of the requests of one kind."""

    kind: RequestKind
    table: Table

    def use(self, site: Site) -> UsedPlant | None:
        """See `Plant`."""
        ask, state = site.slots("ask", ""), site.slots("state", "input")
        answers, feedback = site.slots("answers", "input"), site.slots("feedback", "input")
        milliseconds = self._timeout(site)
        if not ask or not state or answers is None or feedback is None or milliseconds == 0:
            return None
        if not isinstance(ask[0].variable.type, BoolType):
            self._unfit(site, "ask", f"`{ask[0].variable.name}` is {ask[0].variable.type}, not `bool`")
            return None
        shown = self._shown(site, state[0])
        if shown is None:
            return None
        request = Request(
            site.name.text, self.kind, ask[0].variable.name, state[0].variable.name,
            answers={slot.variable.name: slot.variable.name for slot in answers},
            feedback={slot.variable.name: slot.variable.name for slot in feedback},
            timeout=None if milliseconds is None else float(milliseconds / 1000),
            values={name: value for name, value in shown.items() if name != value},
        )  # fmt: skip
        twice = [name for i, name in enumerate(request.fed) if name in request.fed[:i]]
        if twice:
            self._unfit(site, "state", f"`{twice[0]}` is fed twice")
            return None
        patience = None
        if milliseconds is not None and site.cycle_ms is not None:
            slack = SLACK_CYCLES + ceil(SLACK_MS / site.cycle_ms)
            patience = slack, slack + ceil(milliseconds / site.cycle_ms)
        fed = [slot.variable for slot in (*answers, *feedback)]
        return UsedPlant(_machine(site, request, shown, fed, patience), request)

    def _unfit(self, site: Site, key: str, message: str, hint: str | None = None) -> None:
        site.report.error(UNFIT, message, mark(site.keys[key]), hint or "name another variable")

    def _timeout(self, site: Site) -> Fraction | None:
        """In milliseconds; None: there is none; 0: it is wrong."""
        node = site.keys.get("timeout")
        milliseconds = site.report.time(node, "`timeout`", UNTIMED)
        if node is None or milliseconds is None:
            return None if node is None else Fraction(0)
        if site.cycle_ms is None:
            hint = "write `cycle_ms`, or leave it out here and in the file of ports"
            site.report.error(UNTIMED, "`timeout` counts cycles, which have no length here", mark(node), hint)
            return Fraction(0)
        return milliseconds

    def _shown(self, site: Site, slot: WhiteboardVariable) -> dict[str, str] | None:
        """The value of `state` for each state; None: there are not enough."""
        kind, name = slot.variable.type, slot.variable.name
        states = STATES[self.kind]
        if not isinstance(kind, EnumType):
            hint = f"declare a type `[{', '.join(states)}]` for it"
            self._unfit(site, "state", f"`{name}` is {kind}, not an enumeration of states", hint)
            return None
        given = self._given(site, kind)
        if given is None:
            return None
        shown = {state: given.get(state, state) for state in states}
        lacking = [state for state, value in shown.items() if value not in kind.values]
        if lacking:
            hint = f"add it to the type, or say what stands for it: `values: {{{lacking[-1]}: …}}`"
            hint = hint.replace("it", "them", 1) if len(lacking) > 1 else hint
            self._unfit(site, "state", f"the type {kind} of `{name}` lacks {', '.join(lacking)}", hint)
            return None
        init = slot.variable.init
        first = kind.values[init] if isinstance(init, int) else str(init)
        if first != IDLE:
            message = f"`{name}` is {first} at first, and a request begins with {IDLE}"
            self._unfit(site, "state", message, f"write `init: {IDLE}` at `{name}`")
            return None
        return shown

    def _given(self, site: Site, kind: EnumType) -> dict[str, str] | None:
        """What stands for states, as `values` says. An end stands for an end, so that none is taken for another."""
        groups = {state: UNDER_WAY[self.kind] if state in UNDER_WAY[self.kind] else None for state in STATES[self.kind]}
        ends = [state for state, group in groups.items() if group is None and state != IDLE]
        found: dict[str, str] = {}
        mapping = site.report.mapping(site.keys["values"], "`values`") if "values" in site.keys else None
        if mapping is None and "values" in site.keys:
            return None
        for key, node in () if mapping is None else mapping.items:
            value = site.report.scalar(node, f"the value for `{key.text[:60]}`")
            if value is None:
                return None
            if key.text not in groups:
                message = f"`{key.text[:60]}` is not a state of this request"
                hint = did_you_mean(key.text, groups) or f"write one of {', '.join(groups)}"
                site.report.error(UNFIT, message, key.span, hint)
                return None
            like = ends if key.text in ends else list(groups.get(key.text) or ())
            usable = [state for state in like if state in kind.values]
            if key.text in kind.values or value.text not in usable:
                message = f"`{value.text[:60]}` cannot stand for `{key.text[:60]}`"
                hint = f"write one of {', '.join(usable)}" if usable and key.text not in kind.values else "leave it out"
                site.report.error(UNFIT, message, mark(value), hint)
                return None
            found[key.text] = value.text
        return found


SERVICE, ACTION = RequestPlant("service", SERVICE_KEYS), RequestPlant("action", ACTION_KEYS)
PLANTS: Registry[Plant] = Registry(
    "plant",
    [
        Entry("service", "llfsm_verify.arrangement.plants:SERVICE", SERVICE_KEYS.about),
        Entry("action", "llfsm_verify.arrangement.plants:ACTION", ACTION_KEYS.about),
    ],
    "llfsm_verify.plants",
)


def use_plant(
    report: Report,
    draft: PlantDraft,
    whiteboard: Iterable[WhiteboardVariable],
    taken: Iterable[str],
    cycle_ms: Fraction | None,
    broken: Collection[str] = (),
) -> UsedPlant | None:
    """What a plant is; None: something is wrong, and was said (E533 to E535)."""
    what = f"plant `{draft.name.text[:60]}`"
    scalar = report.scalar(next(node for key, node in draft.keys.items if key.text == "use"), f"`use` of {what}")
    if scalar is None:
        return None
    unusable = [] if scalar.text in PLANTS else PLANTS.find_others()
    if scalar.text not in PLANTS:
        hint = did_you_mean(scalar.text, PLANTS) or f"write one of {', '.join(PLANTS)}"
        report.error(UNKNOWN, f"there is no plant `{scalar.text[:60]}` to use", mark(scalar), hint, tuple(unusable))
        return None
    board = {entry.variable.name: entry for entry in whiteboard}
    try:
        plant = PLANTS.load(scalar.text)
        found = report.fields(draft.keys, what, ("use", *plant.table.keys), plant.table.required)
        if found is None or len(found) < len(draft.keys.items):
            return None
        return plant.use(Site(report, draft.name, found, board, frozenset(taken) | board.keys(), cycle_ms, broken))
    except Exception as error:
        if scalar.text in PLANTS.ours:
            raise
        message = f"the plant `{scalar.text[:60]}` of another package has failed ({type(error).__name__}: {error})"
        message = str(error) if isinstance(error, Unusable) else message
        report.error(UNKNOWN, message, mark(scalar), "leave it out, or write to the authors of that package")
        return None


def _machine(
    site: Site, request: Request, shown: Mapping[str, str], board: Sequence[Variable], patience: tuple[int, int] | None
) -> MachineDraft:
    """The machine of a request. `patience`: the cycles within which the port moves, and the request ends."""
    ask, state, service = request.ask, request.state, request.kind == "service"
    seen, debt, waited, owes, due, was, go = map(site.free, ("seen", "debt", "waited", "owes", "due", "was", "go"))
    moves: dict[str, list[str]] = {}
    for before, after in MOVES[request.kind].items():
        moves.setdefault(shown[before], []).extend(shown[name] for name in after)
    idle, under_way = shown[IDLE], " || ".join(f"{state} == {name}" for name in moves)

    def move(stays: str, *others: str) -> str:
        """One move, or none; none is no choice when one is due."""
        last = [name for name in others if name not in moves] or others
        forced = f"if ({due}) {state} = choose({', '.join(last)}); else " if patience else ""
        return f"{forced}{state} = choose({stays}, {', '.join(others)});"

    lines = [f"if ({seen} != {ask}) {seen} = choose(bool);"]
    variables = {seen: "bool"}
    if patience:
        variables |= {debt: "0..3", waited: f"0..{max(patience)}"}
        lines = [
            f"0..3 {owes} = 0;",
            f"if ({ask} && {state} == {idle}) {owes} = 1;",
            f"else if ({f'{ask} && ' if service else ''}({under_way})) {owes} = 2;",
            f"else if (!{ask} && {state} != {idle}) {owes} = 3;",
            f"{waited} = {owes} != 0 && {owes} == {debt} ? {waited} + 1 : 0;",
            f"{debt} = {owes};",
            f"bool {due} = {waited} >= ({owes} == 2 ? {patience[1]} : {patience[0]});",
            f"if ({due}) {seen} = {ask}; else {lines[0]}",
        ]
    if board:
        lines.append(f"bool {was} = {under_way};")
    lines.append(f"if ({state} == {idle}) {{ if ({seen}) {move(idle, next(iter(moves)))} }}")
    for name, others in moves.items():
        ends = move(name, *dict.fromkeys(other for other in others if other != name))
        lines.append(f"else if ({state} == {name}) {{")
        lines.append(f"  if ({seen}) {{ {ends} }} else {{ {move(name, idle)} }}" if service else f"  {ends}")
        lines.append("}")
    at_once = f"{due} || " if patience else ""
    lines.append(f"else if (!{seen}) {{ bool {go} = choose(bool); if ({at_once}{go}) {state} = {idle}; }}")
    without = list(moves)  # a service that is cancelled, or takes too long, has no answer
    if service:
        without += [idle, *({shown["TIMED_OUT"]} - {shown["DONE"], shown["FAILED"]})]
    told = {variable.name: variable for variable in board}
    for names, when in (
        (request.answers, f"{was} && {' && '.join(f'{state} != {name}' for name in without)}"),
        (request.feedback, f"{was} || {under_way}"),
    ):
        any_value = [line for name in names for line in _any(name, told[name].type)]
        lines += [f"if ({when}) {{", *(f"  {line}" for line in any_value), "}"] if any_value else []
    return _one_state(site, request.kind.capitalize(), variables, "\n".join(lines))


def _any(place: str, kind: Type) -> Iterator[str]:
    """Statements that give a place any value of its type."""
    match kind:
        case ArrayType():
            for number in range(kind.size):
                yield from _any(f"{place}[{number}]", kind.element)
        case RecordType():
            for name, inner in kind.fields:
                yield from _any(f"{place}.{name}", inner)
        case BoolType():
            yield f"{place} = choose(bool);"
        case EnumType():
            yield f"{place} = choose({', '.join(kind.values)});"
        case DecimalType(low=int(low), high=int(high)):
            yield f"{place} = choose({decimal_text(low, kind.digits)}..{decimal_text(high, kind.digits)});"
        case RangeType() | FixedType():
            yield f"{place} = choose({kind.low}..{kind.high});"
        case _:
            raise AssertionError("inputs have a range")


def _one_state(site: Site, name: str, variables: Mapping[str, str], action: str) -> MachineDraft:
    """A machine that does one thing in each ringlet; the text of that is the source that traces and faults show."""
    source = Source(f"<{site.name.text}>", action)
    at = Span(source, 0, 1)
    state = StateDraft(implied("SERVES", at), actions={"internal": written(source, 0, len(action))})
    declared = tuple(VariableDraft(implied(variable, at), implied(kind, at)) for variable, kind in variables.items())
    return MachineDraft(implied(name, at), (state,), at, variables=declared)
