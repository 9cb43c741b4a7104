"""`llfsm property`: questions about formulas over free atoms, line by line."""

import csv
import os
import threading
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.omega.products import accepts
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.extensions.hoa.reading import read_hoa
from llfsm_verify.logic.formula import to_text
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.wordtext import parse_word, write_word
from llfsm_verify.testing.formulas import formulas, lassos
from tests.cli.running import LIGHTS, Done, llfsm
from tests.outside import FACTS, demand, needs
from tests.quick import examples

ROOT = Path(__file__).resolve().parents[4]


def rows():
    if not FACTS.is_file():
        return []
    with FACTS.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


ROWS = rows()


def ask(*arguments, stdin=""):
    done = llfsm("property", *arguments, stdin=stdin)
    return done.returncode, done.stdout


# ---------------------------------------------------------------- recorded facts


@pytest.mark.slow
@needs("shared")
def test_classes_of_the_corpus():
    code, output = ask("classify", "--syntax", "spot", "-", stdin="".join(r["formula"] + "\n" for r in ROWS))
    assert code == 0
    assert output.splitlines() == [f"{r['mp_class']}\t{r['formula']}" for r in ROWS]


@pytest.mark.slow
@needs("shared")
@pytest.mark.parametrize(("column", "answer"), [("accepted_word", "true"), ("rejected_word", "false")])
def test_words_of_the_corpus(column, answer):
    lines = [f"{r['formula']}\t{r[column]}\n" for r in ROWS if r[column]]
    code, output = ask("accepts", "--syntax", "spot", "-", stdin="".join(lines))
    assert code == 0 and len(lines) > 700
    assert output.splitlines() == [answer] * len(lines)


# ---------------------------------------------------------------- each question


@pytest.mark.parametrize(
    ("arguments", "code", "output"),
    [
        (("classify", "G p"), 0, "S\tG p\n"),
        (("classify", "--syntax", "spot", "Fp0"), 0, "G\tFp0\n"),
        (("classify", "F[1:2] p"), 0, "B\tF[1:2] p\n"),
        (("classify", "G (p -> O q)"), 0, "S\tG (p -> O q)\n"),
        (("classify", "G F (p S q)"), 0, "R\tG F (p S q)\n"),
        (("classify", "F (p && Y H q)"), 0, "G\tF (p && Y H q)\n"),
        (("classify", "O p"), 0, "B\tO p\n"),
        (("classify", "--syntax", "spot", "{a;b}!"), 0, "B\t{a;b}!\n"),
        (("classify", "--syntax", "spot", "{a[*];b}[]->Fc"), 0, "R\t{a[*];b}[]->Fc\n"),
        (("translate", "--stats", "--buchi", "G (p -> O q)"), 0, "2\t3\t0\ttrue\n"),
        (("translate", "--stats", "--buchi", "--syntax", "spot", "{a;b}!"), 0, "3\t3\t1\ttrue\n"),
        (("simplify", "O (F F p) && true"), 0, "O (F p)\n"),
        (("simplify", "G[<=5ms] (F F p || F p)"), 0, "G[<=5ms] (F p)\n"),
        (("print", "G[<=5ms] p && (p U[<=2s] q)"), 0, "G[<=5ms] (p) && (p U[<=2s] q)\n"),
        (("simplify", "--syntax", "spot", "{a;b}[]->FFc"), 0, "{{{a};{b}}}[]->(F c)\n"),
        (("translate", "--stats", "G F p"), 0, "1\t2\t1\ttrue\n"),
        (("translate", "--stats", "F G p"), 0, "2\t3\t1\tfalse\n"),
        (("translate", "--stats", "false"), 0, "1\t0\t0\ttrue\n"),
        (("translate", "--stats", "--buchi", "G F p && G F q"), 0, None),
        (("accepts", "p U q", "p;p&q;cycle{1}"), 0, "true\n"),
        (("accepts", "p U q", "p;cycle{!q}"), 0, "false\n"),
        (("accepts", "G (p -> O q)", "q;cycle{p}"), 0, "true\n"),
        (("accepts", "--syntax", "spot", "{p;q}<>->r", "p;q&r;cycle{1}"), 0, "true\n"),
        (("accepts", '"EW@GREEN" U x==3', 'EW@GREEN&!p;"x == 3";cycle{1}'), 0, "true\n"),
        (("equivalent", "G F p", "G F F p"), 0, "true\n"),
        (("equivalent", "G p", "F p"), 1, None),
        (("implies", "G p", "F p"), 0, "true\n"),
        (("implies", "F p", "G p"), 1, None),
        (("equivalent", "--syntax", "spot", "{p;q}!", "p & X q"), 0, "true\n"),
        (("equivalent", "H p", "Z H p && p"), 0, "true\n"),
        (("simplify", "F F p || F p"), 0, "F p\n"),
        (("simplify", "--to", "spin", "G G p"), 0, "[] p\n"),
        (("print", "absence of p before q"), 0, "F q -> (!p U q)\n"),
        (("implies", "s, t respond to p", "s responds to p"), 0, "true\n"),
        (("simplify", "q responds to p within 5s"), 0, "G (p -> F[<=5s] (q))\n"),
        (("print", "--to", "spot", "G (x == 3 -> F[1:2] p)"), 0, 'G ("x == 3" -> F[1:2](p))\n'),
        (("print", "--syntax", "spin", "a U b U c"), 0, "(a U b) U c\n"),
        (("example", "p"), 0, "p;cycle{1}\t!p;cycle{1}\n"),
        (("example", "true"), 0, "cycle{1}\t\n"),
        (("example", "p && !p"), 0, "\tcycle{1}\n"),
    ],
)
def test_answers(arguments, code, output):
    found = ask(*arguments)
    assert found[0] == code
    assert output is None or found[1] == output


