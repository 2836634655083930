"""The report of all papers: pictures, one HTML page with all pictures, and the pages in docs."""

from __future__ import annotations

import html
import importlib
import re
import textwrap
import time
from base64 import b64encode
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import mutations
from printed_items import texts, unit_word
from report import ECHO, MISSING, TWICE, Row, Verdict, capitalized

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent / "papers.md"
"""The page that counts the verdicts of all papers. Each paper also has its own page in
`docs/papers`."""
BUILD = HERE.parents[1] / "build" / "reproduce"
PAPERS = (
    "board_installer",
    "bricklaying_gantry",
    "well_manipulator",
    "photo_robot",
    "lynxmotion_and_3rrr",
)
PROCESSES = 2
DOTS_PER_INCH = 320
NOWHERE = "not printed"
"""Value of `Row.where` for an item that the paper does not print. The pages omit this value."""
HEAD = ("item", "values", "verdict")
_NUMBER = r"\((?:[A-Z]\.)?\d+(?:\.\d+)*\)"
EQUATIONS = re.compile(rf"{_NUMBER}((?:-|, ){_NUMBER})*")
"""Regular expression for equation numbers, such as "(3), (4)", "(3)-(6)" or "(B.1.7)"."""
MEANINGS: dict[Verdict, str] = {
    "agrees": "our value equals the printed value to half a unit of its last digit. If the paper "
    "says “about”, the note quotes it and states the tolerance.",
    "erratum": "the printed value is wrong, and our value agrees with the corrected value in the "
    "note. "
    "If the note names a mistake, a computation with this mistake gives the printed value.",
    "one reading": "the printed value follows from one interpretation of the paper's text. The "
    "note states this interpretation. The paper does not state this interpretation, and other "
    "printed values contradict this interpretation.",
    "not reproducible": "the printed value does not follow from the paper; the note lists what we "
    "tried.",
    "consistency": "an input of chasles is compared with the printed value, or one model is "
    "computed twice. Agreement shows that nothing was mistyped, but proves nothing about the "
    "paper.",
    "assumed": "the paper needs the value and does not print it; the note gives our reason.",
    "lost": "the value or curve is missing in our copy of the paper; our value replaces it.",
    "not printed": "the paper neither prints nor needs the value; our value is an addition.",
}
VERDICTS: tuple[Verdict, ...] = tuple(MEANINGS)
DIGITS = (
    "rows with tested digits",
    "tested digits",
    "no printed value",
    "words, or no digits",
    "wrong, cause unknown",
)
VERDICT_LIST = "\n".join(f"- **{name}**: {meaning}" for name, meaning in MEANINGS.items())
EVALUATED = """\
Numbers in brackets are not printed. These numbers were evaluated from the paper's equations
independently of chasles. The equations of the board installer are lost, so its numbers come from a
reconstructed model. Statements in words are quoted next to the numbers that confirm or refute them;
a word is never compared with a number. Printed equations are in Python notation, followed by their
value at generic arguments. If a paper prints no unit or a wrong unit, the tables state the unit of
our comparison."""
CHANGED = """\
A test changes each printed digit by the smallest step that exceeds the tolerance, and the verdict
must then fail. This test does not apply to rows without a printed value, to words and equations
without digits, and to wrong values of unknown cause. The second table counts the rows
whose digits are not tested."""
WRONG: tuple[Verdict, ...] = ("erratum", "one reading", "not reproducible")
"""Verdicts for printed values that are wrong, ambiguous or not reproducible."""
LISTS: dict[str, tuple[Verdict, ...]] = {
    "Values that agree": ("agrees",),
    "Values that the paper does not print": ("assumed", "lost", "not printed"),
    "Consistency": ("consistency",),
}
"""Headings of the lists on a paper's page, with the verdicts of the rows in each list."""
USUAL_NOTES: dict[Verdict, tuple[str, ...]] = {"consistency": (ECHO, TWICE), "lost": (MISSING,)}
"""Notes that the lists on a paper's page omit, because these notes only repeat the meaning of the
verdict."""
LINE_WIDTH = 80
TITLE = "Five papers, number by number"
INTRODUCTION = f"""\
# {TITLE}

`make reproduce` computes every number below with chasles, compares it with the printed number,
writes all tables and pictures to `build/reproduce/index.html`, and checks these pages. The scripts
in `docs/papers/` are examples to read. The verdict compares the computed number with the printed
number. The script stops if a verdict is wrong.

{VERDICT_LIST}

{EVALUATED}

{CHANGED}
"""
STYLE = """\
body { font: 16px/1.45 sans-serif; max-width: 75rem; margin: auto; padding: 1rem; color: #111; }
table { border-collapse: collapse; font-size: 0.85rem; margin: 1rem 0; }
td, th { border-top: 1px solid #ccc; padding: 0.25rem 0.5rem; }
td, th { text-align: left; vertical-align: top; }
td:nth-child(2) { font-variant-numeric: tabular-nums; }
figure { display: inline-block; margin: 0.5rem; width: 22rem; vertical-align: top; }
figcaption { font-size: 0.8rem; }
figure img { max-width: 100%; }
"""


