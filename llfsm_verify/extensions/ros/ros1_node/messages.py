"""Types of messages, services and actions: those installed, and those of `.msg`, `.srv` and `.action` files."""

from __future__ import annotations

import difflib
import importlib
import re
import sys
import types
from pathlib import Path
from typing import Any, Dict, Iterable, List, Optional, Sequence, Set

import genmsg
import genmsg.msg_loader as loader
from genpy.generator import msg_generator, srv_generator

from . import debian

RULE = "\n" + "=" * 80 + "\n"
"""Between a definition and those that it uses, in the full text of a class."""
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*\Z")
ACTION = {
    "Goal": None, "Result": None, "Feedback": None,
    "ActionGoal": "Header header\nactionlib_msgs/GoalID goal_id\n{0}Goal goal\n",
    "ActionResult": "Header header\nactionlib_msgs/GoalStatus status\n{0}Result result\n",
    "ActionFeedback": "Header header\nactionlib_msgs/GoalStatus status\n{0}Feedback feedback\n",
    "Action": "{0}ActionGoal action_goal\n{0}ActionResult action_result\n{0}ActionFeedback action_feedback\n",
}  # fmt: skip
"""The messages of an action by their endings, as actionlib makes them; None: a part of its file."""
PARTS = re.compile(r"^---[ \t\r]*$", re.MULTILINE)


class NoType(Exception):
    """There is no such type; the message says why, the hint what to do."""

    def __init__(self, why: str, hint: str) -> None:
        super().__init__(why)
        self.hint = hint


