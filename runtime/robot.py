"""A robot in use: its facts, and its functions as attributes."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

from .call.capabilities import lacks
from .closed_form.assembly_modes import PlatformMethods
from .closed_form.nearest import NearestMethods, nearest_function
from .closed_form.paths import InverseMethods
from .contract import Manifest, MismatchError, read_manifest
from .errors import InputTypeError
from .iterative.numeric_inverse import NumericMethods
from .library import find_folder, is_of_shelf, shipped_folders
from .loading import load_functions
from .velocity.rates import VelocityMethods
from .velocity.singular_ways import SingularWayMethods
from .velocity.track import TrackMethods


class Robot(
    InverseMethods,
    NearestMethods,
    NumericMethods,
    PlatformMethods,
    SingularWayMethods,
    TrackMethods,
    VelocityMethods,
):
    """A generated robot: its facts and its functions.

    The functions are attributes (`robot.fk(q)`). Robots differ in their functions: `dir(robot)`
    lists what this one has, `robot.functions` holds its functions by name, and each has a help text
    of its own (`help(robot.fk)`). A Robot does not change, and robots with equal manifests are
    equal.

    All functions are called in the same way. Leading dimensions broadcast. Integers and other
    floats become float64; booleans, complex numbers and strings raise `InputTypeError`, a wrong
    shape raises `ShapeError`. NaN and infinity propagate without a warning. `out=` takes the array
    to write into, or a tuple of arrays, which may overlap the inputs. `threads=` splits a large
    batch over that many threads ("all": one per core). dask arrays give lazy dask arrays.

    Attributes:
        name: Its name, as given to `load`.
        title: Its name for people.
        kind: "serial"; "hybrid" with loops in closed form; "platform" with loops that are solved
            by iteration, while the actuated coordinates follow from the main chain in closed form;
            "iterated" where neither follows from the other in closed form.
        source: The origin of its description.
        n: Number of actuated coordinates, the length of `q`.
        coordinates: The coordinates, in the order of `q`.
        lower: (n,) lower limits [rad or m], -inf where there is none.
        upper: (n,) upper limits [rad or m], inf where there is none.
        dof: Number of freedoms, below n only for robots with more actuators than freedoms.
        limits: (n, 2) lower and upper limits of q.
        joint_limits: (n_theta, 2) lower and upper limits of `theta`, the joints of the main chain.
        coordinate_names: The names of the coordinates, in the order of `q`.
        joint_names: The names of the joints of the main chain, in the order of `theta`.
        base_frame: The name of the base frame.
        tip_frame: The name of the tool frame.
        link_names: The names of the links, in the order of `link_poses`.
        parameters: The named numbers of its description, by name.
        geometry: The numbers that its parametric functions take as `p`, in order; () where it was
            derived without them.
        notes: Remarks, such as numbers that were snapped.
        cleaning: The numbers of its description that were not taken as written, with bounds of
            their effect on the tool's pose: `cleaning.position` [m], `cleaning.orientation` [rad].
        functions: Its generated functions by name, intermediate ones too.
        labels: The branch in each slot, by the name of the function or method with slots:
            `robot.labels["ik"]`, `robot.labels["chain_branches"]`.
        redundancy: The parameters that choose one of infinitely many inverses, for `fixed=`:
            name, index in q (None for a swivel angle), unit and meaning of each.
        free_coordinates: The names of the coordinates that a task leaves at 0, by task:
            `robot.free_coordinates["position"]`.
        loops: The names of its loops; () for a serial robot.
        loop_solution: The solution of its loops: "closed form", "newton", or "" without loops.
        chain_joints: The joints of its main chain, in the order of `theta`; the coordinates for a
            serial robot.
        passive_joints: Its joints that are neither actuated nor in the main chain.
        configuration_variables: All variables of its loops, in the order of `z`.
        reference: The configuration that selects the branch, None without loops.
        manifest: Everything that its manifest states; further facts and its bodies.
        folder: The folder it was loaded from.
        digest: SHA-256 of its manifest, and so of all its equations.
    """

    def __init__(self, manifest: Manifest) -> None:
        """Makes the robot of a manifest, and compiles its functions if the cache lacks them.

        Args:
            manifest: The manifest.

        Raises:
            ChaslesError: If its functions cannot be compiled or loaded; the message states the
                reason.
        """
        if not isinstance(manifest, Manifest):
            hint = 'call chasles.load("arm.urdf", base=..., tip=...)'
            raise InputTypeError(f"Robot takes a manifest, got {manifest!r}; {hint}")
        pickler = _pickler(manifest)
        functions = load_functions(manifest, pickler, Robot)
        vars(self).update(manifest=manifest, functions=MappingProxyType(functions))
        vars(self).update({name: functions[name] for name in self._public})
        nearest = nearest_function(self, pickler("ik_nearest"))
        vars(self).update({} if nearest is None else {"ik_nearest": nearest})

    def __dir__(self) -> list[str]:
        """The attributes that this robot has."""
        return [name for name in super().__dir__() if not lacks(self, name)]

    def __setattr__(self, name: str, value: object) -> NoReturn:
        """Refuses: a robot does not change."""
        raise AttributeError(f"a Robot does not change: cannot set {name!r}", name=name, obj=self)

    def __delattr__(self, name: str) -> NoReturn:
        """Refuses: a robot does not change."""
        raise AttributeError(
            f"a Robot does not change: cannot delete {name!r}", name=name, obj=self
        )

    def __repr__(self) -> str:
        """Title, coordinates and functions."""
        coordinates = ", ".join(f"{c.name} [{c.unit}]" for c in self.coordinates)
        functions = ", ".join(self._public)
        title = "" if self.title == self.name else f"{self.title}; "
        return f"<Robot {self.name}: {title}q = ({coordinates}); {functions}>"

    def __eq__(self, other: object) -> bool:
        """Whether both have the same manifest."""
        return self.digest == other.digest if isinstance(other, Robot) else NotImplemented

    def __hash__(self) -> int:
        """The hash of the manifest's digest."""
        return hash(self.digest)

    def __reduce__(self) -> tuple[Callable[..., Robot], tuple[str, str]]:
        """Pickles folder and digest; the process that unpickles loads the robot by itself."""
        return _restore, (_address(self.folder), self.digest)


def _address(folder: Path) -> str:
    """The name of an installed robot, so that the pickle is valid on another machine too."""
    installed = shipped_folders().get(folder.name) == folder or is_of_shelf(folder)
    return folder.name if installed else str(folder.absolute())


def _restore(address: str, digest: str) -> Robot:
    folder = find_folder(address)
    manifest = read_manifest(folder)
    if manifest.digest != digest:
        raise MismatchError(f"{folder}: not the {manifest.name} that was pickled")
    return Robot(manifest)


@functools.cache
def _restore_once(address: str, digest: str) -> Robot:
    """As above, but once: a scheduler sends the same function with every piece of an array."""
    return _restore(address, digest)


def _restore_function(address: str, digest: str, name: str) -> Any:
    robot = _restore_once(address, digest)
    return robot.functions.get(name) or getattr(robot, name)


def _pickler(manifest: Manifest) -> Callable[[str], tuple[Any, ...]]:
    """From the name of a function to the value of its `__reduce__`."""
    address = _address(manifest.folder)
    return lambda name: (_restore_function, (address, manifest.digest, name))
