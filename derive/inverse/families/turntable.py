"""One joint that turns an arm of three parallel axes, and perhaps one that turns the tool.

Axis 1, then axes 2, 3 and 4 parallel, then at most one more: four joints move the tool in four ways
(place, and the pitch in the plane of the arm), a fifth turns it about an axis of that plane. A pose
has six numbers: one that the arm cannot reach is answered by the nearest that these steps find.

Most solutions: 4 for a pose; 8 for place and pitch, which the tool may have from either side.
"""

from collections.abc import Sequence

import sympy as sp

from ...vectors import Vector, added, combination, cross, dot, subtracted
from ..lines import Axis, Lines
from ..requirement import Requirement, across, parallel, revolute
from ..subproblems.sp1 import sp1
from ..subproblems.sp4 import sp4
from ..target import Target
from ..turns import Turn, composed, direction, perpendicular, rotated
from ..work import Work
from .three_joints import triangle
