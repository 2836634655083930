"""Opens HTML pages of robots in a browser, and evaluates JavaScript expressions on the pages."""

import json

import numpy as np

from chasles.view import write_html
from chasles.view.display import Display
from chasles.view.mailed_page import page_data
from chasles.view.slider_units import slider_units


def walk(display: Display, steps: int, seed: int, part: float = 0.1) -> list:
    """Return configurations along a random path within the slider ranges."""
    units = slider_units(display.robot, display.start.q)
    lower, upper = (np.array([getattr(u, end) for u in units]) for end in ("lower", "upper"))
    rng, found = np.random.default_rng(seed), [display.start]
    for _ in range(20 * steps):
        step = part * (upper - lower) * (rng.random(len(units)) - 0.5)
        displayed = display.at(np.clip(found[-1].q + step, lower, upper), found[-1])
        found += [displayed] if displayed.closes else []
        if len(found) > steps:
            return found[1:]
    raise AssertionError(f"robot {display.robot.name}: found no path with closed loops")


def opened(browser, folder, robot):
    file = folder / f"{robot.name}.html"
    write_html(robot, file)
    browser.open(file.as_uri())
    return file


def asked(browser, display: Display, script: str):
    """Evaluate a JavaScript expression with the objects `k` (kinematics) and `inverse`."""
    data = json.dumps(page_data(display.robot))
    before = f"const k = new Kinematics({data}), inverse = new Inverse(k);"
    return browser.run(f"(() => {{ {before} return {script}; }})()")


def on_page(browser) -> np.ndarray:
    """Return the poses (bodies, 4, 4) of the drawn objects."""
    columns = np.array(browser.run("bodies.map((body) => body.matrixWorld.elements)"), dtype=float)
    return columns.reshape(-1, 4, 4).transpose(0, 2, 1)


def coordinates(browser) -> np.ndarray:
    return np.array(browser.run("coordinates()"), dtype=float)


def message(browser) -> str:
    return browser.run("document.getElementById('message').textContent")
