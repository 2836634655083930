"""``python tests/runtime/view/show_all.py FOLDER N [PICTURES]``: the pages of many robots.

The shipped robots, the shelf, the URDFs and robot files of a folder and N random mechanisms are shown
in a Chromium. Each page must load without a word in its console, and its bodies must be where the robot's own
functions put them, after moves of all sliders. Prints the size of each page, the time in which it
computes a frame, the largest distance of a body, and what is wrong; pictures go into a folder.
"""

import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))
STEPS = 4
AT_ONCE = 30
"""Sliders are moved this often for the time of a frame."""


def robots(folder, count, kept):
    """A name and a function that loads the robot, for each."""
    import chasles
    from bench.cases.drawn_mechanisms import drawn_mechanism
    from chasles.derive import derive, write

    def drawn(seed):
        target = kept / f"m{seed}"
        write(derive(drawn_mechanism(seed).mechanism), target)
        return chasles.load(next(target.rglob("manifest.json")).parent)

    for name in (*chasles.robots(), *chasles.shelf_robots()):
        yield name, lambda name=name: chasles.load(name)
    for path in sorted(folder.glob("*.urdf")):
        yield path.stem, lambda path=path: chasles.load(path)
    for path in sorted(folder.glob("*.toml")):
        yield path.stem, lambda path=path: chasles.load(path)
    for seed in range(count):
        yield f"mechanism {seed}", lambda seed=seed: drawn(seed)


def judged(browser, robot, kept):
    """Bytes of the page, milliseconds of a frame, the largest distance, and complaints."""
    from pages import coordinates, on_page, opened, walk

    from chasles.view.display import Display

    display = Display(robot)
    file = opened(browser, kept, robot)
    size, far = display.skeleton.size, 0.0
    for posture in walk(display, STEPS, seed=1):
        assert browser.run(f"setCoordinates({posture.q.tolist()})"), "a loop does not close"
        assert np.abs(coordinates(browser) - posture.q).max() < 1e-9, "another posture"
        off = np.abs(on_page(browser) - posture.bodies)
        far = max(far, off[:, :3, :3].max(), off[:, :3, 3].max() / size)
    ms = browser.run(
        f"""(() => {{
      const q = coordinates(), begin = performance.now();
      for (let k = 1; k <= {AT_ONCE}; k++) {{
        kinematics.moveTo(q.map((v, i) => v + 0.003 * (k % 2) * (robot.sliders[i].upper -
          robot.sliders[i].lower) * (v > (robot.sliders[i].lower + robot.sliders[i].upper) / 2
          ? -1 : 1)));
        kinematics.poses();
      }}
      return (performance.now() - begin) / {AT_ONCE};
    }})()"""
    )
    browser.run("document.getElementById('home').click()")
    return file.stat().st_size, ms, far, browser.complaints()


def main(folder, count, pictures=None):
    """Shows all; returns how many pages are wrong."""
    from chromium import Chromium

    kept = Path(tempfile.mkdtemp())
    browser = Chromium(shutil.which("chromium"), kept / "profile")
    shown, wrong, most = 0, 0, np.zeros(3)
    for name, loaded in robots(Path(folder), int(count), kept):
        shown += 1
        begin = time.perf_counter()
        try:
            size, ms, far, said = judged(browser, loaded(), kept)
            most = np.maximum(most, (size, ms, far))
            word = f"{size / 1e6:.2f} MB {ms:6.2f} ms {far:.1e} {' '.join(said)}"
            bad = bool(said) or far > 1e-9
            if pictures:
                Path(pictures).mkdir(exist_ok=True)
                browser.picture(Path(pictures) / f"{name.replace(' ', '_')}.png")
        except Exception as error:
            word, bad = f"{type(error).__name__}: {error}", True
        wrong += bad
        took = time.perf_counter() - begin
        print(f"{name:<28} {'WRONG' if bad else 'well '} {word} ({took:.1f} s)", flush=True)
    browser.close()
    shutil.rmtree(kept)
    print(
        f"{shown} pages, {wrong} wrong; most: {most[0] / 1e6:.2f} MB, {most[1]:.2f} ms, {most[2]}"
    )
    return wrong


if __name__ == "__main__":
    raise SystemExit(bool(main(*sys.argv[1:])))
