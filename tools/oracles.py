"""Other people's programs that our tests compare us with: where they are, and how they get there (`make oracles`).

SPIN, SWI-Prolog, Mosquitto (a broker of MQTT), ROS 1, Fast DDS (what ROS 2 speaks), the compilers and emulators for
generated C, a browser and an editor come from Debian. NuSMV 2.5.4 is built from the source distribution of pynusmv on
PyPI, in a folder outside the project, so that every checkout on a machine finds it; beside it is what npm installs. The
others are Python packages of the extras `draw` and `test`.
"""

from __future__ import annotations

import argparse
import fcntl
import hashlib
import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

PROGRAMS = {
    "spin": ("spin",),
    "gcc": ("gcc",),
    "make": ("make",),
    "nusmv": ("NuSMV", "nusmv", "nuXmv"),
    "mosquitto": ("mosquitto",),
    "g++": ("g++",),
    "clang": ("clang", "clang-14"),
    "clang-rt": ("clang", "clang-14"),
    "wasm-ld": ("wasm-ld", "wasm-ld-14"),
    "node": ("node", "nodejs"),
    "avr-gcc": ("avr-gcc",),
    "simavr": ("simavr",),
    "arm-gcc": ("arm-linux-gnueabihf-gcc",),
    "aarch64-gcc": ("aarch64-linux-gnu-gcc",),
    "riscv64-gcc": ("riscv64-linux-gnu-gcc",),
    "qemu-arm": ("qemu-arm", "qemu-arm-static"),
    "qemu-aarch64": ("qemu-aarch64", "qemu-aarch64-static"),
    "qemu-riscv64": ("qemu-riscv64", "qemu-riscv64-static"),
    "cppcheck": ("cppcheck",),
    "fastdds": ("fastddsgen",),
    "chromium": ("chromium",),
    "chromedriver": ("chromedriver",),
    "nvim": ("nvim",),
    "swipl": ("swipl",),
}
"""Programs by the name of the oracle, the preferred one first."""
FILES = {
    "clang-rt": "usr/lib/llvm-*/lib/clang/*/lib/linux/libclang_rt.asan-*.a",
    "avr-gcc": "usr/lib/avr/include/avr/io.h",
    "simavr": "usr/include/simavr/sim_avr.h",
    "arm-gcc": "usr/arm-linux-gnueabihf/lib/libc.a",
    "aarch64-gcc": "usr/aarch64-linux-gnu/lib/libc.a",
    "riscv64-gcc": "usr/riscv64-linux-gnu/lib/libc.a",
    "fastdds": "usr/include/fastdds/dds/domain/DomainParticipant.hpp",
}
"""What a program is of no use without, as a pattern below `/`, where Debian puts it."""
SERVERS = "/usr/sbin"
"""Where Debian puts servers, which is not on the path of everybody."""
SYSTEM = "/usr/lib/python3/dist-packages"
"""Where Debian puts packages for its own Python."""
OF_SYSTEM = {"rospy": ("rospy", "rosmaster", "std_msgs", "actionlib", "geometry_msgs", "rosbag")}
"""Packages for that Python, by the name of the oracle."""
FROM_DEBIAN = {
    "spin": ("spin",),
    "gcc": ("gcc",),
    "make": ("make",),
    "mosquitto": ("mosquitto",),
    "rospy": (
        "python3-rospy",
        "python3-rosmaster",
        "python3-std-msgs",
        "python3-actionlib",
        "python3-geometry-msgs",
        "python3-rosbag",
    ),
    "g++": ("g++",),
    "clang": ("clang-14",),
    "clang-rt": ("clang-14", "libclang-rt-14-dev"),
    "wasm-ld": ("lld-14",),
    "node": ("nodejs",),
    "avr-gcc": ("gcc-avr", "avr-libc"),
    "simavr": ("simavr", "libsimavr-dev"),
    "arm-gcc": ("gcc-arm-linux-gnueabihf", "libc6-dev-armhf-cross"),
    "aarch64-gcc": ("gcc-aarch64-linux-gnu", "libc6-dev-arm64-cross"),
    "riscv64-gcc": ("gcc-riscv64-linux-gnu", "libc6-dev-riscv64-cross"),
    "qemu-arm": ("qemu-user",),
    "qemu-aarch64": ("qemu-user",),
    "qemu-riscv64": ("qemu-user",),
    "cppcheck": ("cppcheck",),
    "fastdds": ("fastddsgen", "libfastrtps-dev"),
    "chromium": ("chromium", "fonts-dejavu-core"),
    "chromedriver": ("chromium-driver",),
    "nvim": ("neovim",),
    "swipl": ("swi-prolog-nox",),
}
"""The packages of Debian that bring an oracle."""
FROM_NPM = {
    "eslint": ("eslint/bin/eslint.js", "eslint@9.39.1", "@eslint/js@9.39.1"),
    "textmate": (
        "@codingame/monaco-vscode-yaml-default-extension/resources/yaml.tmLanguage.json",
        "vscode-textmate@9.3.2",
        "vscode-oniguruma@2.0.1",
        "tm-grammars@1.32.22",  # the grammar of YAML that VS Code had until 1.92, and the one that it has
        "@codingame/monaco-vscode-yaml-default-extension@36.2.7",
    ),
}
"""What of an oracle has to be there, below `node_modules`, and the packages of npm that bring it."""
MODULES = {
    "automata-lib": "automata",
    "cobs": "cobs",
    "cvc5": "cvc5",
    "cyclonedds": "cyclonedds",
    "distributed": "distributed",
    "import-linter": "importlinter",
    "mkdocs-material": "material",
    "mkdocstrings": "mkdocstrings",
    "mypy": "mypy",
    "networkx": "networkx",
    "pandas": "pandas",
    "pyformlang": "pyformlang",
    "pygraphviz": "pygraphviz",
    "pytest-lsp": "pytest_lsp",
    "selenium": "selenium",
    "tiny-datalog": "tiny_datalog",
}
"""Modules by the name of the package that brings them."""
EXTRAS = {"mypy": "check", "mkdocs-material": "docs", "mkdocstrings": "docs", "pandas": "pandas"}
"""The extras of `pyproject.toml` that bring a module, where it is not `draw` or `test`: nothing else needs these."""
OF_OTHERS = ("cyclonedds", "pytest-lsp", "selenium", "tiny-datalog")
"""Modules that are not of the group `core`."""
GROUPS: dict[str, tuple[str, ...]] = {
    "core": ("spin", "gcc", "make", "nusmv", *(n for n in MODULES if n not in OF_OTHERS)),
    "targets": (
        "g++",
        "clang",
        "clang-rt",
        "wasm-ld",
        "node",
        "avr-gcc",
        "simavr",
        "arm-gcc",
        "aarch64-gcc",
        "riscv64-gcc",
        "qemu-arm",
        "qemu-aarch64",
        "qemu-riscv64",
        "cppcheck",
    ),
    "robots": ("mosquitto", "rospy", "fastdds", "cyclonedds"),
    "view": ("chromium", "chromedriver", "nvim", *FROM_NPM, "pytest-lsp", "selenium"),
    "knowledge": ("swipl", "tiny-datalog"),
}
"""Oracles that are got together, with one call of apt-get: those of each part of the package."""
NAMES = tuple(name for names in GROUPS.values() for name in names)

