"""Tests the HTML pages of many robots: ``python tests/apps/view/show_all.py FOLDER N [PICTURES]``.

The script tests the shipped robots, the arms that are derived on first use, the robot files in a
folder, and N random mechanisms. Each page must load without console messages. The script moves all
sliders, and compares the body poses with the robot's functions. The script also drags the tool
handle back and forth, and checks that the tool follows.

The script prints page sizes, branch counts, frame times, the largest errors and all failures for
each robot. The pictures are written to a folder.
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
CLOSED = 1e-9
"""Maximum error of the directions and positions in body poses and tool poses. Position errors are
relative to the robot's size."""
FRAMES = 100
"""Number of frames over which the processor time is averaged."""
SEARCHED = 20.0
"""Maximum time (s) that a search for branches may take on a busy machine."""
SLID = """{
  const q = coordinates(), kept = kinematics.z.slice();
  const inwards = robot.sliders.map((s, i) =>
    0.003 * (s.upper - s.lower) * (q[i] > (s.lower + s.upper) / 2 ? -1 : 1));
  for (let k = 0; k < FRAMES; k++) {
    kinematics.moveTo(q.map((v, i) => v + (k % 2 ? inwards[i] : 0)));
    ghosts.follow(kinematics.z);
    kinematics.poses();
  }
  kinematics.z = kept;
}"""
DRAGGED = """{
  const kept = kinematics.z.slice(), goal = kinematics.toolPose(kinematics.frames(kept));
  for (let k = 0; k < FRAMES; k++) {
    goal[3] += 0.003 * robot.size * (k % 2 ? -1 : 1);
    kinematics.z = inverse.follow(kinematics.z, goal).z;
    ghosts.follow(kinematics.z);
    kinematics.poses();
  }
  kinematics.z = kept;
}"""


def robots(folder, count, kept):
    import chasles
    from chasles.derive import write
    from tests.support.generators.drawn_mechanisms import drawn_mechanism

    def drawn(seed):
        target = kept / f"m{seed}"
        write(drawn_mechanism(seed).mechanism, target, languages=("c", "python"))
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
    """Measure a displayed robot.

    Return the file size, the times per frame (ms) for slider moves and tool drags, and the number
    of ghosts (displayed solutions). Also return the pose error of the bodies, the error of the
    dragged tool, and the errors and warnings in the browser console.
    """
    from chasles.view.display import Display
    from tests.support.viewed_pages import coordinates, on_page, opened, walk

    display = Display(robot)
    file = opened(browser, kept, robot)
    size, far, missed = display.skeleton.size, 0.0, 0.0
    way = walk(display, STEPS, seed=1, part=0.04)
    for displayed in way:
        assert browser.run(f"setCoordinates({displayed.q.tolist()})"), "a loop does not close"
        assert np.abs(coordinates(browser) - displayed.q).max() < 1e-9, (
            "the page shows other joint positions"
        )
        off = np.abs(on_page(browser) - displayed.bodies)
        far = max(far, off[:, :3, :3].max(), off[:, :3, 3].max() / size)
    for displayed in reversed(way):
        at = browser.run(f"dragTo({displayed.tool.ravel().tolist()}, 'position')")
        missed = max(missed, at["position"], at["turn"])
    ghosts = searched(browser)
    times = [
        1000 * browser.processor_time(frames.replace("FRAMES", str(FRAMES))) / FRAMES
        for frames in (SLID, DRAGGED)
    ]
    return file.stat().st_size, *times, ghosts, far, missed, browser.complaints()


def searched(browser):
    end = time.monotonic() + SEARCHED
    while time.monotonic() < end and browser.run("ghosts.isSeeking"):
        time.sleep(0.1)
    return browser.run("ghosts.found.length")


def message(found):
    size, slid, dragged, ghosts, far, missed = found
    times = f"slider {slid:5.2f} ms, handle {dragged:5.2f} ms"
    return f"{size / 1e6:.2f} MB, {times}, {ghosts:2.0f} ghosts, off {far:.0e}, tool {missed:.0e}"


def main(folder, count, pictures=None):
    """Test all pages and return the number of failed pages."""
    from tests.support.chromium import Chromium

    kept = Path(tempfile.mkdtemp())
    browser = Chromium(shutil.which("chromium"), kept / "profile")
    shown, wrong, most = 0, 0, np.zeros(6)
    for name, loaded in robots(Path(folder), int(count), kept):
        shown += 1
        begin = time.perf_counter()
        try:
            *found, said = judged(browser, loaded(), kept)
            most = np.maximum(most, found)
            word = f"{message(found)} {' '.join(said)}"
            bad = bool(said) or max(found[-2:]) > CLOSED
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