def test_a_word_tells_formulas_apart():
    for left, right in (("G F p", "F G p"), ("p U q", "p W q"), ("F p", "X p")):
        code, output = ask("equivalent", left, right)
        answer, word = output.rstrip("\n").split("\t")
        assert (code, answer) == (1, "false")
        truths = {ask("accepts", f, word)[1] for f in (left, right)}
        assert truths == {"true\n", "false\n"}


@pytest.mark.slow
@given(formulas(max_leaves=4))
@settings(max_examples=examples(40), deadline=None)
def test_examples_are_examples(f):
    text = to_text(f)
    code, output = ask("example", text)
    accepted, rejected = output.rstrip("\n").split("\t")
    assert code == 0 and (accepted or rejected)
    for word, truth in ((accepted, "true\n"), (rejected, "false\n")):
        if word:
            assert ask("accepts", text, word) == (0, truth)


@pytest.mark.slow
@given(formulas(max_leaves=4), lassos())
@settings(max_examples=examples(40), deadline=None)
def test_simplified_and_translated_formulas_mean_the_same(f, word):
    text = to_text(f)
    assert ask("equivalent", text, ask("simplify", text)[1].strip()) == (0, "true\n")
    (found,) = read_hoa(Source("t", ask("translate", text)[1]))
    assert found.name == text
    letters = [[frozenset(x & set(found.automaton.atoms)) for x in part] for part in word]
    assert accepts(found.automaton, *letters) == evaluate(f, *word)


def test_drawings(tmp_path):
    code, output = ask("draw", "p U q")
    assert code == 0 and output.startswith("digraph") and ">p &amp;&amp; !q<" in output
    assert "flowchart" in ask("draw", "--format", "mermaid", "G F p")[1]
    assert ask("draw", "-o", str(tmp_path / "a.dot"), "p U q") == (0, "")
    assert (tmp_path / "a.dot").read_text() == output
    code, _ = ask("draw", "-o", str(tmp_path / "no" / "a.dot"), "p U q")
    assert code == 3


@pytest.mark.slow
def test_drawings_of_files(tmp_path):
    path = tmp_path / "two.hoa"
    path.write_text(ask("translate", "p U q")[1] + ask("translate", "G F p")[1])
    code, output = ask("draw", str(path))
    assert code == 0 and output == ask("draw", "p U q")[1] + ask("draw", "G F p")[1]
    path.write_text("HOA: v1 nonsense")
    assert ask("draw", str(path))[0] == 3


