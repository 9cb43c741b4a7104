"""A hook of MkDocs: files of the repository that pages lead to are pages of the site, and property files have colours.

The pages of `docs/` lead to the README, to models and to other files beside them, which a code host shows. The site
has them below `repository/`: Markdown as it is, other text as a block, a folder as a list of its files.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from mkdocs.structure.files import File, Files
from pygments.lexer import RegexLexer, words
from pygments.lexers import LEXERS
from pygments.token import Comment, Keyword, Name, Number, Operator, Punctuation, String, Text

from llfsm_verify.logic.parsing.tokens import KEYWORDS

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.pages import Page

__all__ = ["PropertyLexer"]

LINK = re.compile(r"\]\((?!https?:|mailto:|#)([^)#]+)")
LANGUAGES = {".yaml": "yaml", ".yml": "yaml", ".ltl": "ltl", ".py": "python", ".json": "json", ".toml": "toml"}
PREFIX = "repository/"
FENCE = "`" * 8


class PropertyLexer(RegexLexer):
    """Property files; only for colours."""

    name = "Properties of llfsm-verify"
    aliases = ("ltl",)
    filenames = ("*.ltl",)
    tokens: ClassVar = {
        "root": [
            (r"\s+", Text),
            (r"#.*", Comment.Single),
            (r"(?:assume|define|forbid(?: initially)?|enforce|automaton(?: never)?|for)\b(?=.*:)", Keyword.Declaration),
            (r"(?<!@)[\w-]+(?=:(?!=))", Name.Label),
            (words(tuple(KEYWORDS), prefix=r"(?<![@.])\b", suffix=r"\b"), Keyword),
            (r"\d[\d.]*(?:ms|s|min|h)?", Number),
            (r'"[^"\n]*"', String),
            (r"@\w+", Name.Constant),
            (r"\w+", Name),
            (r"[-<>=!&|+*/%?^]+", Operator),
            (r".", Punctuation),
        ]
    }


LEXERS["PropertyLexer"] = (__name__, PropertyLexer.name, PropertyLexer.aliases, PropertyLexer.filenames, ())


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds what pages lead to, and what those lead to in turn."""
    root = Path(config.config_file_path).parent
    waiting = [(f"docs/{file.src_uri}", file.content_string) for file in files.documentation_pages()]
    while waiting:
        page, text = waiting.pop()
        for target in (_join(page, link) for link in LINK.findall(text)):
            uri = _uri(root, target)
            if uri.startswith(PREFIX) and uri not in files.src_uris:
                content = _text(root, target)
                files.append(File.generated(config, uri, content=content))
                if not (root / target).is_file() or target.endswith(".md"):
                    waiting.append((uri.removeprefix(PREFIX), content))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """The links as they are between pages of the site; what none leads to stays, so that MkDocs reports it."""
    here = page.file.src_uri
    source = here.removeprefix(PREFIX) if here.startswith(PREFIX) else f"docs/{here}"
    root = Path(config.config_file_path).parent

    def moved(link: re.Match[str]) -> str:
        target = _join(source, link[1])
        uri = _uri(root, target)
        return f"]({posixpath.relpath(uri, posixpath.dirname(here) or '.')}" if uri in files.src_uris else link[0]

    return LINK.sub(moved, markdown)


def _join(page: str, link: str) -> str:
    """The path that a link of a page means, from the root of the repository."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(page), link))


def _uri(root: Path, target: str) -> str:
    """Where the site has a file of the repository."""
    if target.startswith("docs/"):
        return target.removeprefix("docs/")
    path = root / target
    if target.startswith("..") or not path.exists():
        return target
    return PREFIX + (target if target.endswith(".md") else f"{target}/README.md" if path.is_dir() else f"{target}.md")


def _text(root: Path, target: str) -> str:
    """The Markdown of a file of the repository."""
    path = root / target
    if target.endswith(".md"):
        return path.read_text(encoding="utf-8")
    head = f"---\ntitle: {target}\nsearch: {{exclude: true}}\n---\n\n# `{target}`\n\n"
    if path.is_dir():
        return head + "".join(f"- [`{file.name}`]({file.name})\n" for file in sorted(path.iterdir()) if file.is_file())
    return f"{head}{FENCE}{LANGUAGES.get(path.suffix, 'text')}\n{path.read_text(encoding='utf-8')}{FENCE}\n"