@dataclass(frozen=True)
class Chapter:
    """A paper's part of the report: title, source, table rows, and pictures keyed by caption."""

    paper: str
    title: str
    source: str
    rows: tuple[Row, ...]
    pictures: dict[str, Path]
    seconds: float


def main(arguments: Sequence[str]) -> int:
    """Write the report of all papers, and return 1 if a page in docs is out of date."""
    with ProcessPoolExecutor(PROCESSES, mp_context=get_context("spawn")) as pool:
        chapters = list(pool.map(reproduced, present()))
    BUILD.mkdir(parents=True, exist_ok=True)
    page = BUILD / "index.html"
    page.write_text(html_page(chapters), encoding="utf-8")
    for chapter in chapters:
        print(
            f"{chapter.paper}: {len(chapter.rows)} rows, {len(chapter.pictures)} pictures, "
            f"{chapter.seconds:.0f} s"
        )
    print(f"wrote {page}")
    found = {page_of(chapter.paper): section(chapter.paper, chapter.rows) for chapter in chapters}
    found[PAGE] = summary({chapter.paper: chapter.rows for chapter in chapters})
    if "--write" in arguments:
        for path, text in found.items():
            path.write_text(text, encoding="utf-8")
        return 0
    differing = [path for path, text in found.items() if not _holds(path, text)]
    for path in differing:
        print(f"{path} differs from the rows: run python docs/papers/report.py --write")
    return 1 if differing else 0


def _holds(path: Path, text: str) -> bool:
    return path.exists() and path.read_text(encoding="utf-8") == text


def page_of(paper: str) -> Path:
    """Return the path of the Markdown page of a paper."""
    return HERE / f"{paper}.md"


def present() -> list[str]:
    """List the papers with a script in this folder, in the order of the report."""
    return [paper for paper in PAPERS if (HERE / f"{paper}.py").exists()]


def reproduced(paper: str) -> Chapter:
    """Run the script of a paper, and write its pictures to the build folder."""
    import matplotlib as mpl  # noqa: PLC0415

    mpl.use("Agg")
    mpl.rcParams["figure.max_open_warning"] = 0  # each figure is closed after it is written
    start = time.perf_counter()
    script = importlib.import_module(paper)
    rows = tuple(replace(row, judge=None) for row in script.rows())
    folder = BUILD / paper
    folder.mkdir(parents=True, exist_ok=True)
    drawn = script.figures()
    if len({slug(caption) for caption in drawn}) < len(drawn):
        raise ValueError(f"{paper}: two captions begin with the same words: {', '.join(drawn)}")
    pictures = {
        caption: written(folder / slug(caption), picture) for caption, picture in drawn.items()
    }
    title, source = words(script)
    return Chapter(paper, title, source, rows, pictures, time.perf_counter() - start)


def words(script: Any) -> tuple[str, str]:
    """Return the title and source of a paper: first two paragraphs of its script's docstring."""
    title, _, rest = script.__doc__.partition("\n\n")
    return title.strip().removesuffix("."), " ".join(rest.split("\n\n")[0].split())


def slug(caption: str) -> str:
    """Return a picture's file name without suffix: the words before the colon of its caption."""
    return re.sub(r"\W+", "_", caption.partition(":")[0].lower()).strip("_")


def written(stem: Path, picture: Any) -> Path:
    """Write a figure as PNG or an animation as GIF, and return the path of the file."""
    if callable(picture):
        path = stem.with_suffix(".gif")
        picture(path)
        return path
    import matplotlib.pyplot as plt  # noqa: PLC0415

    path = stem.with_suffix(".png")
    picture.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(picture)
    return path