def test_drawings_are_what_the_name_of_their_file_says(tmp_path):
    text = ask("draw", "--format", "mermaid", "G F p")[1]
    assert ask("draw", "G F p", "-o", str(tmp_path / "a.mmd")) == (0, "")
    assert (tmp_path / "a.mmd").read_text() == text
    for arguments in (["-o", "a.gif"], ["--format", "dot", "-o", "a.svg"], ["--format", "svg", "-o", "a.png"]):
        for command in (["property", "draw", "G F p"], ["draw", LIGHTS]):
            done = llfsm(*command, *arguments[:-1], str(tmp_path / arguments[-1]))
            assert (done.returncode, done.stdout) == (2, "") and "error: " in done.stderr, arguments
    assert [path.name for path in tmp_path.iterdir()] == ["a.mmd"]
    demand("pygraphviz")
    assert ask("draw", "G F p", "-o", str(tmp_path / "a.SVG")) == (0, "")
    assert "<svg" in (tmp_path / "a.SVG").read_text()
    for command in (["property", "draw", "G F p"], ["draw", LIGHTS], ["access", LIGHTS]):
        where = ["--draw" if command[0] == "access" else "-o", str(tmp_path / "a.png")]
        assert llfsm(*command, *where) == Done(0, "", "")
        assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
        (tmp_path / "a.png").unlink()


def test_a_picture_in_pixels_wants_a_file():
    for command in (["property", "draw", "G F p"], ["draw", LIGHTS]):
        assert llfsm(*command, "--format", "png") == Done(2, "", "error: png is not text: name a file with -o\n")


def test_a_drawing_replaces_its_file_as_a_whole(tmp_path):
    path = tmp_path / "a.dot"
    path.write_text("as it was")
    assert ask("draw", "G (", "-o", str(path))[0] == 3
    assert path.read_text() == "as it was"
    (tmp_path / "two.ltl").write_text("G p\nF p\n")
    assert ask("draw", str(tmp_path / "two.ltl"), "-o", str(path))[0] == 0
    assert path.read_text() == ask("draw", "G p")[1] + ask("draw", "F p")[1]
    done = llfsm("property", "draw", str(tmp_path / "two.ltl"), "-o", str(tmp_path / "a.mmd"))
    assert done.returncode == 2 and "holds one drawing, and there are 2" in done.stderr
    done = llfsm("property", "draw", "G p", "-o", str(tmp_path / "no" / "a.dot"))
    assert done.returncode == 3 and "[E407]" in done.stderr
    (tmp_path / "link.dot").symlink_to(path)
    assert ask("draw", "G p", "-o", str(tmp_path / "link.dot"))[0] == 0
    assert (tmp_path / "link.dot").is_symlink() and path.read_text() == ask("draw", "G p")[1]
    assert ask("draw", "G p", "-o", os.devnull) == (0, "")
    assert sorted(found.name for found in tmp_path.iterdir()) == ["a.dot", "link.dot", "two.ltl"]


# ---------------------------------------------------------------- lines, files, mistakes


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("classify", ""), "E314"),
        (("classify", " # nothing"), "E314"),
        (("equivalent", "p", ""), "E314"),
        (("classify", "G p\tG q"), "a line holds one formula, and here another tab follows"),
        (("implies", "G p\tF p\tp"), "two formulas, with a tab between, and here another tab"),
        (("accepts", "p\tcycle{p}\tx"), "a word, and here another tab"),
        (("classify", "models"), "error[E302]: this is a directory\n  hint: name a file in it, or write `(models)`"),
        (("classify", "models/"), "error[E302]"),
        (("classify", "models/nowhere"), "E301"),
        (("draw", "nowhere.hoa"), "E301"),
        (("classify", "nowhere.hoa"), "E301"),
    ],
)
def test_input_without_an_answer_is_refused(arguments, message):
    done = llfsm("property", *arguments)
    assert (done.returncode, done.stdout) == (3, "") and message in done.stderr


def test_files_of_nothing(tmp_path):
    assert ask("classify", os.devnull) == (0, "")
    assert ask("classify", "-", stdin="G p\t \n") == (0, "S\tG p\n")
    (tmp_path / "empty.hoa").write_text("")
    done = llfsm("property", "draw", str(tmp_path / "empty.hoa"))
    assert (done.returncode, done.stdout) == (3, "") and "[E363]" in done.stderr


