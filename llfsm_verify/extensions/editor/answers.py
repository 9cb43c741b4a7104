"""What the server knows in the shapes of the protocol."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from lsprotocol import types

from llfsm_verify.extensions.editor.findings import Findings, Said
from llfsm_verify.extensions.editor.fixes import Fix
from llfsm_verify.extensions.editor.looking import Offer
from llfsm_verify.extensions.editor.names import Name
from llfsm_verify.extensions.editor.positions import Lines, moved
from llfsm_verify.extensions.editor.state import Verdict

SOURCE = "llfsm"
_SEVERITIES = {
    "error": types.DiagnosticSeverity.Error,
    "warning": types.DiagnosticSeverity.Warning,
    "information": types.DiagnosticSeverity.Information,
}
_OFFERED = {
    "key": types.CompletionItemKind.Property,
    "word": types.CompletionItemKind.Keyword,
    "operator": types.CompletionItemKind.Operator,
    "function": types.CompletionItemKind.Function,
    "file": types.CompletionItemKind.File,
    "type": types.CompletionItemKind.Class,
    "value": types.CompletionItemKind.EnumMember,
    "state": types.CompletionItemKind.Event,
    "machine": types.CompletionItemKind.Module,
    "plant": types.CompletionItemKind.Module,
    "table": types.CompletionItemKind.Constant,
    "definition": types.CompletionItemKind.Reference,
}
_SYMBOLS = {
    "variable": types.SymbolKind.Variable,
    "state": types.SymbolKind.Event,
    "machine": types.SymbolKind.Module,
    "plant": types.SymbolKind.Module,
    "type": types.SymbolKind.Enum,
    "table": types.SymbolKind.Constant,
    "property": types.SymbolKind.Boolean,
}


def diagnostic(said: Said, lines: Lines, place: Callable[[str, int, int], types.Location]) -> types.Diagnostic:
    """What is said of a place, with its notes and its hint."""
    notes = "".join(f"\nnote: {note}" for note in said.notes)
    hint = "" if said.hint is None else f"\nhint: {said.hint}"
    related = [types.DiagnosticRelatedInformation(place(*where[:3]), where[3]) for where in said.related]
    return types.Diagnostic(
        lines.range(said.start, max(said.end, said.start + (said.start < len(lines.text)))),
        said.message + notes + hint,
        _SEVERITIES[said.severity],
        said.code,
        source=SOURCE,
        related_information=related or None,
    )


def markup(text: str, shown: Sequence[types.MarkupKind] | None) -> types.MarkupContent | str:
    """A text in Markdown, for an editor that shows these kinds of texts; else as a plain one."""
    if shown is not None and types.MarkupKind.Markdown in shown:
        return types.MarkupContent(types.MarkupKind.Markdown, text)
    return text.replace("`", "")


def completion(offer: Offer, replaced: types.Range, shown: Sequence[types.MarkupKind] | None) -> types.CompletionItem:
    """An offer that takes the place of the word that has begun."""
    said = markup(offer.about, shown) if offer.about else None
    edit = types.TextEdit(replaced, offer.insert or offer.word)
    kind = _OFFERED.get(offer.kind, types.CompletionItemKind.Variable)
    return types.CompletionItem(
        offer.word, kind=kind, documentation=said, sort_text=f"{offer.order}{offer.word}", text_edit=edit
    )


def outline(findings: Findings, file: str, lines: Lines) -> list[types.DocumentSymbol]:
    """The names of a file, with what is inside of them."""
    old = findings.texts.get(file, lines.text)
    tops = [name for name in findings.index.outline if name.place.file == file]
    inside = [] if tops else [n for top in findings.index.outline for n in top.inside.values() if n.place.file == file]
    return list(_symbols([*tops, *_once(inside)], file, old, lines))


def _once(names: list[Name]) -> list[Name]:
    return list({name.place: name for name in names}.values())


def _symbols(names: list[Name], file: str, old: str, lines: Lines) -> Iterator[types.DocumentSymbol]:
    for name in names:
        start, end = (moved(at, old, lines.text) for at in (name.place.start, name.place.end))
        whole = name.whole or name.place
        first = min(start, moved(whole.start, old, lines.text))
        last = max(end, moved(whole.end, old, lines.text))
        inside = [each for each in name.inside.values() if each.place.file == file]
        children = list(_symbols(inside, file, old, lines))
        kind = _SYMBOLS.get(name.kind, types.SymbolKind.Object)
        detail = name.about.split("\n", 1)[0].partition(": ")[2].replace("`", "")
        last = max([last, *(lines.offset(child.range.end) for child in children)])
        yield types.DocumentSymbol(
            name.word or "?",
            kind,
            lines.range(first, last),
            lines.range(start, end),
            detail[:100] or None,
            children=children or None,
        )


def lens_title(verdict: Verdict | None, *, stale: bool) -> str:
    """What a lens says of a property."""
    if verdict is None:
        return "check"
    if verdict.checked is None:
        return "checking…"
    found = verdict.checked
    if stale:
        return f"was {'true' if found.verdict == 'holds' else found.verdict}, the text has changed · check"
    if found.verdict == "unknown":
        return f"unknown: {found.text}"
    return "violated · show" if found.verdict == "violated" else found.verdict


def quick_fix(uri: str, fix: Fix, lines: Lines, of: types.Diagnostic) -> types.CodeAction:
    """An edit that a hint tells."""
    edit = types.TextEdit(lines.range(fix.start, fix.end), fix.text)
    return types.CodeAction(fix.title, types.CodeActionKind.QuickFix, [of], edit=types.WorkspaceEdit({uri: [edit]}))
