"""Parsers by lark: their tables are computed once per installation, since loading them takes a twentieth of that."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib import resources
from io import BytesIO

import lark
from lark import Lark

from llfsm_verify.kept import cache_folder, fingerprint, keep, kept

GRAMMAR = "grammar.lark"


def parser_of(package: str, sources: Sequence[str], make: Callable[[str], Lark]) -> Lark:
    """The parser that `make` makes of the grammar of a package, or the same from the folder for kept files.

    `sources` are the files of that package which have `make` and the transformer that `make` gives to the parser: the
    transformer is kept too.
    """
    folder = resources.files(package)
    grammar = folder.joinpath(GRAMMAR).read_text("utf-8")
    texts = [folder.joinpath(name).read_bytes() for name in sources]
    name = f"grammar-{fingerprint(package, grammar, *texts, lark.__version__, sys.version)}.tables"
    cache = cache_folder()
    path = None if cache is None else cache / name
    tables = kept(path)
    if tables is not None:
        return Lark.load(BytesIO(tables))
    parser = make(grammar)
    saved = BytesIO()
    parser.save(saved)
    keep(path, saved.getvalue())  # where that fails, they are computed in each run
    return parser
