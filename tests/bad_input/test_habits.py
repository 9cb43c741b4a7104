"""What a newcomer writes by habit, and what is said about it: each row has what is marked and what to write instead."""

from __future__ import annotations

import re
from time import process_time

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, meant_at
from llfsm_verify.language.habits import IN_ACTIONS, IN_GUARDS
from llfsm_verify.logic.parsing.mistakes import HABITS, IN_EXPRESSIONS
from llfsm_verify.logic.properties import parse_properties

CROSSING = """\
name: crossing
cycle_ms: 1000
types:
  Car: [GREEN, AMBER, RED]
  Walk: [STOP, GO, DARK]
whiteboard:
  button: {type: bool, role: input}
  cars: {type: Car, role: output}
  walk: {type: Walk, role: output}
  countdown: {type: 0..8, role: output}
  request: {type: bool}
  pos: {type: {array: 0..9, size: 3}}
machines:
  feet:
    inline:
      machine: Feet
      suspend: CLEARED
      variables: {lap: {type: 0..9}}
      states:
        - name: WAITING
          on_entry: |
            walk = STOP;
            ACTION
          transitions:
            - when: |-
                GUARD
              to: WALKING
        - name: WALKING
          on_entry: walk = GO; countdown = 8;
          transitions:
            - {when: countdown == 0, to: WAITING}
        - name: CLEARED
          stays: true
  lamp: {inline: {machine: Lamp, states: [{name: DARK_, stays: true}]}}
schedule: [feet, lamp]
"""
BLOCK = "            - when: button\n              to: WAITING"
VARIABLES = "write `variables: {lap: {type: 0..9}}`"
TRANSITION = "            - {when: countdown == 0, to: WAITING}"
ENTRY = "          on_entry: walk = GO; countdown = 8;"
BUTTON = "{type: bool, role: input}"
WALK = "[STOP, GO, DARK]"

Row = tuple[str, str, str]
"""What is written, what is marked of it, and the hint."""


def first(text: str, *properties: str) -> Diagnostic:
    with pytest.raises(DiagnosticError) as caught:
        bind(load_arrangement_text(text), parse_properties([Source("p.ltl", "\n".join(properties))]))
    return caught.value.diagnostics[0]


def judge(found: Diagnostic, marked: str, hint: str | None) -> None:
    assert found.span is not None
    assert (found.span.text, found.hint) == (marked, hint)