def test_names_that_may_be_those_of_files():
    done = llfsm("property", "classify", "nosuch.foo")
    assert (done.returncode, done.stdout) == (0, "B\tnosuch.foo\n")
    assert done.stderr == "note: there is no file `nosuch.foo`, so it is read as an atom\n"
    assert llfsm("property", "classify", "m.ran").stderr == ""
    assert ask("classify", "(models)") == (0, "B\t(models)\n")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_pipes_are_read_as_files_are(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_text, args=("G p\nF p\n",), daemon=True)
    writer.start()
    assert ask("classify", str(pipe)) == (0, "S\tG p\nG\tF p\n")
    writer.join()


def test_a_wrong_line_is_named_and_the_rest_still_runs(tmp_path):
    path = tmp_path / "formulas.txt"
    path.write_text("# a comment\nG p\n\np &&\nF q\nq U\n")
    done = llfsm("property", "classify", str(path))
    assert (done.returncode, done.stdout) == (3, "S\tG p\nG\tF q\n")
    assert f"{path}:4:3: error[E320]" in done.stderr and f"{path}:6:3: error[E320]" in done.stderr
    assert ask("print", str(path))[0] == 3


def test_headers_and_tabs(tmp_path):
    path = tmp_path / "pairs.tsv"
    path.write_text("# syntax: spot\nGFa\tG(Fa)\nFa\tGa\n")
    code, output = ask("implies", str(path))
    assert (code, output.splitlines()[0]) == (1, "true")
    done = llfsm("property", "implies", "-", stdin="p\n")
    assert done.returncode == 3 and "two formulas, with a tab between" in done.stderr
    done = llfsm("property", "accepts", "-", stdin="p\tcycle{p\np\tcycle{p}\n")
    assert (done.returncode, done.stdout) == (3, "true\n")
    assert "<stdin>:1:" in done.stderr and "E353" in done.stderr


@pytest.mark.parametrize("opening", ["", "\n\n\n", "# a\n \n# b\n\n# c\n", "#" + 5000 * "-" + "\n"])
def test_a_syntax_is_named_before_the_first_formula_only(opening):
    assert ask("print", "-", stdin=f"{opening}# syntax: spin\n[] p\n") == (0, "[] p\n")
    assert ask("print", "-", stdin=f"{opening}G p\n# syntax: spin\n") == (0, "G p\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("classify", "F[<=5ms] p"), "bound in time"),
        (("print", "--syntax", "spot", "--to", "llfsm", "{a;b}[]->c"), "<command line>:1:1: error[E352]"),
        (("simplify", "--syntax", "spot", "--to", "llfsm", "{a}"), "E352"),
        (("translate", "--stats", "F[<=5ms] p"), "bound in time"),
        (("accepts", "F[<=5ms] p", "cycle{p}"), "tells no time"),
        (("print", "--to", "spin", "O p"), "<command line>:1:1: error[E352]"),
        (("classify", "missing.ltl"), "E301"),
        (("translate", "--buchi", "G[<=5ms] p"), "bound in time"),
        (("classify", "p", "q"), "takes one argument"),
    ],
)
def test_refusals(arguments, message):
    done = llfsm("property", *arguments)
    assert done.returncode in (2, 3) and message in done.stderr and not done.stdout


def test_limits_are_said_and_give_unknown(monkeypatch):
    from llfsm_verify.automata.ltl import classes

    real = classes.classify
    monkeypatch.setattr(classes, "classify", lambda f, **_: real(f) if f.op == "G" else None)
    done = llfsm("property", "classify", "-", stdin="F p\nG p\n")
    assert (done.returncode, done.stdout) == (4, "unknown\tF p\nS\tG p\n")
    assert "<stdin>:1:1: warning[W301]" in done.stderr


# ---------------------------------------------------------------- words


def word(text):
    return parse_word(Fragment.whole(Source("t", text)))


