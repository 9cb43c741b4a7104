"""A debugger driven by commands: what each does, and what is told of it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from llfsm_verify import DiagnosticError
from llfsm_verify.extensions.debugger.commands import COMMANDS, ParsedCommand, parse
from llfsm_verify.extensions.debugger.debugger import Debugger, Went
from llfsm_verify.extensions.debugger.guards import Evaluated
from llfsm_verify.extensions.debugger.paths import Free
from llfsm_verify.plug import (
    ACTION_KINDS,
    IMPLICIT_SUSPEND,
    DebugAnswer,
    DebugError,
    DebugPart,
    DebugSteps,
    DebugTable,
    counted,
    without_controls,
)  # fmt: skip

MOST_SHOWN = 10
"""Steps that are shown of those that a command takes."""


class Driven(Protocol):
    """What a front drives: a debugger, or a look at what runs."""

    def do(self, line: str) -> DebugAnswer:
        """Do a command. DebugError: it cannot be done; the message says why."""


class Session:
    """A debugger with its commands."""

    def __init__(self, debugger: Debugger) -> None:
        self.debugger = debugger

    def do(self, line: str) -> DebugAnswer:
        """Do a command. DebugError: it cannot be done, and nothing has changed, or it stopped on its way."""
        given = parse(line)
        if given is None:
            return DebugAnswer()
        try:
            return self._do(given)
        except DiagnosticError as error:
            told = error.diagnostics[0]
            hint = f" ({told.hint})" if told.hint else ""
            raise DebugError(without_controls(f"{told.message}{hint}")) from None

    def stop(self) -> None:
        """End what another thread does with `do`, as soon as it can."""
        self.debugger.stop()

    def _do(self, given: ParsedCommand) -> DebugAnswer:
        debugger, number, words = self.debugger, given.number or 1, given.words
        match given.command.name:
            case "step":
                return self._went(debugger.step(number))
            case "cycle":
                return self._went(debugger.cycle(number))
            case "until":
                return self._went(debugger.until(words[0]))
            case "continue":
                return self._went(debugger.run())
            case "back":
                return self._went(debugger.back(number))
            case "back-cycle":
                return self._went(debugger.back_cycle(number))
            case "back-until":
                return self._went(debugger.until_back(words[0]))
            case "reverse":
                return self._went(debugger.run_back())
            case "goto":
                return self._went(debugger.go(given.number or 0))
            case "break":
                made = debugger.add_break(words[0])
                return DebugAnswer((f"break point {made}: {debugger.breaks[made].text}",))
            case "breaks":
                return DebugAnswer((self._breaks(),))
            case "delete":
                debugger.remove_break(given.number)
                return DebugAnswer((self._breaks(),))
            case "set":
                forgotten = debugger.set(words[0], words[1])
                return DebugAnswer((f"{words[0]} = {words[1]} from here on{_forgotten(forgotten)}",))
            case "free":
                return DebugAnswer((f"{words[0]} is not set any more{_forgotten(debugger.release(words[0]))}",))
            case "turn":
                return DebugAnswer((f"`{words[0]}` takes the next step{_forgotten(debugger.turn(words[0]))}",))
            case "fork":
                forgotten = debugger.fork()
                return DebugAnswer(
                    (f"from here on inputs can be set; they keep their last values{_forgotten(forgotten)}",)
                )
            case "why":
                return DebugAnswer(tuple(self._why()))
            case "show":
                return DebugAnswer((self._shown(words),))
            case "inputs":
                return DebugAnswer((self._inputs(),))
            case "value":
                return DebugAnswer((f"{words[0]}: {debugger.value(words[0])}",))
            case "expect":
                value = debugger.value(words[0])
                return DebugAnswer((f"{words[0]}: {value}",), expected=value in ("true", "satisfied"))
            case "list":
                return DebugAnswer(tuple(self._listed(words[0] if words else None)))
            case "history":
                begin = max(0, debugger.position - number)
                return DebugAnswer((self._steps(begin, debugger.position, number),))
            case "where":
                return DebugAnswer((self.where(),))
            case "help":
                return helped(words)
        return DebugAnswer(quits=True)

    # ------------------------------------------------ what is told

    def _went(self, went: Went) -> DebugAnswer:
        parts: list[DebugPart] = []
        if went.end > went.begin:
            parts.append(self._steps(went.begin, went.end, MOST_SHOWN))
        if went.reason:
            parts.append(f"{went.reason[0].upper()}{went.reason[1:]}.")
        return DebugAnswer((*parts, self.where()))

    def _steps(self, begin: int, end: int, most: int) -> DebugSteps:
        first = max(begin, end - most)
        steps = tuple(self.debugger.described(number) for number in range(first + 1, end + 1))
        return DebugSteps(first + 1, steps, first - begin)

    def where(self) -> str:
        """One line: the position, its time, and the states of all machines."""
        debugger = self.debugger
        count = debugger.cycles
        told = [f"step {debugger.position:,}", counted(count, "cycle")]
        cycle = debugger.arrangement.cycle_ms
        if cycle is not None and len(debugger.program.processes) == 1:
            told.append(f"{float(cycle * count) / 1000:g} s")
        if debugger.frame is not None:
            told.append(f"frame {debugger.frame:,}")
        later = len(debugger.history) - debugger.position
        if later:
            told.append(f"{counted(later, 'later step')} known")
        return f"at {', '.join(told)}: {' '.join(f'{m}@{s}' for m, s in debugger.states.items())}"

    def _breaks(self) -> DebugPart:
        rows = tuple((str(number), watch.text) for number, watch in self.debugger.breaks.items())
        return DebugTable(("break point", "formula"), rows) if rows else "there are no break points"

    def _inputs(self) -> DebugPart:
        path, values = self.debugger.path, self.debugger.inputs
        if not values:
            return "there are no inputs" if isinstance(path, Free) else "no step has read an input yet"
        held = path.held if isinstance(path, Free) else {}
        rows = tuple((name, value, "set" if name in held else "") for name, value in values.items())
        return DebugTable(("input", "value", "set"), rows)

    def _shown(self, names: tuple[str, ...]) -> DebugTable:
        debugger = self.debugger
        clocks = debugger.clocks
        unit = "cycles" if debugger.arrangement.timing == "timed" else "bounds"
        rows = [(name, f"@{state}") for name, state in debugger.states.items()]
        rows += [(f"clock of {name}", f"{value} {unit}") for name, value in clocks.items()]
        rows += [*debugger.controls.items(), *debugger.variables.items()]
        if names:
            known = {name for name, _ in rows}
            wrong = next((n for n in names if not any(_is_of(k, n) for k in known)), None)
            if wrong is not None:
                raise DebugError(
                    f"there is no machine or variable `{wrong[:60]}`; `show` lists them, `inputs` the others"
                )
            rows = [row for row in rows if any(_is_of(row[0], name) for name in names)]
        return DebugTable(("name", "value"), tuple(rows))

    def _why(self) -> Iterable[DebugPart]:
        debugger = self.debugger
        guards = debugger.guards()
        failed = debugger.failed if debugger.position == len(debugger.history) else None
        number = debugger.position + (1 if failed is not None else 0)
        if failed is None:
            step = debugger.described(number)
            if step.machine is None:
                yield f"step {number:,} is a stutter: the arrangement has ended"
                return
            fired = f"it took {step.fired}" if step.fired is not None else "no transition fired"
            yield f"step {number:,} was a ringlet of {step.machine} in {step.state}: {fired}"
        else:
            yield f"step {number:,} fails"
        yield (
            DebugTable(("machine", "guard", "value", "because"), tuple(map(_row, guards)))
            if guards
            else ("no guard was evaluated")
        )

    def _listed(self, name: str | None) -> Iterable[DebugPart]:
        debugger = self.debugger
        if name is None:
            name = debugger.described(debugger.position).machine if debugger.position else None
            name = name or next(iter(debugger.turns.values()), next(iter(debugger.states)))
        states = debugger.states
        if name not in states:
            raise DebugError(f"there is no machine `{name[:60]}`, only {', '.join(states)}")
        yield f"{name}@{states[name]}"
        yield from state_text(debugger, name)


def _is_of(known: str, name: str) -> bool:
    return known in (name, f"clock of {name}") or known.startswith((f"{name}.", f"{name}["))


def _forgotten(count: int) -> str:
    return f" ({counted(count, 'later step')} forgotten)" if count else ""


def _row(guard: Evaluated) -> tuple[str, str, str, str]:
    because = ", ".join(f"{part.text} = {part.value}" for part in guard.parts)
    if guard.value is None:
        return "", "", "fails", because
    return guard.machine, f"{guard.state} -> {guard.target} when {guard.guard}", str(guard.value).lower(), because


def state_text(debugger: Debugger, machine: str) -> tuple[str, ...]:
    """The state that a machine is in: its actions and transitions as they are written."""
    name = debugger.states[machine]
    found = next((s for s in debugger.arrangement.machine(machine).states if s.name == name), None)
    if found is None:
        assert name == IMPLICIT_SUSPEND, "every other state is declared"
        return ("it is suspended, in a state that is not declared",)
    lines = []
    for kind in ACTION_KINDS:
        statements = getattr(found, kind)
        if statements:
            lines.append(f"{kind}: {'; '.join(' '.join(s.span.text.split()) for s in statements)}")
    states = debugger.arrangement.machine(machine).states
    lines += [f"{i}. -> {states[t.target].name} when {t.text}" for i, t in enumerate(found.transitions, 1)]
    return tuple(lines) or ("it has no actions and no transitions",)


def helped(words: tuple[str, ...]) -> DebugAnswer:
    """What `help` says."""
    if not words:
        rows = tuple((c.usage, c.short, c.about) for c in COMMANDS)
        return DebugAnswer((DebugTable(("command", "short", "what it does"), rows),))
    command = next((c for c in COMMANDS if words[0] in (c.name, c.short)), None)
    if command is None:
        raise DebugError(f"there is no command `{words[0][:40]}`; `help` lists them")
    return DebugAnswer((f"{command.usage} (short: {command.short}): {command.about}",))
