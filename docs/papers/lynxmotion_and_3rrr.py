"""Teaching arm, planar 3-RRR platform and roadmap.

Y. Li, S. Kang: Serial and Parallel Robot Kinematics. Coursework report, University of the West of
England, 2021.

    $ python docs/papers/lynxmotion_and_3rrr.py

Part 1 is in lynxmotion_arm.py, part 2 in platform_3rrr.py, part 3 in roadmaps.py; their pictures
are in lynxmotion_pictures.py and platform_pictures.py.
"""

from __future__ import annotations

import lynxmotion_arm
import lynxmotion_pictures
import platform_3rrr
import platform_pictures
import roadmaps
from report import Figures, Row, read, show


def rows() -> list[Row]:
    """Compare every number that the report prints with the value that chasles computes."""
    printed = read("lynxmotion_and_3rrr")
    return [
        *lynxmotion_arm.rows(printed),
        *platform_3rrr.rows(printed),
        *roadmaps.rows(printed),
    ]


def figures() -> Figures:
    """Draw figures 1.1 to 3.4, and animate the motions."""
    return {**lynxmotion_pictures.figures(), **platform_pictures.figures()}


if __name__ == "__main__":
    show(rows())
