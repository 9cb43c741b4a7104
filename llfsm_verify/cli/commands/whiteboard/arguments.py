"""The arguments of `llfsm whiteboard`."""

from __future__ import annotations

from llfsm_verify.cli.arguments import positive, property_lines, repeatable
from llfsm_verify.cli.parser import Parser


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm whiteboard`."""
    codes = (
        "exit codes: 0 done, 2 wrong usage, 3 there is no such whiteboard or slot, or a value is refused; "
        "for properties: 1 one is violated, 4 one is undecided, or --every was not kept"
    )
    parser.about(
        "Read and post on the whiteboards of arrangements that run on this machine.", "llfsm whiteboard list", codes
    )
    asked = parser.add_subparsers(dest="asked", required=True, metavar="list|get|post|watch")
    examples = {
        "list": "llfsm whiteboard list",
        "get": "llfsm whiteboard get crossing ns_light",
        "post": "llfsm whiteboard post crossing car=true",
        "watch": "llfsm whiteboard watch crossing --monitor properties.ltl --arrangement arrangement.yaml",
    }
    texts = {
        "list": "list the whiteboards",
        "get": "print the newest values",
        "post": "give values to inputs",
        "watch": "print each change, or decide properties on the frames, until the run ends or Ctrl-C",
    }
    made = {name: asked.add_parser(name, help=text) for name, text in texts.items()}
    for name, one in made.items():
        one.about(f"{texts[name][0].upper()}{texts[name][1:]}.", examples[name], codes)
    get, post, watch = made["get"], made["post"], made["watch"]
    for one in (get, post, watch):
        one.add_argument("name", metavar="NAME", help="the whiteboard, as `llfsm run --whiteboard` names it")
    for one in (get, watch):
        one.add_argument("slots", metavar="SLOT", nargs="*", help="only these; default: all")
    watch.add_argument("--monitor", metavar="FILE", action="append", default=[], help="decide these properties")
    property_lines(watch, "decide this one")
    watch.add_argument("--arrangement", metavar="FILE", help="the arrangement that runs there; properties need it")
    repeatable(
        watch,
        "--command",
        metavar="COMMAND",
        dest="commands",
        text="give this command, such as 'suspend MACHINE' or 'write SLOT VALUE', when one is violated",
    )
    repeatable(
        watch, "--post", metavar="INPUT=VALUE", dest="posts", text="give an input this value when one is violated"
    )
    watch.add_argument(
        "--every",
        metavar="N",
        type=positive,
        help="say how late commands can be if each frame is looked at within N cycles, and whether that was so",
    )
    post.add_argument("values", metavar="INPUT=VALUE", nargs="+", help="what the input is from now on")