SDIST = "pynusmv==1.0rc8"
SHA256 = "35af7cdd25dfc8dc357770f0764b2cb726aed219200bba2e58c25318b2425aa1"
VERSION = "nusmv-2.5.4"
TOOLCHAIN = {"gcc": "gcc", "g++": "g++", "make": "make", "flex": "flex", "bison": "bison", "patch": "patch"}
"""What the build of NuSMV runs, with the package of Debian that brings it."""
MODEL = "MODULE main\nVAR x : 0..5;\nASSIGN init(x) := 0; next(x) := (x + 1) mod 3;\nLTLSPEC G F x = 2\n"


class Missing(Exception):
    """Why an oracle could not be had."""


def folder() -> Path:
    """Where we build: LLFSM_ORACLES, or a folder of the user's cache."""
    given = os.environ.get("LLFSM_ORACLES")
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(given) if given else Path(cache) / "llfsm-verify-oracles"


def find(name: str) -> str | None:
    """The program, folder or module of an oracle, one of NAMES; None: it is not there."""
    if name in OF_SYSTEM:
        folders = [Path(SYSTEM, package) for package in OF_SYSTEM[name]]
        return str(folders[0]) if all(folder.is_dir() for folder in folders) else None
    if name in MODULES:
        found = importlib.util.find_spec(MODULES[name])
        return None if found is None else str(found.origin)
    if name in FROM_NPM:
        file = folder() / name / "node_modules" / FROM_NPM[name][0]
        return str(file) if file.is_file() and find("node") is not None else None
    if name in FILES and not any(Path("/").glob(FILES[name])):
        return None
    places = f"{os.environ.get('PATH', os.defpath)}{os.pathsep}{SERVERS}"
    on_path = next(filter(None, (shutil.which(program, path=places) for program in PROGRAMS[name])), None)
    if on_path is None and name == "nusmv" and os.access(_built(), os.X_OK):
        return str(_built())
    return on_path


