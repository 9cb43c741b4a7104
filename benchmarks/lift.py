"""A lift of 5 floors with people who call it, each a process of its own, and a queue of calls on each floor: for three
checkers.

A process that looks after the calls writes them into the queues; the lift goes round the floors that have calls.
In NuSMV's language a variable says whose step it is: its arrays are written out, since indices must be constant there.
"""

from __future__ import annotations

FLOORS = 5


def arrangement(people: int) -> str:
    """The processes of so many people, of the calls, and of the lift."""
    floors, persons = range(FLOORS), range(people)
    lines = ["name: lift", "timing: untimed", "types:", "  Ph: [OUT, CALLED, WAITING, ASKED]", "whiteboard:"]
    for i in persons:
        lines += [f"  {{}}{i}: {{{{type: 0..{FLOORS - 1}}}}}".format(name) for name in ("at", "dest")]
        lines += [f"  ph{i}: {{type: Ph}}"]
    lines += [f"  queue: {{type: {{array: 0..{people - 1}, size: {FLOORS * people}}}}}"]
    lines += [f"  waits: {{type: {{array: 0..{people}, size: {FLOORS}}}}}", f"  current: {{type: 0..{FLOORS - 1}}}"]
    lines += ["machines:", *(_person(i) for i in persons)]
    calls = " else ".join(
        f"if (ph{i} == CALLED) {{ queue[at{i} * {people} + waits[at{i}]] = {i}; waits[at{i}]++; ph{i} = WAITING; }}"
        for i in persons
    )
    anyone = " || ".join(f"waits[{f}] > 0" for f in floors)
    asked = " || ".join(f"(who == {i} && ph{i} == ASKED)" for i in persons)
    take = " ".join(f"if (who == {i}) {{ going = dest{i}; }}" for i in persons)
    out = " ".join(f"if (who == {i}) {{ at{i} = current; ph{i} = OUT; }}" for i in persons)
    lines += [
        f"""  servis:
    inline:
      machine: Servis
      states:
        - name: Q
          stays: true
          internal: "{calls}"
  lift:
    inline:
      machine: Lift
      variables:
        going: {{type: 0..{FLOORS - 1}}}
        serving: {{type: 0..{FLOORS - 1}}}
        who: {{type: 0..{people - 1}}}
      states:
        - name: CHOOSE
          transitions: [{{when: "waits[serving] > 0", to: MOVE}}]
          internal: "if ({anyone}) serving = (serving + 1) % {FLOORS};"
        - name: MOVE
          transitions: [{{when: serving == current, to: PICK}}]
          internal: "if (serving < current) current--; else current++;"
          on_exit: |
            who = queue[current * {people}];
            for (i in 0..{people - 2}) queue[current * {people} + i] = queue[current * {people} + i + 1];
            queue[current * {people} + {people - 1}] = 0;
            waits[current]--;
        - name: PICK
          transitions: [{{when: "{asked}", to: TRANSPORT}}]
          on_exit: "{take}"
        - name: TRANSPORT
          transitions: [{{when: going == current, to: CHOOSE}}]
          internal: "if (going < current) current--; else current++;"
          on_exit: "{out} going = 0; who = 0;"
processes:"""
    ]
    return "\n".join([*lines, *(f"  x_{m}: [{m}]" for m in [*(f"p{i}" for i in persons), "servis", "lift"]), ""])


def _person(i: int) -> str:
    return f"""  p{i}:
    model: true
    inline:
      machine: Person{i}
      states:
        - name: OUT
          on_entry: ph{i} = CALLED;
          transitions: [{{when: ph{i} == WAITING, to: ASKS}}]
        - name: ASKS
          on_entry: |
            0..{FLOORS - 2} other = choose(0..{FLOORS - 2});
            dest{i} = other < at{i} ? other : other + 1;
            ph{i} = ASKED;
          transitions: [{{when: ph{i} == OUT, to: OUT}}]"""


