"""The command ``python tests/apps/drawing/draw_all.py FOLDER N`` draws many arms without compiling
them.

The arms come from the robot files in ``derive/robots/shelf``, from the URDF files of a folder and
from N random chains. Prints the arms with overlapping labels, and the number of drawings.
"""

import random
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))


def descriptions(folder, count):
    from chasles.derive import read
    from tests.support.chains import random_chain
    from tests.support.derivations import ROBOTS

    for path in (*sorted((ROBOTS / "shelf").glob("*.toml")), *sorted(folder.glob("*.urdf"))):
        yield path.stem, read(path)
    generator = random.Random(0)
    for k in range(count):
        yield f"random {k}", random_chain(generator, generator.randint(2, 8)).robot()


def main(folder, count):
    """Draw all arms and return the number of arms with overlapping labels."""
    from test_drawing import lettered, overlaps

    from tests.support.skeletons import described_skeleton

    drawn, bad = 0, 0
    for name, robot in descriptions(Path(folder), int(count)):
        found = overlaps(lettered(described_skeleton(robot)))
        drawn, bad = drawn + 1, bad + bool(found)
        if found:
            print(f"{name}: {found}", flush=True)
    print(f"{drawn} arms drawn, letters overlap on {bad}")
    return bad


if __name__ == "__main__":
    raise SystemExit(bool(main(*sys.argv[1:3])))
