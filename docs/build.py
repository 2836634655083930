"""Compiles every robot's article to build/docs/<robot>.pdf."""

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
OUTPUT = ROOT / "build" / "docs"


def main() -> int:
    """Compiles all; returns how many failed."""
    if shutil.which("pdflatex") is None:
        print("make docs needs pdflatex (Debian: texlive-latex-extra lmodern)", file=sys.stderr)
        return 1
    OUTPUT.mkdir(parents=True, exist_ok=True)
    failed = 0
    for article in sorted(ROOT.glob("generated/*/*.tex")):
        command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error"]
        command += [f"-output-directory={OUTPUT}", article.name]
        done = subprocess.run(command, cwd=article.parent, capture_output=True, check=False)
        failed += done.returncode != 0
        result = OUTPUT / f"{article.stem}.pdf"
        print(result.relative_to(ROOT) if done.returncode == 0 else f"{article.name}: failed")
    return failed


if __name__ == "__main__":
    sys.exit(main())
