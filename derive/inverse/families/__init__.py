"""Families of chains with a closed-form inverse kinematics function, one file per family."""

from .column import COLUMN
from .crane import CRANE
from .family import Family
from .inner_center import INNER_CENTER
from .machine_tool import MACHINE_TOOL
from .orientation import ORIENTATION
from .oriented_slides import ORIENTED_SLIDES
from .parallel_forearm import PARALLEL_FOREARM
from .parallel_pair import PARALLEL_PAIR
from .planar import PLANAR
from .position import POSITION
from .spherical_wrist import SPHERICAL_WRIST
from .swivel import SWIVEL
from .telescopic_arm import TELESCOPIC_ARM
from .three_parallel import THREE_PARALLEL
from .turned_hand import TURNED_HAND
from .turning_hand import TURNING_HAND
from .turntable import TURNTABLE
from .universal_rod import UNIVERSAL_ROD

FAMILIES: tuple[Family, ...] = (
    PLANAR,
    ORIENTATION,
    PARALLEL_PAIR,
    POSITION,
    TURNTABLE,
    CRANE,
    TURNED_HAND,
    THREE_PARALLEL,
    SPHERICAL_WRIST,
    COLUMN,
    PARALLEL_FOREARM,
    INNER_CENTER,
    SWIVEL,
    MACHINE_TOOL,
    ORIENTED_SLIDES,
    TURNING_HAND,
    TELESCOPIC_ARM,
)
"""All arm families, in the order in which a chain is compared with them."""
LEG_FAMILIES = (*FAMILIES, UNIVERSAL_ROD)
"""Arm families with which a serial arm inside a loop, such as a leg of a platform, is compared."""