CLOCK = "`after(3)` asks whether the state has been active for more than 3 seconds"
LASTING = "a state measures time: enter one when it begins, and leave it by `{when: after(3), to: STATE}`"
WAIT = "an action takes no time; a transition waits: `{when: after(3), to: STATE}`"
THROWN = "nothing is thrown or caught: ask before what may fail, as in `if (y != 0) x = 6 / y;`"
GUARDS: tuple[Row, ...] = (
    ("if (request) true", "if", "a guard is the condition alone: leave out `if`"),
    ("else", "else", "write `true`: transitions are tried in their order"),
    ("otherwise", "otherwise", "write `true`: transitions are tried in their order"),
    ("1", "1", "write `true`"),
    ("{request}", "{", "a guard is the condition alone: leave out the brackets"),
    ("request;", ";", "a guard is one condition: leave out `;`"),
    ("request, button", ",", "write `&&` or `||`"),
    ("request else", "else", "`else` follows the one statement of an `if`; write several in `{ … }`"),
    ("request button", "button", "an operator, such as `&&`, is missing before it"),
    ("(request", "(", "write `)`"),
    ("request)", ")", "remove it"),
    ("pos[0 == 1", "[", "write `]`"),
    ("walk != WALK", "WALK", "write one of `STOP`, `GO`, `DARK`"),
    ("walk == go", "go", "did you mean `GO`?"),
    ("walk is GO", "is", "write `==`"),
    ("walk is not GO", "is", "write `!=`"),
    ("walk <> GO", "<>", "write `!=`"),
    ("countdown === 3", "===", "write `==`"),
    ("countdown ≥ 3", "≥", "write `>=`"),
    ("walk == GO or STOP", "STOP", "write `walk == STOP`"),
    ("countdown == 3 || 4", "4", "write `countdown == 4`"),
    ("walk in {GO, STOP}", "in", "ask for each value: `x == A || x == B`"),
    ("countdown mod 2 == 0", "mod", "write `%`"),
    ("request implies button", "implies", "write `!a || b` for `a -> b`"),
    ("WALKING", "WALKING", "write `self@WALKING`"),
    ("feet.WALKING", "feet.WALKING", "write `feet@WALKING`"),
    ("feet.is_running()", "feet.is_running", "write `is_running(feet)`"),
    ("is_running feet", "feet", "write `is_running(feet)`"),
    ("self.lap == 3", "self.lap", "write `lap`"),
    ("feet@", "@", "write `m@STATE`"),
    ("after 3", "3", "write `after(3)`"),
    ("after(3s)", "3s", "`after` counts seconds: `after(3)`"),
    ("after(3 seconds)", "seconds", "`after` counts seconds: `after(3)`"),
    ("after(500ms)", "500ms", "`after_ms` counts milliseconds: `after_ms(500)`"),
    ("after(2min)", "2min", "`after` counts seconds: `after(60)`"),
    ("request for 3s", "for", LASTING),
    ("request && button since 500 ms", "since", LASTING),
    ("every 3s", "3", LASTING),
    ("request in 3s", "in", LASTING),
    ("request after 3s", "after", "write `&& after(3)`"),
    ("request after 500ms", "after", "write `&& after_ms(500)`"),
    ("request after(3)", "after", "write `&& after(3)`"),
    ("request and after 3s", "3", "`after` counts seconds: `after(3)`"),
    ("after", "after", CLOCK),
    ("request && after >= 3", "after", CLOCK),
    ("countdown > 3s", "3s", "a number has no unit: write `3`; `after(3)` counts seconds"),
    ("is_suspended", "is_suspended", "write `is_suspended(m)`"),
    ("feet.lap == 3", "feet.lap", "write `lap`"),
    ("feet.walk == GO", "feet.walk", "write `walk`"),
    ("feet.lab == 3", "feet.lab", "did you mean `lap`?"),
    ("lamp.walk == GO", "lamp.walk", "`walk` is on the whiteboard: write `walk`"),
    ("lamp.lap == 3", "lamp.lap", "compare its state with `lamp@STATE`, or share a variable on the whiteboard"),
    ("elapsed > 3", "elapsed", CLOCK),
    (
        "rose(request)",
        "rose",
        "a guard sees the present only: keep the last value in a variable, and compare the two",
    ),
    ("len(pos) == 3", "len", "the size never changes: write the number"),
    ("$request", "$", "write the name alone"),
)
ACTIONS: tuple[Row, ...] = (
    ("if request: walk = GO;", "request", "conditions stand in brackets: `if (request) …`"),
    ("if request { walk = GO; }", "request", "conditions stand in brackets: `if (request) …`"),
    ("if request then walk = GO;", "request", "conditions stand in brackets: `if (request) …`"),
    ("if request walk = GO;", "request", "conditions stand in brackets: `if (…) …`"),
    ("if (request) && (button) walk = GO;", "&&", "put the whole condition into brackets: `if ((…) && (…)) …`"),
    ("if (walk = GO) request = true;", "=", "write `==` to compare"),
    ("if (request) then walk = GO;", "then", "leave out `then`: `if (…) x = 1;`"),
    ("if (request): walk = GO;", ":", "leave out `:`; several statements stand in `{ … }`"),
    ("if (request) walk = GO; else: walk = STOP;", ":", "leave out `:`; several statements stand in `{ … }`"),
    ("if (request) { walk = GO; } elif (button) { }", "{", "write `else if (…)`"),
    ("if (request) { walk = GO; } elseif (button) { }", "{", "write `else if (…)`"),
    ("if (request) { } else if button { }", "button", "conditions stand in brackets: `if (button) …`"),
    ("if (request) walk = GO else walk = STOP;", "O", "write `;`"),
    ("if (request { walk = GO; }", "(", "write `)`"),
    ("if (request) { walk = GO;", "{", "write `}`"),
    ("if (request) { walk = GO; }}", "}", "remove it"),
    (
        "while request: walk = GO;",
        "while",
        "the language has no `while`; use `for` over a constant range, or a state with a transition to itself",
    ),
    ("for i in 0..2: pos[i] = 0;", "i", "write `for (i in 0..2) …`"),
    ("for (i in range(3)) pos[i] = 0;", ")", "write `for (i in 0..3) …`"),
    ("switch (walk) { }", "{", "write `if (x == A) … else if (x == B) …`, or a transition for each case"),
    ("walk = STOP countdown = 0", "P", "write `;`"),
    ("walk = STOP, countdown = 0;", ",", "write `;` between two assignments"),
    ("walk = GO and countdown = 0;", "=", "write `;` between two assignments"),
    ("walk == STOP;", "==", "write `=` to assign"),
    ("countdown = max(3, 4;", "(", "write `)`"),
    ("countdown = 1 if request else 0;", "if", "write `c ? a : b`"),
    ("countdown = int(3.5);", "int", "write `floor(…)`, `ceil(…)` or `round(…)`"),
    ("pos = [0, 0, 0];", "[", "write the elements one by one: `x[0] = 1;`"),
    ("let x = 3;", "let", "a local variable is declared with its type: `int x = 3;`"),
    ("const int x = 3;", "x", "a local variable is declared with its type: `int x = 3;`"),
    (
        "goto WALKING;",
        "goto",
        "only a transition changes the state: `{when: …, to: STATE}`; `self@STATE` asks for it",
    ),
    ("suspend feet;", "suspend", "write `suspend(m);`"),
    ("feet.suspend();", "feet.suspend()", "write `suspend(feet)`"),
    ("wait(3);", "wait", WAIT),
    ("request for 3s", "for", WAIT),
    ("request = true for 500 ms;", "for", WAIT),
    ("request = true after 3s;", "after", WAIT),
    ("after 3s walk = GO;", "3", WAIT),
    ("after", "r", WAIT),
    ("after(3);", "after(3)", WAIT),
    ("if (after 3s) walk = GO;", "3", "`after` counts seconds: `after(3)`"),
    ("countdown = 3s;", "3s", "a number has no unit: write `3`; `after(3)` counts seconds"),
    ("countdown = 3 seconds;", "seconds", "a number has no unit: write `3`; `after(3)` counts seconds"),
    ("feet.lap = 2;", "feet.lap", "write `lap`"),
    ("try { walk = GO; }", "{", THROWN),
    ("try { walk = GO; } catch (e) { }", "{", THROWN),
    ("throw request;", "throw", THROWN),
    ("countdown = 3 // why", "3", "write `;`"),
    ("countdown = 3 // why\n            walk = GO;", "3", "write `;`"),
    ("countdown = 3 /* why */ walk = GO;", "3", "write `;`"),
    ("{ countdown = 3 // why\n            }", "3", "write `;`"),
    ("countdown = // why", "=", "an operand is missing before it"),
    ("print(countdown);", "print", "an action only calculates; traces and recordings show every variable"),
    ("return;", ";", "an action always runs to its end: write `if (…) { … }` around the rest"),
    ("pass", "s", "leave it out: an action may be empty"),
)
PROPERTIES: tuple[Row, ...] = (
    ("conflict: forbid [a && b]", "forbid", "write `forbid conflict: [a && b]`"),
    ("x: enforce (feet@WAITING)*", "enforce", "write `enforce x: (feet@WAITING)*`"),
    ("f: forbid [walk == GO]", "forbid", "write `forbid f: [walk == GO]`"),
    ("a: automaton never x.hoa", "automaton never", "write `automaton never a: x.hoa`"),
    ("G walk != WALK", "WALK", "write one of `STOP`, `GO`, `DARK`"),
    ("G (WALKING -> cars == RED)", "WALKING", "write `feet@WALKING`"),
    ("feet@WALKING || WAITING", "WAITING", "write `feet@WAITING`"),
    ("never (walk == GO)", "(", "write `G !(…)`, or `absence of …`"),
    ("never request", "request", "write `G !(…)`, or `absence of …`"),
    ("walk == GO leads to request", "leads", "for `p leads to s` write `s responds to p`, which is `G (p -> F s)`"),
    ("walk == GO ~> request", "~", "for `p leads to s` write `s responds to p`, which is `G (p -> F s)`"),
    ("walk == GO responds request", "responds", "write `s responds to p`"),
    ("walk == GO within 3s", "within", "write `F[<=3s] …`; only `s responds to p` takes `within 3s`"),
    (
        "forbid y: G (walk == GO)",
        "G",
        'letters have no temporal operators: write `[walk == GO]`, or `"G"` for a variable',
    ),
    ("forbid y: walk == GO", "==", "put a formula into brackets: `[walk == GO]`"),
    ("forbid y: button; request", ";", "write letters next to each other: `a b`"),
    ("forbid y: button[*3]", "*", "write `a{3}`, `a{2,5}`, `a*` or `a+` for a letter `a`"),
    ("forbid y: [button", "[", "write `]`"),
    ("G (button", "(", "write `)`"),
    ("A[] button", "[]", "every property is about all runs: write `G`"),
    ("E<> button", "<>", "`llfsm query ARRANGEMENT p` tells whether a run reaches p"),
    ("LTLSPEC G button", "G", "a line is `NAME: formula`"),
    ("invariant button", "button", "write `NAME: G (…)`"),
    ("x = G button", "=", "write `x: …`"),
    ("G (walk is GO)", "is", "write `==`"),
    ("G walk /= GO", "=", "write `!=`"),
    ("G walk == Walk::GO", "G walk == Walk", "write `Walk.GO`"),
    ("G (if button request)", "button", "write `p -> q`"),
    (
        "G (countdown in {1, 2})",
        "in",
        "ask for each value: `x == 1 || x == 2`, or for both ends: `1 <= x && x <= 3`",
    ),
    ("G (↑button)", "↑", "write `rose(…)`"),
    ("rose button", "button", "write `rose(button)`"),
    ("G feet.entered WALKING", "WALKING", "write `feet.entered(WALKING)`"),
    ("G feet.ran()", "feet.ran", "write `feet.ran`"),
    ("G feet@", "@", "write `m@STATE`, or `m@{A, B}` for several"),
    ("G pos.0 == 1", "0", "write `pos[0]`"),
    ("G prev(countdown) == 3", "prev", "write `Y (x == 3)` for the step before, or `changed(x)`"),
    ("F (<=3s) button", "<=", "write `F[<=3s]`"),
    (
        "G after(3s)",
        "3s",
        "a property does not wait: ask for the state, or write a bound in time, such as `F[<=3s] p`",
    ),
    ("G button // why", "/", "a comment begins with `#`"),
    ("G button, G request", ",", "write `&&`, or a line for each property"),
    ("button request", "request", "write an operator there, such as `&&` or `->`"),
    (
        'x: "G button"',
        "button",
        "quotes make one atom of a text: leave them out of a formula with temporal operators",
    ),
    (
        "for v in {-1, 1}: a: G countdown != v",
        "-1",
        "values are names and numbers from 0 on, without a point: write these properties one by one",
    ),
    (
        "for v in {1, 0.1}: a: G countdown != v",
        "0.1",
        "values are names and numbers from 0 on, without a point: write these properties one by one",
    ),
    (
        "for v in -1..1: a: G countdown != v",
        "-1",
        "values are names and numbers from 0 on, without a point: write these properties one by one",
    ),
    (
        "for (v in 1..3): a: G countdown != v",
        "for (v in 1..3)",
        "write `for i in 0..3: NAME: …`, or `for m in {ns, ew}: NAME: …`",
    ),
)
MENDS: tuple[tuple[str, str, str | None, str], ...] = (
    (
        "a G button",
        "G",
        "write `a: G button` where `a` is its name, or else an operator there, such as `&&` or `->`",
        "a: G button",
    ),
    (
        "my-own [] button",
        "[]",
        "write `my-own: [] button` where `my-own` is its name, or else an operator there, such as `&&` or `->`",
        "my-own: [] button",
    ),
    ("a: button G request", "G", "write an operator there, such as `&&` or `->`", "a: button && G request"),
    ("eventually G button", "G", "write `F`", "F G button"),
    (
        "assume a G button",
        "assume",
        'write `assume a: G button`, or `"assume"` for a variable of that name',
        "assume a: G button",
    ),
    (
        "assume a := F button",
        "assume",
        'write `assume a: F button`, or `"assume"` for a variable of that name',
        "assume a: F button",
    ),
    (
        "assume button -> F request",
        "assume",
        'write `assume NAME: button -> F request`, or `"assume"` for a variable of that name',
        "assume NAME: button -> F request",
    ),
    (
        "forbid a [button]",
        "forbid",
        'write `forbid a: [button]`, or `"forbid"` for a variable of that name',
        "forbid a: [button]",
    ),
    (
        "enforce (button request)*",
        "enforce",
        'write `enforce NAME: (button request)*`, or `"enforce"` for a variable of that name',
        "enforce NAME: (button request)*",
    ),
    (
        "forbid initially [button]",
        "forbid",
        "write `forbid initially NAME: [button]`",
        "forbid initially NAME: [button]",
    ),
    (
        "initially forbid a: [button]",
        "initially",
        "write `forbid initially a: [button]`",
        "forbid initially a: [button]",
    ),
    ("initially assume a: button", "initially", "write `assume a: initially button`", "assume a: initially button"),
    ("initially a: button", "initially", "write `a: initially button`", "a: initially button"),
    (
        "define late = button && request",
        "late",
        "write `define late: button && request`",
        "define late: button && request",
    ),
    ("let late := button", "late", "write `define late: button`", "define late: button"),
    ("Initially button", "button", "write `initially`", "initially button"),
    ("init G button", "G", "write `initially`", "initially G button"),
    ("G (button, request)", ",", "write `&&`, or a line for each property", "G (button && request)"),
    (
        "forbid a: [button] then [request]",
        "then",
        "in a rule write letters next to each other: `a b`",
        "forbid a: [button] [request]",
    ),
    ("forbid a: feet.lap == 1", "==", "put a formula into brackets: `[feet.lap == 1]`", "forbid a: [feet.lap == 1]"),
    ("-- the lights", "--", "a comment begins with `#`", "# the lights"),
    ("G button -- why", "--", "a comment begins with `#`", "G button # why"),
    ("; the lights", ";", "a comment begins with `#`", "# the lights"),
    ("% the lights", "%", "a comment begins with `#`", "# the lights"),
    ("G button;", ";", "remove it: a property ends with its line", "G button"),
    ("forbid a: button{2;3}", ";", "write `{2,3}`", "forbid a: button{2,3}"),
    ("if button then F request", "button", "write `G (button -> F request)`", "G (button -> F request)"),
    ("G (if button then request)", "button", "write `button -> request`", "G (button -> request)"),
    (
        "G (if button then request else pos[0] == 1)",
        "button",
        "write `((button) -> (request)) && (!(button) -> (pos[0] == 1))`",
        "G (((button) -> (request)) && (!(button) -> (pos[0] == 1)))",
    ),
    ("when (button), F request", ",", "write `G ((button) -> F request)`", "G ((button) -> F request)"),
    ("feet.state == WALKING", "state", "write `feet@WALKING`", "feet@WALKING"),
    ("feet.current_state != feet.WALKING", "current_state", "write `!feet@WALKING`", "!feet@WALKING"),
    ("feet == WALKING", "feet", "write `feet@WALKING`", "feet@WALKING"),
    (
        "feet is in WALKING",
        "is",
        "write `feet@WALKING` for a state of a machine, `feet == WALKING` for a value",
        "feet@WALKING",
    ),
    ("F<3s button", "F", 'write `"F"` for a variable of that name, or `F[<=3s]`', "F[<=3s] button"),
    (
        "F<=3 button",
        "F",
        'write `"F"` for a variable of that name, or `F[<=3s]` for seconds, or `F[0:3]` for steps',
        "F[0:3] button",
    ),
    ("button U<3s request", "<", "write `U[<=3s]`", "button U[<=3s] request"),
    ("F[>3] button", "[>3]", "write `F[>=3s]` for seconds, or `X[3] F` for steps", "X[3] F button"),
    ("F[0,3] button", "[0,3]", "write `F[0:3]`", "F[0:3] button"),
    ("F[1 sec to 2 sec] button", "[1 sec to 2 sec]", "write `F[1s:2s]`", "F[1s:2s] button"),
    ("F{3} button", "{", "write `F[0:3]`", "F[0:3] button"),
    ("X{3} button", "{", "write `X[3]`", "X[3] button"),
    ("GF feet@WAITING", "GF", "write `G F feet@WAITING`", "G F feet@WAITING"),
    ("(GF button) && request", "GF", "write `G F`", "(G F button) && request"),
    ("countdown == 1 || 2", "2", "write `countdown == 2`", "countdown == 1 || countdown == 2"),
    ("pos[1] != 1 && 2", "2", "write `pos[1] != 2`", "pos[1] != 1 && pos[1] != 2"),
    ("countdown == (1 || 2)", "1", "write `(countdown == 1 || countdown == 2)`", "(countdown == 1 || countdown == 2)"),
    ("countdown == (1 || 2 || 3)", "1", "ask for each value: `x == 1 || x == 2`", ""),
    ("countdown + 1 == 2 || 3", "3", None, ""),
    (
        "F button within 3 seconds",
        "within",
        "write `F[<=3s] …`; only `s responds to p` takes `within 3s`",
        "F[<=3s] button",
    ),
    (
        "F button within 3",
        "within",
        "write `F[0:3] …` for steps; only `s responds to p` takes `within`, and a time",
        "F[0:3] button",
    ),
    (
        "request responds to button within 3 seconds",
        "within",
        "write `within 3s`",
        "request responds to button within 3s",
    ),
    ("G countdown < 1.5e3", "1.5e3", "write `1500`", "G countdown < 1500"),
    (
        "forbid y: button ##1 request",
        "##1",
        "for a delay of SVA write `a b` in a rule, `p && X[1] q` in a formula; for a comment write `# 1`",
        "forbid y: button request",
    ),
    (
        "G button ##[1:3] request",
        "##[1:3]",
        "for a delay of SVA write `a b` in a rule, `p && X[1] q` in a formula; for a comment write `# 1`",
        "G (button && X[1] request)",
    ),
)
"""Of properties too: what is written, what is marked of it, the hint, and the line mended by it."""
FILES: tuple[tuple[str, str, str, str], ...] = (
    (TRANSITION, TRANSITION[:-1], "{", "write `}` where it ends"),
    (TRANSITION, "            - {when: true && after(5), to: WAITING", "{", "write `}` where it ends"),
    (TRANSITION, "            - {when: 'true && after(5)', to: WAITING", "{", "write `}` where it ends"),
    (TRANSITION, TRANSITION.replace("{", ""), TRANSITION.replace("{", "").strip(), f"write `{TRANSITION.strip()}`"),
    (BUTTON, "type: bool, role: input}", "button: type: bool, role: input}", f"write `button: {BUTTON}`"),
    (TRANSITION, TRANSITION.replace("- ", "-"), TRANSITION.replace("- ", "-").strip(), f"write `{TRANSITION.strip()}`"),
    ("        - name: WAITING", "        -name: WAITING", "-name: WAITING", "write `- name: WAITING`"),
    (TRANSITION, BLOCK.replace("- ", "-"), "-when: button", "write `- when: button`"),
    (TRANSITION, BLOCK.replace("when:", "when"), "- when button", "write `- when: button`"),
    (TRANSITION, BLOCK.replace(": button", ""), "- when", "write `- when:`"),
    ("name: crossing", "name crossing", "name crossing", "write `name: crossing`"),
    ("      states:", "      states", "states", "write `states:`"),
    ("      variables: {lap", "      variables {lap", "variables {lap: {type: 0..9}}", VARIABLES),
    ("  feet:\n", "  feet\n", "feet", "write `feet:`"),
    ("    inline:\n", "    inline\n", "inline", "write `inline:`"),
    (BUTTON, BUTTON + ";", ";", "remove the `;`"),
    (BUTTON, BUTTON + "}", "}", "remove the `}`"),
    (BUTTON, BUTTON[:-1] + "]", "]", "write `}`"),
    (BUTTON, "{type: bool, init: false};", ";", "remove the `;`"),
    (BUTTON, "{type: {array: bool, size: 1}, init: [true]};", ";", "remove the `;`"),
    (BUTTON, "{type: bool, init: false role: input}", "role", "write `,`"),
    (BUTTON, "{type: bool, role input}", "role input", "write `role: input`"),
    (BUTTON, "{type bool, role: input}", "type bool", "write `type: bool`"),
    (BUTTON, "{type: bool, init=false}", "init=false", "write `init: false`"),
    (BUTTON, "(type: bool, role: input)", "button: (type: bool, role: input)", f"write `button: {BUTTON}`"),
    (f"button: {BUTTON}", f"button {BUTTON}", f"button {BUTTON}", f"write `button: {BUTTON}`"),
    (f"button: {BUTTON}", "bool button = false;", "bool button = false;", "write `button: {type: bool, init: false}`"),
    (BUTTON, "bool, role: input", ":", f"write `button: {BUTTON}`"),
    (BUTTON, "input bool", "input bool", f"write `button: {BUTTON}`"),
    (BUTTON, "0..8 = 3", "0..8 = 3", "write `button: {type: 0..8, init: 3}`"),
    (BUTTON, "{type: 0..8 = 3}", "0..8 = 3", "write `type: 0..8, init: 3`"),
    (BUTTON, "false", "false", "write `button: {type: bool, init: false}`"),
    (BUTTON, "20", "20", "write `button: {type: 0..20, init: 20}`"),
    (TRANSITION, TRANSITION.replace("to:", "to"), "to WAITING", "write `to: WAITING`"),
    (TRANSITION, TRANSITION.replace("to: ", "to:"), "to:WAITING", "write `to: WAITING`"),
    (TRANSITION, TRANSITION.replace("when:", "when"), "when countdown == 0", "write `when: countdown == 0`"),
    (
        "        - name: WALKING",
        "        - WALKING:",
        "WALKING",
        "write `- name: WALKING`, and its other keys right below `name`",
    ),
    (
        "{inline: {machine: Lamp, states: [{name: DARK_, stays: true}]}}",
        "lamp.yaml",
        "lamp.yaml",
        "write `lamp: {file: lamp.yaml}`",
    ),
    (
        "{inline: {machine: Lamp, states: [{name: DARK_, stays: true}]}}",
        "Lamp",
        "Lamp",
        "write `lamp: {file: Lamp.machine.yaml}`",
    ),
    ("[{name: DARK_, stays: true}]", "{DARK_: {stays: true}}", "{", "write `- name: DARK_` for `DARK_:`, and so on"),
    (TRANSITION, TRANSITION.replace(",", ""), "to", "write `,`"),
    (TRANSITION, TRANSITION.replace(",", ";"), "to", "write `,` for `;`"),
    (TRANSITION, TRANSITION + ",", ",", "remove the `,`"),
    (
        TRANSITION,
        "            - {when: request # c, to: A}",
        "{",
        "` #` begins a comment: quote the text in which it stands",
    ),
    (TRANSITION, "            - {when: 'request, to: A}", "'", "write `'` where the text ends"),
    (TRANSITION, "            - {when: pos[0] == 1, to: A}", "pos[0] == 1", "quote it: '…'"),
    (TRANSITION, "            - request -> WAITING", "request -> WAITING", "write `{when: …, to: STATE}`"),
    (TRANSITION, TRANSITION.replace("- ", ""), "{", "write `- ` before each of them"),
    (TRANSITION, "            - when: true\n              to WAITING", "to WAITING", "write `to: WAITING`"),
    ("schedule: [feet, lamp]", "schedule: [feet, lamp", "[", "write `]` where it ends"),
    ("schedule: [feet, lamp]", "schedule:[feet, lamp]", "schedule:[feet, lamp]", "write `schedule: [feet, lamp]`"),
    ("schedule: [feet, lamp]", "schedule [feet, lamp]", "schedule [feet, lamp]", "write `schedule: [feet, lamp]`"),
    ("schedule: [feet, lamp]", "schedule: feet, lamp", "feet, lamp", "write `[feet, lamp]`"),
    ("cycle_ms: 1000", "cycle_ms:1000", "cycle_ms:1000", "write `cycle_ms: 1000`"),
    ("cycle_ms: 1000", "period: 1000", "period", "write `cycle_ms`"),
    ("name: crossing", "name: a: b", ":", "quote it: '…'"),
    (BUTTON, "type: bool, role: input", ":", "write `button: {type: bool, role: input}`"),
    (TRANSITION, "            - when: request, to: WAITING", ":", "write `- {when: request, to: WAITING}`"),
    ("name: crossing", "name: @a", "@", "quote it: '…'"),
    (BUTTON, BUTTON[:-1], "{", "write `}` where it ends"),
    (BUTTON, BUTTON.replace(",", ""), "role", "write `,`"),
    (BUTTON, "{\n    type: bool\n    role: input}", "role", "write `,`"),
    (BUTTON, "{type: bool, input}", "input", "write `role: input`"),
    (BUTTON, "{type: bool, default: true}", "default", "write `init`"),
    (BUTTON, "{type: 0-8, role: input}", "0-8", "write `0..8`"),
    (BUTTON, "{type: bool[3], role: input}", "[", "write `{array: bool, size: 3}` for a type, and quote anything else"),
    (WALK, WALK[:-1], "[", "write `]` where it ends"),
    (WALK, "{STOP, GO, DARK}", "{", "write `[STOP, GO, DARK]` for an enumeration"),
    (WALK, "STOP | GO | DARK", "STOP | GO | DARK", "write `[STOP, GO, DARK]` under `types`"),
    (WALK, "[STOP IT, GO]", "STOP IT", "use letters, digits and `_`, no digit first, such as `STOP_IT`"),
    (ENTRY, ENTRY.replace("on_entry", "entry"), "entry", "write `on_entry`"),
    (ENTRY, ENTRY.replace("on_entry", "during"), "during", "write `internal`"),
    (
        ENTRY,
        "          on_entry: walk = GO;\n          countdown = 8;",
        "countdown = 8;",
        "write `on_entry: |`, and indent the lines of the action by more than `on_entry`",
    ),
    ("    inline:\n", "", "feet", "write `inline:` above them, and indent them by more"),
)


