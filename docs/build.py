"""Compiles each LaTeX article to build/docs/<robot>.pdf without warnings.

No line may extend beyond the page.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
WARNINGS = ("LaTeX Warning", "Missing character", "undefined")
"""Words in a LaTeX log that report a wrong reference or a missing character."""
OUTPUT = ROOT / "build" / "docs"
WIDEST_EXCESS = 1.0
"""Largest extension of a line into the margin (pt), too small to be visible."""


def main() -> int:
    """Compile all LaTeX articles and return the number of LaTeX articles that failed."""
    if shutil.which("pdflatex") is None:
        print("make docs needs pdflatex (Debian: texlive-latex-extra lmodern)", file=sys.stderr)
        return 1
    OUTPUT.mkdir(parents=True, exist_ok=True)
    failed = 0
    for article in sorted(ROOT.glob("generated/*/*.tex")):
        command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error"]
        command += [f"-output-directory={OUTPUT}", article.name]
        done = subprocess.run(command, cwd=article.parent, capture_output=True, check=False)
        result = OUTPUT / f"{article.stem}.pdf"
        log = result.with_suffix(".log").read_text(encoding="utf-8", errors="replace")
        excess = max(map(float, re.findall(r"Overfull \\hbox \(([\d.]+)pt", log)), default=0.0)
        warned = any(message in log for message in WARNINGS)
        if done.returncode:
            print(f"{article.name}: failed")
        elif warned:
            print(f"{article.name}: LaTeX prints a warning, see {result.with_suffix('.log')}")
        elif excess > WIDEST_EXCESS:
            print(f"{article.name}: a line is {excess:g} pt too wide")
        else:
            print(result.relative_to(ROOT))
        failed += bool(done.returncode) or warned or excess > WIDEST_EXCESS
    return failed


if __name__ == "__main__":
    sys.exit(main())