def summary(rows: dict[str, Sequence[Row]]) -> str:
    """Return the text of docs/papers.md, with tables that count verdicts and tested digits."""
    pages = ", ".join(f"[{paper}](papers/{paper}.md)" for paper in rows)
    lines = [
        INTRODUCTION,
        f"The page of each paper starts with its wrong or ambiguous values: {pages}.",
        "",
    ]
    lines += [*_block(("paper", *VERDICTS), map(_counts, rows.items())), ""]
    lines += _block(("paper", *DIGITS), map(_digit_counts, rows.items()))
    return "\n".join([*lines, ""])


def section(paper: str, rows: Sequence[Row]) -> str:
    """Return the Markdown text of a paper's page."""
    title, source = words(importlib.import_module(paper))
    lines = [f"# {title}", "", source, ""]
    lines += [f"`python docs/papers/{paper}.py`", ""]
    wrong = [row for row in rows if row.verdict in WRONG]
    if wrong:
        lines += ["## Wrong or ambiguous values", "", *table(HEAD, map(cells, wrong)), ""]
    for heading, verdicts in LISTS.items():
        compared = [row for row in rows if row.verdict in verdicts]
        if compared:
            entries = [line for row in compared for line in _entry(row)]
            lines += [f"## {heading}", "", "```", *entries, "```", ""]
    return "\n".join(lines)


def counted(paper: str, rows: Sequence[Row]) -> list[str]:
    """Return two table lines for a paper: counts of verdicts, and counts of digits."""
    own = (paper, rows)
    return [
        _block(("paper", *head), [found(own)])[2]
        for head, found in ((VERDICTS, _counts), (DIGITS, _digit_counts))
    ]


def _counts(item: tuple[str, Sequence[Row]]) -> tuple[str, ...]:
    paper, rows = item
    found = Counter(row.verdict for row in rows)
    return (paper, *(str(found[verdict]) for verdict in VERDICTS))


def _digit_counts(item: tuple[str, Sequence[Row]]) -> tuple[str, ...]:
    paper, rows = item
    refuting = [row for row in rows if not mutations.exemption(row)]
    without = mutations.exempt(rows)
    figures = sum(len(mutations.digits(row)) for row in refuting)
    counts = (len(refuting), figures, *(without[reason] for reason in mutations.EXEMPTIONS))
    return (paper, *map(str, counts))


def _block(head: Sequence[str], rows: Any) -> list[str]:
    widths = (max(map(len, PAPERS)), *map(len, head[1:]))
    lines = ["  ".join(map(str.rjust, line, widths)) for line in (head, *rows)]
    return ["```", *lines, "```"]


def cells(row: Row) -> tuple[str, ...]:
    """Return the Markdown cells of a table row: item, values as a sentence, and verdict."""
    note = _phrase(row.note.replace("; cause: ", ". The printed value results from "))
    values = f"{_paper_value(row)}; {_our_value(row)}."
    return _item(row), values, f"{row.verdict.capitalize()}. {note}".strip()


def _paper_value(row: Row) -> str:
    """Return a clause with the paper's value, such as "The paper prints 78 deg"."""
    printed, _ = _values(row)
    if row.printed is None:
        is_lost = row.verdict == "lost" or (row.source is not None and row.source.is_lost)
        return "Our copy of the paper lacks the value" if is_lost else "The paper prints no value"
    if printed.startswith("["):
        return f"An independent model gives {printed}"
    if row.source and row.source.value is not None:
        equation = texts(row.source.value)
        printed = printed.replace(f"{equation} = ", f"{equation}, which gives ", 1)
    printed = _quoted(row, printed)
    verb = "says" if printed.endswith("”") else "prints"
    return f"The paper {verb} {printed}"


def _quoted(row: Row, printed: str) -> str:
    """Put the words of the paper in quotation marks."""
    statement = _words_of(row)
    return printed.replace(statement, f"“{statement}”", 1) if statement else printed


def _words_of(row: Row) -> str:
    """Return the statement in words that the paper prints, or "" if it prints no words."""
    value = row.source.value if row.source else None
    is_words = isinstance(value, str) and (value.isalpha() or not mutations.is_expression(value))
    return str(value) if is_words else ""


def _our_value(row: Row) -> str:
    """Return a clause with our value, such as "chasles computes 77.6 deg"."""
    _, ours = _values(row)
    if row.verdict == "assumed":
        return f"our value is {ours}"
    is_found = bool(row.printed) and _words_of(row) == row.printed
    return f"chasles {'finds' if is_found else 'computes'} {ours}"