PASTED = tuple(row for row in FILES if re.fullmatch("write `[^`…]+[^`:…,]`", row[3]) and "{file" not in row[3])


@pytest.mark.parametrize(("text", "marked", "hint"), GUARDS, ids=lambda part: part)
def test_in_guards(text: str, marked: str, hint: str) -> None:
    judge(first(CROSSING.replace("ACTION", "").replace("GUARD", text)), marked, hint)


@pytest.mark.parametrize(("text", "marked", "hint"), ACTIONS, ids=lambda part: part)
def test_in_actions(text: str, marked: str, hint: str) -> None:
    judge(first(CROSSING.replace("ACTION", text).replace("GUARD", "true")), marked, hint)


@pytest.mark.parametrize(("text", "marked", "hint"), PROPERTIES, ids=lambda part: part)
def test_in_properties(text: str, marked: str, hint: str) -> None:
    judge(first(CROSSING.replace("ACTION", "").replace("GUARD", "true"), text), marked, hint)


@pytest.mark.parametrize(("text", "marked", "hint", "mended"), MENDS, ids=str)
def test_in_properties_that_are_mended(text: str, marked: str, hint: str | None, mended: str) -> None:
    judge(first(CROSSING.replace("ACTION", "").replace("GUARD", "true"), text), marked, hint)
    bind(
        load_arrangement_text(CROSSING.replace("ACTION", "").replace("GUARD", "true")),
        parse_properties([Source("p.ltl", mended)]),
    )
    given = re.findall(r"`([^`]+?)(?: …)?`", hint or "")
    assert not mended or not (hint or "").startswith("write") or any(part in mended for part in given)


