"""The names of an image: identifiers of C for what users named, and where each variable lies in its structs.

A name that C or C++ keeps for itself, or that headers of controllers may have as a macro (`PORTB`), gets an underscore.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.c.codes import SAME_NAME
from llfsm_verify.extensions.c.numbers import WIDE, Number, stored_as
from llfsm_verify.extensions.c.texts import runtime_names
from llfsm_verify.plug import INT64_MAX, INT64_MIN, Choice, EventKind, Int, Program, Span, Type, Var

_WORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline int long
    register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
    bool true false asm catch class constexpr delete explicit export friend mutable namespace new noexcept nullptr
    operator private protected public template this throw try typeid typename using virtual and or not xor bitand
    bitor compl alignas alignof decltype concept requires import module final override unix linux i386 errno assert
    stdin stdout stderr main typeof complex imaginary noreturn thread_local static_assert math_errhandling
    wchar_t char8_t char16_t char32_t co_await co_return co_yield consteval constinit const_cast decltype
    dynamic_cast reinterpret_cast static_cast mutable not_eq and_eq or_eq xor_eq
    st_atime st_mtime st_ctime si_pid si_uid si_value si_addr si_status sa_handler sa_sigaction h_addr s6_addr
"""
TYPES = frozenset(f"{u}int{bits}_t" for u in ("", "u") for bits in (8, 16, 32, 64, "ptr", "max")) | {
    "size_t", "ssize_t", "ptrdiff_t", "off_t", "time_t", "clock_t", "sig_atomic_t", "mbstate_t", "fpos_t",
}  # fmt: skip
KEPT = frozenset(_WORDS.split()) | TYPES
"""Words of C and C++, and macros and types of their headers."""
_HEADERS = """
    aio alloca arpa assert complex cpio ctype dirent dlfcn endian errno error fcntl features fenv float fmtmsg fnmatch
    ftw getopt glob grp iconv inttypes iso646 langinfo libgen limits locale malloc math memory monetary mqueue ndbm
    netdb nl_types paths poll pthread pwd regex sched search semaphore setjmp signal spawn stdalign stdarg stdatomic
    stdbool stddef stdint stdio stdlib stdnoreturn string strings stropts syscall syslog tar termios tgmath threads
    time trace uchar ulimit unistd utime utmpx values wait wchar wctype wordexp
"""
HEADERS = frozenset(_HEADERS.split())
"""Headers of C, POSIX and avr-libc, which a file of that name would hide from `#include <…>`."""
_OF_POSIX = re.compile(r"sem\Z|pthread_|posix_|u?int(8|16|32|64|ptr|max)\Z|u?int_(least|fast)\d+\Z")
"""Beginnings of names that POSIX and C have: `sem_init`, `int16_t`."""
EVENTS = "events"
"""Of a state: how often what is counted has happened."""
SPECIAL = ("outputs", "whiteboard", "control", "status", "before", EVENTS)
"""Groups of variables and other fields; a machine of such a name gets an underscore."""

OWN = (
    "inputs", "outputs", "state", "status", "init", "step", "cycle", "safe", "first", "layout", "LAYOUT", "PERIOD_NS",
    "H", "OK", "ENDED", "OVERFLOW", "BAD_INPUT", "CORRUPT", "LOOP_H", "calls", "options", "report", "ending", "run",
    "percentile", "END_RUNNING", "END_FINISHED", "END_STOPPED", "END_FAULT", "END_OVERFLOW", "END_LATE", "END_CORRUPT",
)  # fmt: skip
"""What the header declares for every arrangement, after the name of this one."""


def identifier(name: str) -> str:
    """What stands for a name in C, as a part of a longer identifier."""
    found = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_") or "x"
    return f"x{found}" if found[0].isdigit() else found


def alone(name: str) -> str:
    """The same where it stands alone."""
    found = identifier(name)
    macro = not re.search("[a-z]", found) or re.match("(PRI|SCN)[a-z]", found)
    return f"{found}_" if found in KEPT or macro else found


def foreign(prefix: str) -> str:
    """What of C the names of an image with this prefix would hide, or be; "": nothing."""
    if prefix.lower() in HEADERS:
        return f"its header would be {prefix}.h, which C or POSIX has"
    return f"names that begin with `{prefix}_` belong to C or POSIX" if _OF_POSIX.match(prefix) else ""


@dataclass(frozen=True, slots=True)
class Field:
    """A variable in the state: its group, its name there and its type."""

    var: Var
    group: str
    name: str
    type: str

    @property
    def path(self) -> str:
        return f"{self.group}.{self.name}"


def _value(text: str, kind: Type, stored: str) -> Number:
    """What is stored there, as an operand; beyond 63 bits in two halves."""
    low, high = (kind.low, kind.high) if isinstance(kind, Int) else (INT64_MIN, INT64_MAX)
    if high > INT64_MAX:
        return Number(f"wide_of(0, {text})", WIDE, low, high)
    return Number(text, stored, low, high)


