"""Writes a page with sliders for every robot to build/gallery/<robot>.html, and an index of them.

With "shelf" as an argument, the arms of the shelf too, which are derived on first use.
"""

import html
import sys
from pathlib import Path

import chasles
from chasles.view import html_page

ROOT = Path(__file__).parent.parent
OUTPUT = ROOT / "build" / "gallery"
INDEX = """\
<!doctype html>
<html lang="en">
<head><meta charset="utf-8"><title>Robots of chasles</title>
<style>body {{ font: 16px/1.6 system-ui, sans-serif; margin: 2em; }}</style></head>
<body><h1>Robots of chasles</h1><ul>
{items}
</ul></body>
</html>
"""


def main() -> int:
    """Writes all pages; returns 0."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    names = chasles.robots() + (chasles.shelf_robots() if "shelf" in sys.argv[1:] else [])
    items = []
    for name in names:
        robot = chasles.load(name)
        page = OUTPUT / f"{name}.html"
        page.write_text(html_page(robot), encoding="utf-8")
        items.append(f'<li><a href="{page.name}">{html.escape(robot.title)}</a> ({name})</li>')
        print(page.relative_to(ROOT))
    index = OUTPUT / "index.html"
    index.write_text(INDEX.format(items="\n".join(items)), encoding="utf-8")
    print(index.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main())