@pytest.mark.parametrize(("right", "text", "marked", "hint"), FILES, ids=lambda part: part)
def test_in_files(right: str, text: str, marked: str, hint: str) -> None:
    whole = CROSSING.replace("ACTION", "").replace("GUARD", "true")
    assert whole.count(right)
    judge(first(whole.replace(right, text, 1)), marked, hint)


def test_arrays_may_be_called_as_kinds_are() -> None:
    text = CROSSING.replace("ACTION", "").replace("GUARD", "true").replace("pos:", "forbid:")
    bound = bind(load_arrangement_text(text), parse_properties([Source("p.ltl", "x: forbid[0] == 1")]))
    assert len(bound.properties) == 1


@pytest.mark.parametrize("sign", ["a", " ", "(", "@", "=", "if (", "1.", "for (i in ", "if a, ", "a == 1 || "])
def test_a_long_text_is_looked_at_quickly(sign: str) -> None:
    for table in (IN_GUARDS, IN_ACTIONS, HABITS, IN_EXPRESSIONS):
        begun = process_time()
        meant_at(table, sign * 20_000, 10_000)
        assert process_time() - begun < 2  # what grows with the square of the text takes minutes


@pytest.mark.parametrize(("right", "text", "marked", "hint"), PASTED, ids=lambda part: part)
def test_mends_can_be_pasted(right: str, text: str, marked: str, hint: str) -> None:
    """What a hint says to write instead of what is marked is accepted there."""
    whole = CROSSING.replace("ACTION", "").replace("GUARD", "true").replace(right, text, 1)
    span = first(whole).span
    assert span is not None
    mended = hint.removeprefix("write `").removesuffix("`")
    line = whole.rfind("\n", 0, span.start) + 1
    begin = whole.find(mended.split()[0], line, span.start)  # the hint may write the key of the marked value, too
    end = span.end if len(marked) > 1 else whole.index("\n", span.end)
    load_arrangement_text(whole[: span.start if begin < 0 else begin] + mended + whole[end:])
