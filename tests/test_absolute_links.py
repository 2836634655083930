"""The README of a release has links that work without the repository."""

import re
from pathlib import Path

from docs.absolute_links import README, absolute

REPOSITORY, TAG = "https://example.org/owner/chasles", "v1.2.3"


def test_readme_links_lead_to_files_of_the_tag():
    text = README.read_text(encoding="utf-8")
    links = re.findall(r"(!?)\[[^]]*\]\(([^)]*)\)", absolute(text, REPOSITORY, TAG))
    assert len(links) > 20
    for picture, link in links:
        start = f"{REPOSITORY}/{'raw' if picture else 'blob'}/{TAG}/"
        assert link.startswith(start)
        assert Path(README.parent, link.removeprefix(start).partition("#")[0]).is_file()


def test_complete_links_and_anchors_do_not_change():
    text = "[site](https://example.org) [part](#install) ![](a.png)"
    expected = f"[site](https://example.org) [part](#install) ![]({REPOSITORY}/raw/{TAG}/a.png)"
    assert absolute(text, REPOSITORY, TAG) == expected