class Names:
    """Of one program. `outputs`: the variables that are outputs of the arrangement; `enumerations`: names by values;
    `places`: where variables of the whiteboard, machines and enumerations are declared; `counted`: what the state
    counts.

    DiagnosticError (E504): two names would be one.
    """

    def __init__(
        self,
        program: Program,
        outputs: Collection[str] = (),
        enumerations: Mapping[tuple[str, ...], str] | None = None,
        places: Mapping[str, Span] | None = None,
        counted: Sequence[EventKind] = (),
    ) -> None:
        self.program = program
        self.counted = counted
        self.prefix = identifier(program.name)
        self._enumerations = enumerations or {}
        self._places = places or {}
        self._taken = {f"{self.prefix}_{name}": "a name of every image" for name in OWN}
        self._taken |= dict.fromkeys(runtime_names(), "a function of every image")
        self.machines = [identifier(m.name) for m in program.machines]
        self._groups = {
            m.name: f"{alone(m.name)}_" if alone(m.name) in SPECIAL else alone(m.name) for m in program.machines
        }
        for name, group in self._groups.items():
            self._take(f"state.{group}", f"machine `{name}`", name)
        self.fields = {v.name: self._field(v, v.name in outputs) for v in program.vars}
        self.inputs = {c.name: alone(c.name) for c in program.choices}
        for name, field in self.inputs.items():
            self._take(f"inputs.{field}", f"input `{name}`", name)
        self._states = {s.state: program.machines[s.machine] for s in program.slots}
        for kind, (name, labels) in self._kinds.items():
            self._take(kind, f"the type of `{name}`", name)
            for label in labels:
                self._take(self._label(name, label), f"`{label}` of `{name}`", name)

    def _take(self, name: str, what: str, owner: str) -> None:
        """A name is taken by something of what is declared as `owner`."""
        self.take(name, what, self._places.get(re.split(r"[.\[]", owner)[0]))

    def take(self, name: str, what: str, place: Span | None) -> None:
        """A name is taken by something that is declared there. DiagnosticError (E504): it was taken before."""
        other = self._taken.setdefault(name, what)
        if other is not what:
            message = f"{other} and {what} would both be `{name.partition('.')[2] or name}` in C"
            raise DiagnosticError(Diagnostic(SAME_NAME, message, place, hint="give one of them another name"))

    def private(self, name: str) -> str:
        """The name of a function that nobody outside calls."""
        return f"{name}_" if name in self._taken else name

    def _field(self, var: Var, output: bool) -> Field:
        kind, machine = var.origin.kind, var.origin.machine
        rest = var.name
        if machine in self._groups and rest.startswith(f"{machine}."):
            group, rest = self._groups[machine], rest.removeprefix(f"{machine}.")
        else:
            group = "outputs" if output else "whiteboard" if kind in ("whiteboard", "input") else "control"
        name = f"{identifier(rest)}_" if "$" in rest and group != "control" else alone(rest)
        self._take(f"{group}.{name}", f"`{var.name}`", var.name)
        return Field(var, group, name, stored_as(var.type))

    def _label(self, owner: str, label: str) -> str:
        return f"{self.prefix}_{identifier(owner)}_{identifier(label)}"

    @cached_property
    def _kinds(self) -> dict[str, tuple[str, tuple[str, ...]]]:
        """By the name of a type: whose it is, and the names of its values."""
        found = {f"{self.prefix}_{identifier(name)}": (name, labels) for labels, name in self._enumerations.items()}
        return found | {self._states_of(m.name): (m.name, m.states) for m in self.program.machines}

    def _states_of(self, machine: str) -> str:
        return f"{self.prefix}_{identifier(machine)}_states"

    @cached_property
    def enumerations(self) -> dict[str, tuple[str, ...]]:
        """The enumerators by the name of their type: users' enumerations, and the states of each machine."""
        return {kind: tuple(self._label(owner, x) for x in labels) for kind, (owner, labels) in self._kinds.items()}

    def enumeration(self, name: str, labels: tuple[str, ...]) -> str:
        """The type of the enumerators of a variable, or of a choice with these labels; "": it has none."""
        if name in self._states:
            return self._states_of(self._states[name].name)
        return f"{self.prefix}_{identifier(self._enumerations[labels])}" if labels in self._enumerations else ""

    def value_name(self, name: str, value: int) -> str | None:
        """The enumerator of a value of a variable."""
        var = self.fields[name].var
        low = var.type.low if isinstance(var.type, Int) else 0
        labels = self.enumerations.get(self.enumeration(name, var.origin.labels), ())
        return labels[value - low] if 0 <= value - low < len(labels) else None

    def load(self, name: str, index: str | None = None) -> Number:
        """A variable, or an element of it."""
        field = self.fields[name]
        text = f"state->{field.path}" + ("" if index is None else f"[{index}]")
        return _value(text, field.var.type, field.type)

    def sample(self, choice: Choice) -> Number:
        """The value of a choice."""
        return _value(f"inputs->{self.inputs[choice.name]}", choice.type, stored_as(choice.type))
