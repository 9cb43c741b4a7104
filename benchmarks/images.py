"""Nanoseconds a ringlet of images in C beside the executor: ``python -m benchmarks.images``.

Both perform the same ringlets, with inputs that are held, in turns; figures are medians of processor time. Their last
records are compared. clfsm's slides have 64 to 69 ns for a ringlet of its ping-pong machine.
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from shutil import which
from statistics import median

from benchmarks.pingpong import text_of
from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.extensions.c.image import Image
from llfsm_verify.extensions.c.target import C99, image_for
from llfsm_verify.runtime.live.frame import COUNTED
from llfsm_verify.runtime.live.plan import starting_values
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.target import Wanted

MODELS = Path(__file__).parents[1] / "models"
HELD: Mapping[str, Mapping[str, int]] = {
    "microwave": {"button": 1}, "lift": {"call[2]": 1}, "traffic_lights": {"car": 1}, "level_crossing": {"train": 1},
    "press": {"left": 1, "right": 1},
}  # fmt: skip
"""Inputs by model; others stay as they are at first."""
DRIVER = """\
#include "NAME_loop.c"
static int64_t spent(void)
{
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (int64_t)time.tv_sec * INT64_C(1000000000) + (int64_t)time.tv_nsec;
}
int64_t perform(uint64_t ringlets, uint64_t *words);
int64_t perform(uint64_t ringlets, uint64_t *words)
{
    NAME_state state;
    NAME_inputs inputs;
    int64_t begin;
    NAME_init(&state);
    NAME_first(&inputs);
HELD    begin = spent();
    for (; ringlets > 0; ringlets--) {
        if (NAME_step(&state, &inputs) != NAME_OK) {
            return -1;
        }
    }
    begin = spent() - begin;
    put_record(&state, words);
    return begin;
}
"""


class Built:
    """An image in a shared library. CalledProcessError: it does not compile."""

    def __init__(self, arrangement: Arrangement, held: Mapping[str, int], flags: str) -> None:
        self.image: Image = image_for(arrangement, COUNTED)
        p, names = self.image.prefix, self.image.names.inputs
        given = "".join(f"    inputs.{names[name]} = {value};\n" for name, value in held.items())
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for file, text in C99.make(arrangement, Wanted("posix")).files.items():
                (folder / file).write_text(text)
            (folder / "driver.c").write_text(DRIVER.replace("NAME", p).replace("HELD", given))
            command = ["gcc", "-std=c99", *flags.split(), "-fPIC", "-shared", f"{p}.c", "driver.c", "-o", "driver.so"]
            subprocess.run(command, cwd=folder, check=True)
            self._perform = ctypes.CDLL(str(folder / "driver.so")).perform
        self._perform.restype = ctypes.c_int64
        self._perform.argtypes = [ctypes.c_uint64, ctypes.c_void_p]

    def perform(self, ringlets: int, size: int) -> tuple[float, bytes]:
        """Nanoseconds a ringlet, and the last record."""
        words = (ctypes.c_uint64 * (size // 8))()
        spent = self._perform(ringlets, words)
        if spent < 0:
            raise SystemExit(f"{self.image.program.name}: a ringlet of the image failed")
        return spent / ringlets, bytes(words)


def subjects() -> Iterator[tuple[str, Arrangement, Mapping[str, int]]]:
    """What is measured: a name, the arrangement and the inputs."""
    for machines in (1, 4, 16):
        arrangement = load_arrangement_text(f"cycle_ms: 1\n{text_of(machines)}")
        yield f"ping-pong, {machines}", image_of(arrangement), {}
    for name, held in HELD.items():
        yield name, image_of(load_arrangement(str(MODELS / name / "arrangement.yaml"))), held


def measure(arrangement: Arrangement, held: Mapping[str, int], ringlets: int, repeat: int, off: int = 0) -> list[float]:
    """Median nanoseconds of the executor, of C at -O2 and of C at -Os, which takes `off` ringlets less (for tests)."""
    images = [Built(arrangement, held, flags) for flags in ("-O2", "-Os")]
    program = images[0].image.program
    native = NativeProgram(program, events=(), effort="full")
    native.compile()
    choices = {c.name: c.type.low for c in program.choices} | starting_values(program) | held
    first, size = native.layout.first(), native.layout.record_bytes
    times: list[list[float]] = [[], [], []]
    for _ in range(repeat):
        begin = time.process_time()
        ran = native.run(first, ringlets, choices=choices)
        times[0].append((time.process_time() - begin) / ringlets * 1e9)
        if ran.steps != ringlets:
            raise SystemExit(f"{program.name}: the executor ended after {ran.steps} ringlets")
        for image, found in zip(images, times[1:], strict=True):
            spent, record = image.perform(ringlets - off, size)
            found.append(spent)
            if record != ran.record:
                raise SystemExit(f"{program.name}: the image and the executor come to different records")
    return [median(found) for found in times]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--ringlets", type=int, default=2_000_000, help="ringlets of each run")
    parser.add_argument("--repeat", type=int, default=7, help="runs of which the median is shown")
    options = parser.parse_args()
    if which("gcc") is None:
        sys.exit("gcc is not installed")

    print(f"{'ns a ringlet':16}  executor  C, gcc -O2  C, gcc -Os")
    for name, arrangement, held in subjects():
        native, quick, small = measure(arrangement, held, options.ringlets, options.repeat)
        print(f"{name:16}  {native:8.1f}  {quick:10.1f}  {small:10.1f}", flush=True)


if __name__ == "__main__":
    main()