PROPERTIES = """served: G (ph0 == CALLED -> F ph0 == OUT)
again: G F ph0 == OUT
bound: G (waits[0] <= 2)
"""


def verdicts(people: int) -> dict[str, str]:
    """More than two may wait on one floor where there are more than two."""
    return {"served": "holds", "again": "holds", "bound": "holds" if people <= 2 else "violated"}


def promela(people: int) -> str:
    """The same for SPIN, whose processes wait where ours look again."""
    called = " || ".join(f"ph[{i}] == CALLED" for i in range(people))
    anyone = " || ".join(f"waits[{f}] > 0" for f in range(FLOORS))
    return f"""#define FLOORS {FLOORS}
#define PEOPLE {people}
mtype = {{ OUT, CALLED, WAITING, ASKED }};
mtype ph[PEOPLE];
byte at[PEOPLE], dest[PEOPLE], queue[FLOORS * PEOPLE], waits[FLOORS], current, serving, who, going;

proctype person(byte me) {{
  byte other;
  do
  :: atomic {{ ph[me] == OUT -> ph[me] = CALLED }}
  :: atomic {{ ph[me] == WAITING ->
       select(other : 0 .. FLOORS - 2);
       dest[me] = (other < at[me] -> other : other + 1);
       other = 0;
       ph[me] = ASKED }}
  od
}}
proctype servis() {{
  byte i;
  do
  :: atomic {{ {called} ->
       i = 0;
       do :: ph[i] != CALLED -> i++ :: else -> break od;
       queue[at[i] * PEOPLE + waits[at[i]]] = i;
       waits[at[i]]++;
       ph[i] = WAITING;
       i = 0 }}
  od
}}
proctype lift() {{
  byte i;
  do
  :: do
     :: atomic {{ waits[serving] > 0 -> break }}
     :: atomic {{ waits[serving] == 0 && ({anyone}) -> serving = (serving + 1) % FLOORS }}
     od;
     do
     :: atomic {{ serving < current -> current-- }}
     :: atomic {{ serving > current -> current++ }}
     :: atomic {{ serving == current ->
          who = queue[current * PEOPLE];
          for (i : 0 .. PEOPLE - 2) {{ queue[current * PEOPLE + i] = queue[current * PEOPLE + i + 1] }}
          queue[current * PEOPLE + PEOPLE - 1] = 0;
          waits[current]--;
          i = 0;
          break }}
     od;
     atomic {{ ph[who] == ASKED -> going = dest[who] }}
     do
     :: atomic {{ going < current -> current-- }}
     :: atomic {{ going > current -> current++ }}
     :: atomic {{ going == current -> at[who] = current; ph[who] = OUT; going = 0; who = 0; break }}
     od
  od
}}
init {{
  atomic {{
    byte i;
    for (i : 0 .. PEOPLE - 1) {{ ph[i] = OUT; run person(i) }}
    run servis();
    run lift()
  }}
}}
ltl served {{ [] (ph[0] == CALLED -> <> (ph[0] == OUT)) }}
ltl again {{ [] <> (ph[0] == OUT) }}
ltl bound {{ [] (waits[0] <= 2) }}
"""