def _item(row: Row) -> str:
    """Return the item of a row and its place in the paper, such as "A5 (equation (8)):"."""
    if row.where == NOWHERE:
        return f"{row.item}:"
    place = EQUATIONS.sub(lambda n: f"equation{'s' if n[1] else ''} {n[0]}", row.where)
    return f"{row.item} ({place}):"


def _entry(row: Row) -> list[str]:
    """Return text lines for a row in a list: printed value, our value and note."""
    printed, ours = _values(row)
    printed = _quoted(row, printed)
    source = "evaluated" if printed.startswith("[") else "paper"
    found = row.verdict if row.printed is None else f"{source} {printed}"
    note = row.note
    for usual in USUAL_NOTES.get(row.verdict, ()):
        note = note.removeprefix(usual).lstrip(".:; ")
    return [
        *_wrapped(f"{_item(row)} {found}, chasles {ours}"),
        *_wrapped(_phrase(note), indent="    "),
    ]


def _wrapped(text: str, indent: str = "") -> list[str]:
    """Wrap a text into lines of a list, with breaks only at spaces."""
    wrapper = textwrap.TextWrapper(LINE_WIDTH, indent, "    ")
    wrapper.break_on_hyphens = wrapper.break_long_words = False
    return wrapper.wrap(text)


def _values(row: Row) -> tuple[str, str]:
    units = (row.source and row.source.printed_unit) or row.unit, row.unit
    printed, ours = (
        f"{value} {unit_word(unit)}".rstrip() for value, unit in zip(row.shown, units, strict=True)
    )
    return printed, ours


def _phrase(note: str) -> str:
    """Return a note with a final period, and with a capital unless it starts with a symbol."""
    note = capitalized(note)
    return f"{note}." if note and not note.endswith((".", ":")) else note


def table(head: Sequence[str], rows: Any) -> list[str]:
    """Return a table in Markdown."""
    first, *others = [
        "| " + " | ".join(re.sub(r"([|*])", r"\\\1", cell) for cell in line) + " |"
        for line in (head, *rows)
    ]
    return [first, f"|{'---|' * len(head)}", *others]


def html_page(chapters: Sequence[Chapter]) -> str:
    """Return the report as one HTML page that includes its style and pictures."""
    verdicts = _html_counts(chapters, VERDICTS, _counts)
    digits = _html_counts(chapters, DIGITS, _digit_counts)
    meanings = [
        f"<li><b>{name}</b>: {html.escape(meaning)}</li>" for name, meaning in MEANINGS.items()
    ]
    body = [
        f"<h1>{TITLE}</h1>",
        f"<ul>{''.join(meanings)}</ul><p>{html.escape(EVALUATED)}</p>{verdicts}",
        f"<p>{html.escape(CHANGED)}</p>{digits}",
        *map(_html_chapter, chapters),
    ]
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f"<title>{TITLE}</title><style>{STYLE}</style></head><body>{''.join(body)}</body></html>\n"
    )


def _html_counts(chapters: Sequence[Chapter], head: Sequence[str], count: Any) -> str:
    lines = [
        f'<tr><td><a href="#{own.paper}">{html.escape(own.title)}</a></td>'
        f"{_html_cells(count((own.paper, own.rows))[1:], 'td')}</tr>"
        for own in chapters
    ]
    return f"<table><tr>{_html_cells(('paper', *head), 'th')}</tr>{''.join(lines)}</table>"


def _html_chapter(chapter: Chapter) -> str:
    pictures = "".join(
        f'<figure><img alt="{html.escape(caption)}" src="{_inline(path)}">'
        f"<figcaption>{html.escape(caption)}</figcaption></figure>"
        for caption, path in chapter.pictures.items()
    )
    return (
        f'<h2 id="{chapter.paper}">{html.escape(chapter.title)}</h2>'
        f"<p>{html.escape(chapter.source.replace('`', ''))}</p>{pictures}"
        f"{_html_table(HEAD, map(cells, chapter.rows))}"
    )


def _html_table(head: Sequence[str], rows: Any) -> str:
    body = "".join(f"<tr>{_html_cells(row, 'td')}</tr>" for row in rows)
    return f"<table><tr>{_html_cells(head, 'th')}</tr>{body}</table>"


def _html_cells(contents: Sequence[str], tag: str) -> str:
    return "".join(f"<{tag}>{html.escape(text)}</{tag}>" for text in contents)


def _inline(path: Path) -> str:
    kind = path.suffix.removeprefix(".")
    return f"data:image/{kind};base64,{b64encode(path.read_bytes()).decode()}"