def _built() -> Path:
    return folder() / VERSION / "NuSMV"


# ---------------------------------------------------------------- getting them


def provide(group: str) -> dict[str, str]:
    """Install and build what is missing of a group; why it could not be, by name."""
    problems: dict[str, str] = {}
    missing = [name for name in GROUPS[group] if find(name) is None]
    wanted = [package for name in missing for package in FROM_DEBIAN.get(name, ())]
    if "nusmv" in missing:
        wanted += [package for program, package in TOOLCHAIN.items() if shutil.which(program) is None]
    if any(name in FROM_NPM for name in missing) and shutil.which("npm") is None:
        wanted += ["nodejs", "npm"]
    if wanted:
        try:
            _install(list(dict.fromkeys(wanted)))
        except Missing as reason:
            problems = {name: str(reason) for name in missing if name in FROM_DEBIAN}
    if "nusmv" in missing:
        try:
            _build()
        except Missing as reason:
            problems["nusmv"] = str(reason)
    for name in missing:
        if name in FROM_NPM:
            try:
                _install_from_npm(name)
            except Missing as reason:
                problems[name] = str(reason)
        if name in MODULES:
            extra = EXTRAS.get(name, "draw,test")
            problems[name] = f"not installed; `python -m pip install -e '.[{extra}]'` does that"
    return {name: reason for name, reason in problems.items() if find(name) is None}


def _install(packages: Sequence[str]) -> None:
    by_hand = f"install with Debian's tools: apt-get install {' '.join(packages)}"
    if shutil.which("apt-get") is None:
        raise Missing(f"there is no apt-get here; {by_hand}")
    if os.geteuid() != 0:
        raise Missing(f"only root can {by_hand}")
    print(f"installing {', '.join(packages)} …", flush=True)
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    install = ["apt-get", "install", "--yes", "--no-install-recommends", *packages]
    for command in (install, ["apt-get", "update"], install):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        if command is install and done.returncode == 0:
            return
    raise Missing(f"{' '.join(install)} failed: {_last(done.stdout + done.stderr)}")


def _install_from_npm(name: str) -> None:
    _, *packages = FROM_NPM[name]
    if shutil.which("npm") is None:
        raise Missing(f"there is no npm here, which installs {' '.join(packages)}")
    print(f"installing {', '.join(packages)} …", flush=True)
    place = folder() / name
    try:
        place.mkdir(parents=True, exist_ok=True)
        (place / "package.json").write_text("{}\n")  # else npm looks for one in the folders above
    except OSError as error:
        raise Missing(f"{place} cannot be written: {error.strerror}") from error
    command = ["npm", "install", "--no-audit", "--no-fund", "--ignore-scripts", "--prefix", str(place), *packages]
    done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise Missing(f"npm install {' '.join(packages)} failed: {_last(done.stdout + done.stderr)}")


def _last(output: str) -> str:
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    return lines[-1] if lines else "without a word"


def _build() -> None:
    lacking = [program for program in TOOLCHAIN if shutil.which(program) is None]
    if lacking:
        raise Missing(f"building it takes {', '.join(lacking)}")
    try:
        folder().mkdir(parents=True, exist_ok=True)
        with _alone(), tempfile.TemporaryDirectory(prefix="building-", dir=folder()) as name:
            if find("nusmv") is not None:  # another call has built it meanwhile
                return
            _build_in(Path(name))
    except OSError as error:
        raise Missing(f"{folder()} cannot be written: {error.strerror}") from error