class Types:
    """Finds types in folders of packages (`PACKAGE/msg/TYPE.msg`), and then in what is installed.

    Classes of files are generated in memory, and stand in `sys.modules` as if their package were installed.
    """

    def __init__(self, folders: Iterable[str]) -> None:
        self._folders = [Path(folder) for folder in folders]
        self._context = genmsg.MsgContext.create_default()
        self._known: Set[str] = set()
        self._making: List[str] = []

    def message(self, name: str) -> Any:
        """The class of a message. Raises NoType."""
        return self._find(name, "msg")

    def service(self, name: str) -> Any:
        """The class of a service, which has `_request_class` and `_response_class`. Raises NoType."""
        return self._find(name, "srv")

    def action(self, name: str) -> Any:
        """The class of an action, which actionlib takes. Raises NoType."""
        return self._find(name, "action")

    def _find(self, name: str, kind: str) -> Any:
        if not NAME.match(name):
            raise NoType(f"`{name}` is not the name of a type", "write PACKAGE/TYPE, such as std_msgs/Float64")
        package, base = name.split("/")
        path = self._file(package, kind, base)
        made = base + "Action" if kind == "action" else base
        module = "srv" if kind == "srv" else "msg"
        if path is None:
            return self._installed(package, module, made, kind)
        if f"{kind} {name}" not in self._known:
            self._make(name, kind, path)
            self._known.add(f"{kind} {name}")
        return getattr(sys.modules[f"{package}.{module}"], made)

    def _file(self, package: str, kind: str, base: str) -> Optional[Path]:
        places = (folder / package / kind / f"{base}.{kind}" for folder in self._folders)
        return next((place for place in places if place.is_file()), None)

    def _installed(self, package: str, module: str, base: str, kind: str) -> Any:
        try:
            found = importlib.import_module(f"{package}.{module}")
        except ModuleNotFoundError as error:
            if error.name not in (package, f"{package}.{module}"):
                raise NoType(f"package {package} cannot be imported: {error}", "install what it needs") from None
            if any((folder / package).is_dir() for folder in self._folders):
                raise self._absent(package, kind, base, ()) from None
            file = f"{package}/{kind}/{base[: -len('Action')] if kind == 'action' else base}.{kind}"
            install = f"install it{debian.named(package, 'python3')}"
            hint = f"{install}, source its workspace, or name the folder that has {file} under `messages`"
            raise NoType(f"there is no package `{package}` with {_WORDS[kind]}", hint) from None
        except Exception as error:  # noqa: BLE001 - whatever it raises
            why = f"package {package} cannot be imported: {type(error).__name__}: {error}"
            raise NoType(why, "install what it needs") from None
        if not hasattr(getattr(found, base, None), "_type"):
            raise self._absent(package, kind, base, [n for n in dir(found) if hasattr(getattr(found, n), "_type")])
        return getattr(found, base)

    def _absent(self, package: str, kind: str, base: str, installed: Sequence[str]) -> NoType:
        files = (path for folder in self._folders for path in (folder / package / kind).glob(f"*.{kind}"))
        names = {path.stem for path in files}
        if kind == "action":
            base = base[: -len("Action")]
            names |= {n[: -len("Action")] for n in installed if n.endswith("Action") and f"{n}Goal" in installed}
        else:
            parts = ("Request", "Response") if kind == "srv" else ()
            names |= {
                n for n in installed if not any(n.endswith(part) and n[: -len(part)] in installed for part in parts)
            }
        near = difflib.get_close_matches(base, names, 1)
        hint = f"did you mean `{package}/{near[0]}`?" if near else f"it has {listed(sorted(names))}"
        return NoType(f"package {package} has no {_WORDS[kind][:-1]} `{base}`", hint)

    def _make(self, name: str, kind: str, path: Path) -> None:
        package, base = name.split("/")
        self._making.append(name)
        try:
            text = path.read_text(encoding="utf-8")
            if kind == "action":
                parts = PARTS.split(text)
                if len(parts) != 3:
                    raise genmsg.InvalidMsgSpec("an action has goal, result and feedback, with `---` between them")
                given = dict(zip(("Goal", "Result", "Feedback"), parts))
                for ending, template in ACTION.items():
                    written = given[ending] if template is None else template.format(base)
                    self._generate(f"{package}/{base}{ending}", written)
            elif kind == "srv":
                self._generate_service(name, text)
            else:
                self._generate(name, text)
        except (OSError, UnicodeDecodeError, genmsg.InvalidMsgSpec, genmsg.MsgGenerationException) as error:
            raise NoType(f"{path} cannot be read: {error}", "correct the file") from None
        except NoType as problem:
            raise NoType(f"{path} cannot be read: {problem}", problem.hint) from None
        finally:
            self._making.pop()

    def _generate(self, name: str, text: str) -> None:
        spec = loader.load_msg_from_string(self._context, text, name)
        self._need(spec.types)
        self._execute(name, "msg", msg_generator(self._context, spec, {}))

    def _generate_service(self, name: str, text: str) -> None:
        spec = loader.load_srv_from_string(self._context, text, name)
        self._need([*spec.request.types, *spec.response.types])
        self._execute(name, "srv", srv_generator(self._context, spec, {}))

    def _need(self, wanted: Iterable[str]) -> None:
        """Make known to the generator what a definition uses."""
        for name in {genmsg.msgs.bare_msg_type(one) for one in wanted}:
            if genmsg.msgs.is_builtin(name):
                continue
            if name in self._making:
                raise NoType(f"{name} contains itself", "a message cannot contain itself")
            found = self.message(name)
            if not self._context.is_registered(name):
                spec = loader.load_msg_from_string(self._context, found._full_text.split(RULE)[0], name)
                self._need(spec.types)

    def _execute(self, name: str, kind: str, lines: Iterable[str]) -> None:
        package, base = name.split("/")
        outer = _module(f"{package}.{kind}")
        made = types.ModuleType(f"{package}.{kind}._{base}")
        exec("\n".join(lines), made.__dict__)  # noqa: S102 - genpy has generated it
        for word, value in list(vars(made).items()):
            if hasattr(value, "_type"):
                value.__module__ = made.__name__
                setattr(outer, word, value)


_WORDS = {"msg": "messages", "srv": "services", "action": "actions"}


def _module(name: str) -> types.ModuleType:
    """A module that is installed, or a new one that takes its place."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        made = types.ModuleType(name)
        made.__path__ = []
        sys.modules[name] = made
        package, _, last = name.rpartition(".")
        if package:
            setattr(_module(package), last, made)
        return made


def listed(names: Sequence[str], most: int = 12) -> str:
    """Names in words."""
    if not names:
        return "none"
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def class_of(name: str) -> Any:
    """The class of a message that another one uses."""
    package, base = name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), base)


def fields_of(message: Any) -> Dict[str, str]:
    """The fields of a class of messages, with their types."""
    return dict(zip(message.__slots__, message._slot_types))