@pytest.mark.parametrize(
    ("text", "stem", "loop"),
    [
        ("cycle{p}", [], [{"p"}]),
        ("p0&!p1;cycle{p0}", [{"p0"}], [{"p0"}]),
        (" p & q ; 1 ; cycle { !p ; q && !r } ", [{"p", "q"}, set()], [set(), {"q"}]),
        (
            'ns@GREEN&"x == 3";cycle{x==3&cycle}',
            [{"ns@GREEN", "x == 3"}],
            [{"x == 3", "cycle"}],
        ),
        ("!!p;!0;cycle{~p}", [{"p"}, set()], [set()]),
    ],
)
def test_reading_words(text, stem, loop):
    assert word(text) == ([frozenset(x) for x in stem], [frozenset(x) for x in loop])


@pytest.mark.parametrize(
    "text",
    ["", "p", "p;", "cycle{}", "cycle{p", "p cycle{q}", "cycle{p};q", "p;;cycle{p}", "p&;cycle{p}", "0;cycle{p}",
     "p&!p;cycle{1}", "cycle{p}}", "p q;cycle{p}", 'cycle{"}', "&p;cycle{p}", "p}", "cycle{cycle{p}}", "p!q;cycle{1}"],
)  # fmt: skip
def test_no_words(text):
    with pytest.raises(DiagnosticError):
        word(text)


@pytest.mark.slow
@given(lassos())
def test_written_words_read_back(lasso):
    stem, loop = lasso
    letters = [[tuple((key, key in letter) for key in "pqr") for letter in part] for part in (stem, loop)]
    assert word(write_word(*letters)) == (stem, loop)


@given(st.text(alphabet='pq&!~;{}cycle01 "\t@=', max_size=30))
@settings(max_examples=examples(400))
def test_garbage_is_no_word_or_reads_back(text):
    try:
        stem, loop = word(text)
    except DiagnosticError as e:
        found = e.diagnostics
    else:
        found = ()
        letters = [[tuple((key, True) for key in sorted(letter)) for letter in part] for part in (stem, loop)]
        assert word(write_word(*letters)) == (stem, loop)
    assert all(d.span is not None and d.code in ("E353", "E307", "E332") for d in found)


@pytest.mark.parametrize(
    ("syntax", "text"), [("llfsm", 'G "a#b"'), ("spot", 'G "a#b"'), ("nusmv", 'G "a#b"'), ("spin", '[] "a#b"')]
)
def test_a_comment_does_not_begin_inside_quotes(syntax, text):
    done = llfsm("property", "print", "--syntax", syntax, text)
    assert done.returncode == 3 and "an atom cannot have the character `#`" in done.stderr and done.stdout == ""


@pytest.mark.slow
def test_what_is_too_long_is_a_limit(monkeypatch):
    monkeypatch.setattr("llfsm_verify.logic.syntaxes.writing.MAX_TEXT", 1 << 20)
    done = llfsm("property", "print", "--to", "spin", "F[0:50] G[0:50] F[0:50] p")
    assert done.returncode == 4 and "warning[W301]: unknown: the formula is longer than 1 MiB" in done.stderr


@pytest.mark.parametrize(
    ("question", "inputs"),
    [
        ("classify", ["F[0:300] G[0:300] p"]),
        ("translate", ["F[0:300] G[0:300] p"]),
        ("draw", ["F[0:300] G[0:300] p"]),
        ("example", ["F[0:300] G[0:300] p"]),
        ("simplify", ["F[0:300] G[0:300] p"]),
        ("equivalent", ["F[0:300] G[0:300] p", "p U q"]),
        ("implies", ["F[0:300] G[0:300] p", "p U q"]),
    ],
)
def test_a_time_limit_makes_an_answer_unknown(question, inputs):
    """With no time at all, whatever the machine, the first look at the clock is too late."""
    done = llfsm("property", question, "--timeout", "0.000001", *inputs)
    assert done.returncode == 4 and done.stderr.count("unknown: the time limit of 1e-06 s was reached") == 1
    assert done.stdout.startswith("unknown")


@pytest.mark.parametrize("limit", ["0", "-1", "inf", "soon"])
def test_a_time_limit_has_the_form_that_it_has_elsewhere(limit):
    assert llfsm("property", "classify", "p", "--timeout", limit).returncode == 2
