"""The site has valid links, short pages and short sentences."""

import os
import re

import pytest

from tests.support.pages import DOCS, PAGES, ROOT, anchors, links, prose

NAVIGATION = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:\n")[2]
README = "../README.md"
LONG = ("reference/", "explanation/", "papers", "performance.md", "architecture.md", "robots.md")
"""Names of reference pages. These pages may be long. Pages that are not listed here must be short,
because they are read from top to bottom."""
MAX_WORDS = 1500
MAX_SENTENCE = 35


def test_navigation_has_every_page_once():
    listed = re.findall(r"(\S+\.md)$", NAVIGATION, re.MULTILINE)
    assert sorted(listed) == PAGES


@pytest.mark.parametrize("page", [README, *PAGES])
def test_links_and_anchors_resolve(page):
    for link in links(page):
        path, _, fragment = link.partition("#")
        target = os.path.normpath(DOCS / page / ".." / path) if path else str(DOCS / page)
        assert os.path.exists(target), link
        if page != README:
            assert target.startswith(str(DOCS)), f"{link} leaves the site"
        if fragment:
            assert fragment in anchors(os.path.relpath(target, DOCS)), link


@pytest.mark.parametrize("page", [page for page in PAGES if not page.startswith(LONG)])
def test_page_that_is_read_as_a_whole_is_short(page):
    assert len(prose(page).split()) <= MAX_WORDS


@pytest.mark.parametrize("page", [p for p in PAGES if p.startswith(("index", "start", "how-to"))])
def test_sentences_are_short(page):
    long = [s for s in sentences(prose(page)) if len(s.split()) > MAX_SENTENCE]
    assert not long, "\n\n".join(long)


def sentences(markdown):
    """Yield the sentences of paragraphs, list items and table cells of a page."""
    blocks = re.split(r"\n\s*\n|^\s*(?:[-*]|\d+\.) |\s\|\s|^\|", markdown, flags=re.MULTILINE)
    for block in blocks:
        yield from re.split(r"(?<=[.:;?!])\s+", block.strip())