def smv(people: int) -> str:
    """The same for NuSMV."""
    floors, persons, top = range(FLOORS), range(people), FLOORS - 1
    turns = [*(f"person{i}" for i in persons), "servis", "lift"]
    lines = ["MODULE main", "VAR", f"  turn : {{{', '.join(turns)}}};", "  at : {CHOOSE, MOVE, PICK, TRANSPORT};"]
    lines += [*(f"  {name} : 0..{top};" for name in ("current", "serving", "going")), f"  who : 0..{people - 1};"]
    for i in persons:
        lines += [f"  ph{i} : {{OUT, CALLED, WAITING, ASKED}};", f"  at{i} : 0..{top};", f"  dest{i} : 0..{top};"]
    for f in floors:
        lines += [f"  waits{f} : 0..{people};", *(f"  queue{f}_{j} : 0..{people - 1};" for j in persons)]
    lines += ["DEFINE", "  anyone := " + " | ".join(f"waits{f} > 0" for f in floors) + ";"]
    lines += ["  here := " + _case(*(f"serving = {f} : waits{f} > 0" for f in floors))]
    lines += ["  asked := " + _case(*(f"who = {i} : ph{i} = ASKED" for i in persons))]
    lines += ["  wish := " + _case(*(f"who = {i} : dest{i}" for i in persons))]
    lines += ["  picks := turn = lift & at = MOVE & serving = current;"]
    lines += ["  arrives := turn = lift & at = TRANSPORT & going = current;"]
    lines += ["  down := turn = lift & (at = MOVE & serving < current | at = TRANSPORT & going < current);"]
    lines += ["  up := turn = lift & (at = MOVE & serving > current | at = TRANSPORT & going > current);"]
    for i in persons:
        first = "".join(f" & ph{k} != CALLED" for k in range(i))
        lines += [f"  queues{i} := turn = servis & ph{i} = CALLED{first};"]
    lines += ["  caller := " + _case(*(f"queues{i} : {i}" for i in persons), "TRUE : 0")]
    for f in floors:
        lines += [f"  called{f} := " + " | ".join(f"queues{i} & at{i} = {f}" for i in persons) + ";"]
        lines += [f"  left{f} := picks & current = {f};"]
    lines += ["ASSIGN"]
    for i in persons:
        mine = f"turn = person{i} & ph{i}"
        lines += _next(f"ph{i}", "OUT", f"{mine} = OUT : CALLED", f"{mine} = WAITING : ASKED", f"queues{i} : WAITING",
                       f"arrives & who = {i} : OUT")  # fmt: skip
        lines += _next(f"at{i}", "0", f"arrives & who = {i} : current")
        others = [f"{{{', '.join(str(g) for g in floors if g != f)}}}" for f in floors]
        lines += _next(f"dest{i}", "0", *(f"{mine} = WAITING & at{i} = {f} : {others[f]}" for f in floors))
    for f in floors:
        lines += _next(f"waits{f}", "0", f"called{f} & waits{f} < {people} : waits{f} + 1",
                       f"left{f} & waits{f} > 0 : waits{f} - 1")  # fmt: skip
        for j in persons:
            following = f"queue{f}_{j + 1}" if j + 1 < people else "0"
            lines += _next(f"queue{f}_{j}", "0", f"called{f} & waits{f} = {j} : caller", f"left{f} : {following}")
    lines += _next("current", "0", "down & current > 0 : current - 1", f"up & current < {top} : current + 1")
    lines += _next("serving", "0", f"turn = lift & at = CHOOSE & !here & anyone : (serving + 1) mod {FLOORS}")
    lines += _next("going", "0", "arrives : 0", "turn = lift & at = PICK & asked : wish")
    lines += _next("who", "0", "arrives : 0", *(f"left{f} : queue{f}_0" for f in floors))
    lines += _next("at", "CHOOSE", "turn = lift & at = CHOOSE & here : MOVE", "picks : PICK",
                   "turn = lift & at = PICK & asked : TRANSPORT", "arrives : CHOOSE")  # fmt: skip
    lines += [f"FAIRNESS turn = {who}" for who in turns]
    lines += ["LTLSPEC NAME served := G (ph0 = CALLED -> F ph0 = OUT);", "LTLSPEC NAME again := G F ph0 = OUT;"]
    return "\n".join([*lines, "INVARSPEC NAME bound := waits0 <= 2;", ""])


def _case(*branches: str) -> str:
    return f"case {'; '.join(branches)}; esac;"


def _next(name: str, first: str, *branches: str) -> list[str]:
    """A variable with what it is first and what it becomes; otherwise it stays."""
    return [f"  init({name}) := {first};", f"  next({name}) := {_case(*branches, f'TRUE : {name}')}"]
