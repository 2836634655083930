"""Checks the format of a commit message.

A blank line separates the line ``area: imperative summary`` from the reason.
"""

import re
import sys
from pathlib import Path

MAX_SUBJECT = 72


def faults(message: str) -> list[str]:
    """Return the faults of a commit message as sentences, and ignore lines that start with #."""
    lines = [line for line in message.splitlines() if not line.startswith("#")]
    subject = lines[0] if lines else ""
    found = []
    if not re.match(r"[a-z][\w, /-]*: \S", subject):
        found.append(f"The subject {subject!r} has no area: write 'inverse: find all branches'.")
    if len(subject) > MAX_SUBJECT:
        found.append(f"The subject has {len(subject)} characters; at most {MAX_SUBJECT} fit.")
    if subject.endswith("."):
        found.append("The subject ends with a full stop.")
    if len(lines) > 1 and lines[1].strip():
        found.append("The second line must be blank.")
    return found


if __name__ == "__main__":
    texts = faults(Path(sys.argv[1]).read_text(encoding="utf-8"))
    print(*texts, sep="\n", file=sys.stderr)
    sys.exit(bool(texts))
