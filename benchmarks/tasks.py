"""What is measured: arrangements with what is asked of them, the same in Promela, and the answers that must come."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks.ring import ring
from benchmarks.sensors import properties, sensors

HERE = Path(__file__).parent

RING_STATES = {4: 17_826, 5: 174_971, 6: 1_649_017, 7: 15_110_015}
"""Configurations of ring(N, 3), all bits kept: machines start unentered."""
SPIN_RING_STATES = {4: 17_820, 5: 174_960, 6: 1_648_998, 7: 15_109_983}
"""In peers/ring.pml they start entered."""
RING_DEPTH = {4: 14_000, 5: 140_000, 6: 1_350_000, 7: 12_500_000}
"""Just enough steps on SPIN's stack, which takes memory and the time to clear it. Its products need twice as many."""
RING_TABLE = {4: 15, 5: 19, 6: 22, 7: 25}
"""SPIN's hash table: binary logarithm of the slots, one to two for each state."""

SEARCHED = ("--engine", "explicit", "--keep-all-bits", "--cone", "off", "--compression", "off", "--jobs", "1")
"""Every configuration is visited and counted, on one core: nothing is proved instead, and nothing is left out."""
AS_USERS_RUN_IT: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Peer:
    """The same question for SPIN."""

    model: Path
    defines: tuple[str, ...]
    states: int | None
    """States that it stores; with claims none are expected, since it stores those of products."""
    claims: tuple[str, ...]
    """Names of its claims in the order of the task's properties; without any it looks at all states."""
    depth: int
    table: int


@dataclass(frozen=True, slots=True)
class Task:
    """One row of the table for each tool that can do it."""

    name: str
    question: str
    arrangement: Path | str
    """A file, or the text of one."""
    properties: str
    """Text of a property file."""
    options: tuple[str, ...]
    """SEARCHED or AS_USERS_RUN_IT."""
    states: int | None
    """Configurations; None: as many as an engine happens to look at."""
    verdicts: Mapping[str, str]
    peer: Peer | None = None
    naive: tuple[str, ...] = ()
    """Arguments of benchmarks.naive, which then must find the same number of states."""
    once: bool = False
    """SPIN runs once only, unless all repetitions are asked for: it takes long."""
    front: bool = False
    """It is a row of the table in docs/benchmarks.md."""
    shared: bool = False
    """It is also searched by two threads."""

    @property
    def key(self) -> str:
        return f"{self.name}: {self.question}"


def tasks(sizes: range, root: Path) -> list[Task]:
    """All rows: rings of these sizes, the small models, and the traffic lights below `root`, the repository."""
    return [
        *(task for n in sizes for task in _ring(n)),
        *_small("microwave", 5_092, 27_841, {"s1": "holds", "p1": "holds", "p2": "violated", "p3": "violated"}),
        *_small("traffic", 135, 251, {"s1": "holds", "l1": "holds", "l2": "violated"}),
        _lights(root),
        _sensors(8),
    ]


def _ring(n: int) -> list[Task]:
    text, name = ring(n, 3), f"ring({n},3)"
    model = HERE / "peers" / "ring.pml"
    size = f"-DN={n}"
    depth, table, once = RING_DEPTH[n], RING_TABLE[n], n >= 7
    apart = f"apart: G (m0@ON -> F (!m0@ON || !m{n - 1}@ON))\n"
    not_three = "not_three: G !(m0@ON && m1@ON && m2@ON)\n"
    never_off = "never_off: G (m0@OFF -> F !m0@OFF)\n"

    def ltl(question: str, properties: str, **verdicts: str) -> Task:
        peer = Peer(model, (size, "-DLTL"), None, tuple(verdicts), 2 * depth, table)
        return Task(
            name,
            question,
            text,
            properties,
            SEARCHED,
            RING_STATES[n],
            verdicts,
            peer,
            once=once,
            front=len(verdicts) == 1 and n >= 6,
            shared=once,
        )

    return [
        Task(
            name, "all states", text, "", SEARCHED, RING_STATES[n], {},
            Peer(model, (size,), SPIN_RING_STATES[n], (), depth, table),
            ("ring", str(n), "3") if n <= 5 else (), once, front=True, shared=once,
        ),
        *([ltl("an invariant", not_three, not_three="holds")] if n >= 6 else []),
        ltl("true property", apart, apart="holds"),
        # The largest once is enough: the false one adds next to nothing.
        *([] if once else [ltl("both properties", apart + never_off, apart="holds", never_off="violated")]),
        Task(name, "both properties, as users run it", text, apart + never_off, AS_USERS_RUN_IT, None,
             {"apart": "holds", "never_off": "violated"}, front=n >= 7),
    ]  # fmt: skip


def _small(name: str, states: int, spin_states: int, verdicts: dict[str, str]) -> list[Task]:
    arrangement = HERE / "models" / f"{name}.yaml"
    properties = arrangement.with_suffix(".ltl").read_text(encoding="utf-8")
    model = HERE / "peers" / f"{name}.pml"
    every = ("-DS1", "-DL1", "-DL2", "-DL3")
    return [
        Task(
            name, "all states", arrangement, "", SEARCHED, states, {},
            Peer(model, (), spin_states, (), 200_000, 18), (name,),
        ),
        Task(
            name, f"{len(verdicts)} properties", arrangement, properties, AS_USERS_RUN_IT, None, verdicts,
            Peer(model, every, None, tuple(verdicts), 200_000, 18), front=True,
        ),
    ]  # fmt: skip


def _sensors(n: int) -> Task:
    verdicts = {"low": "holds", "high": "holds", "never_all": "violated"}
    return Task(
        f"{n} sensors of 16 bits",
        "3 properties",
        sensors(n),
        properties(n),
        AS_USERS_RUN_IT,
        None,
        verdicts,
        front=True,
    )


def _lights(root: Path) -> Task:
    properties = (root / "properties/traffic_lights.ltl").read_text(encoding="utf-8")
    names = [line.partition(":")[0] for line in properties.splitlines() if line and line[0] not in "# " and ":" in line]
    verdicts = {name: "holds" for name in names if not name.startswith("assume ")}
    arrangement = root / "models/traffic_lights/arrangement.yaml"
    return Task(
        "traffic lights of the tour", f"{len(verdicts)} properties", arrangement, properties, AS_USERS_RUN_IT, None,
        verdicts, front=True,
    )  # fmt: skip
