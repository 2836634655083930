"""Writes a page with sliders for every robot to build/gallery/<robot>.html, and an index page.

The index shows a drawing of each robot, its axes and the structure that its inverse kinematics
function uses. `python docs/gallery.py shelf` also writes the robots that are derived on first use.
"""

import html
import sys
from pathlib import Path

import matplotlib.pyplot as plt

import chasles
from chasles.derive import explain, read
from chasles.view import write_html

ROOT = Path(__file__).parent.parent
OUTPUT = ROOT / "build" / "gallery"
ROBOTS = ROOT / "derive" / "robots"
INDEX = """\
<!doctype html>
<html lang="en">
<head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Robots of chasles</title>
<style>
body {{ font: 15px/1.4 system-ui, sans-serif; margin: 2em auto; max-width: 1200px; color: #222; }}
h2 {{ font-size: 18px; margin: 2em 0 0.8em; }}
main {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(250px, 1fr)); gap: 16px; }}
a {{ color: inherit; text-decoration: none; border: 1px solid #ccc; border-radius: 6px; }}
a:hover, a:focus {{ border-color: #0072b2; box-shadow: 0 0 0 1px #0072b2; }}
img {{ display: block; width: 100%; height: 200px; object-fit: contain; padding: 8px;
  box-sizing: border-box; }}
p {{ margin: 0; padding: 0 12px 10px; }}
strong {{ display: block; }}
small {{ color: #555; }}
</style></head>
<body><h1>Robots of chasles</h1>
{sections}
</body>
</html>
"""
SECTION = "<h2>{heading}</h2>\n<main>\n{cards}\n</main>"
CARD = """\
<a href="{name}.html"><img src="{name}.svg" alt="Drawing of {title}">
<p><strong>{title}</strong><small>{name} &middot; {axes}<br>{inverse}</small></p></a>"""


def main() -> int:
    """Write the pages of all robots, and return 0."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    names = chasles.robots() + (chasles.shelf_robots() if "shelf" in sys.argv[1:] else [])
    cards: dict[str, list[str]] = {"Arms": [], "Robots with loops": []}
    for name in names:
        robot = chasles.load(name)
        page = OUTPUT / f"{name}.html"
        write_html(robot, page)
        _draw(robot, page.with_suffix(".svg"))
        cards["Robots with loops" if robot.loops else "Arms"].append(_card(robot))
        print(page.relative_to(ROOT))
    sections = [
        SECTION.format(heading=heading, cards="\n".join(own))
        for heading, own in cards.items()
        if own
    ]
    index = OUTPUT / "index.html"
    index.write_text(INDEX.format(sections="\n".join(sections)), encoding="utf-8")
    print(index.relative_to(ROOT))
    return 0


def _draw(robot: chasles.Robot, file: Path) -> None:
    """Draw a planar robot in its plane, and any other robot obliquely from above."""
    try:
        figure = chasles.draw(robot, views=("plane",), file=file)
    except chasles.InputValueError:
        figure = chasles.draw(robot, views=("axonometric",), file=file)
    plt.close(figure)


def _card(robot: chasles.Robot) -> str:
    """Return the entry of the robot in the index."""
    own = ROBOTS / f"{robot.name}.toml"
    found = explain(read(own if own.is_file() else ROBOTS / "shelf" / own.name))
    structure = found.line.removeprefix("inverse: ") if found.max_solutions else "iterated inverse"
    return CARD.format(
        name=robot.name,
        title=html.escape(robot.title),
        axes=f"{robot.n} {'axes' if robot.n > 1 else 'axis'}",
        inverse=html.escape(structure),
    )


if __name__ == "__main__":
    sys.exit(main())