@contextmanager
def _alone() -> Iterator[None]:
    with open(folder() / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _build_in(place: Path) -> None:
    print(f"building NuSMV 2.5.4 in {folder()}, which takes some minutes …", flush=True)
    log = folder() / "nusmv.log"
    log.unlink(missing_ok=True)

    def run(where: Path, *command: str, stdin: Path | None = None) -> None:
        with open(log, "a") as said, open(stdin or os.devnull) as given:
            print("$", *command, file=said, flush=True)
            done = subprocess.run(command, cwd=where, stdin=given, stdout=said, stderr=said, check=False)
        if done.returncode != 0:
            raise Missing(f"`{' '.join(command[:6])}` failed: {log} has what it printed")

    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "--no-deps", "--no-build-isolation"]
    run(place, *pip, "--no-binary", ":all:", SDIST)
    (archive,) = place.glob("pynusmv-*.tar.gz")
    if hashlib.sha256(archive.read_bytes()).hexdigest() != SHA256:
        raise Missing(f"the source distribution of {SDIST} is not the one that we know")
    run(place, "tar", "-xzf", archive.name)
    sources = next(place.glob("pynusmv-*/dependencies"))

    with zipfile.ZipFile(next((sources / "MiniSat").glob("minisat2-*.zip"))) as zipped:
        zipped.extractall(sources / "MiniSat")
    for name in ("nusmv.patch", "pynusmv.patch", "makefiles.patch"):
        run(sources / "MiniSat", "patch", "-p0", "-N", stdin=sources / "MiniSat" / name)
    minisat = sources / "MiniSat" / "minisat"
    run(minisat, "make", "CXX=g++ -std=gnu++98")

    run(sources / "NuSMV", "tar", "-xzf", "NuSMV-2.5.4.tar.gz")
    fork = next((sources / "NuSMV").glob("NuSMV-2.5.4/cudd-*/util/pipefork.c"))
    fork.write_bytes(fork.read_bytes().replace(b"union wait status", b"int status"))
    nusmv = sources / "NuSMV" / "NuSMV-2.5.4" / "nusmv"
    flags = ("CFLAGS=-O2 -w -fcommon -std=gnu89", "CXXFLAGS=-O2 -w -std=gnu++98")
    solver = (f"--with-minisat-libdir={minisat}", f"--with-minisat-incdir={minisat}")
    run(nusmv, "./configure", "--enable-minisat", *solver, "--disable-readline", "--disable-expat", *flags)
    run(nusmv, "make", f"-j{os.cpu_count() or 1}")

    (place / "model.smv").write_text(MODEL)
    done = subprocess.run([nusmv / "NuSMV", "-r", "model.smv"], cwd=place, capture_output=True, text=True, check=False)
    if "reachable states: 3 " not in done.stdout or "is true" not in done.stdout:
        raise Missing(f"NuSMV was built, but does not answer: {_last(done.stdout + done.stderr)}")
    _built().parent.mkdir(exist_ok=True)
    (nusmv / "NuSMV").replace(_built())


# ---------------------------------------------------------------- saying so


def _about(name: str, found: str) -> str:
    if name in MODULES:
        return importlib.metadata.version(name)
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m tools.oracles", description="Install and build what is missing.")
    parser.add_argument("--group", choices=GROUPS, help="only these oracles (default: all)")
    parser.add_argument("--names", action="store_true", help="only print what is there, for LLFSM_REQUIRE_ORACLES")
    given = parser.parse_args(arguments)
    groups = [given.group] if given.group else list(GROUPS)
    if not given.names:
        for group in groups:
            _get(group)
    there = [name for group in groups for name in GROUPS[group] if find(name) is not None]
    if given.names:
        print(",".join(there))
    elif there:
        print(f"Tests fail where one of these would be skipped, with LLFSM_REQUIRE_ORACLES={','.join(there)}")


def _get(group: str) -> None:
    problems = provide(group)
    print(f"{group}:" if GROUPS[group] else f"{group}: no oracle is in this group yet")
    for name in GROUPS[group]:
        found = find(name)
        print(f"  {name:14}", f"missing: {problems.get(name, 'not found')}" if found is None else _about(name, found))
    print()


if __name__ == "__main__":
    main()
