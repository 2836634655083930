"""Replaces the relative links of README.md by links to a tag of a repository, before a release.

A package index shows README.md, but does not contain the files that README.md links to.
Usage: python docs/absolute_links.py https://HOST/OWNER/NAME v1.0.0
"""

import re
import sys
from pathlib import Path

README = Path(__file__).parent.parent / "README.md"


def absolute(text: str, repository: str, tag: str) -> str:
    """Return the text of a page with absolute links to the files of a Git tag."""

    def link(found: re.Match[str]) -> str:
        kind = "raw" if found[1] else "blob"
        return f"{found[1]}[{found[2]}]({repository}/{kind}/{tag}/{found[3]})"

    return re.sub(r"(!?)\[([^]]*)\]\((?!https?:|#)([^)]+)\)", link, text)


if __name__ == "__main__":
    text = README.read_text(encoding="utf-8")
    README.write_text(absolute(text, *sys.argv[1:]), encoding="utf-8")
