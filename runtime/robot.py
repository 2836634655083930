"""The robot class: manifest data and generated functions as attributes."""

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
from .velocity.singular_directions import SingularDirectionMethods
from .velocity.track import TrackMethods


class Robot(
    InverseMethods,
    NearestMethods,
    NumericMethods,
    PlatformMethods,
    SingularDirectionMethods,
    TrackMethods,
    VelocityMethods,
):
    """A generated robot with its data and functions.

    The functions are attributes (`robot.fk(q)`), and robots differ in their functions. `dir(robot)`
    lists the attributes of a robot, `robot.functions` holds the functions by name, and each
    function has its own help text (`help(robot.fk)`). A Robot is immutable, and robots with equal
    manifests are equal.

    All functions share one call convention. Leading dimensions broadcast. Integers and other floats
    become float64; booleans, complex numbers and strings raise `InputTypeError`, a wrong shape
    raises `ShapeError`. NaN and infinity propagate without a warning. `out=` receives the results,
    as an array or a tuple of arrays. Output arrays may overlap the inputs. `threads=` sets the
    number of threads for a large batch ("all": one per core). Calls with dask arrays return lazy
    dask arrays.

    Attributes:
        name: The robot name, as passed to `load`.
        title: A descriptive name.
        kind: "serial", "hybrid" (the loops have a closed form), "platform" or "iterated". For
            "platform", only the actuated coordinates follow from the main chain in closed form; the
            opposite direction needs iteration. For "iterated", both directions need iteration.
        source: The source of the robot description.
        n: Number of actuated coordinates, the length of `q`.
        coordinates: The coordinates, in the order of `q`.
        lower: (n,) lower limits [rad or m], -inf for none.
        upper: (n,) upper limits [rad or m], inf for none.
        dof: Degrees of freedom; fewer than n only for redundantly actuated robots.
        limits: (n, 2) lower and upper limits of q.
        joint_limits: (n_theta, 2) lower and upper limits of `theta`, the joints of the main chain.
        coordinate_names: The coordinate names, in the order of `q`.
        joint_names: The joint names of the main chain, in the order of `theta`.
        base_frame: The name of the base frame.
        tip_frame: The name of the tool frame.
        link_names: The link names, in the order of `link_poses`.
        parameters: The named parameters of the robot description, keyed by name.
        geometry: The parameters of the parametric functions, in the order of the input `p`. The
            tuple is empty if the robot has no parametric functions.
        notes: Remarks on the description, for example about rounded values.
        cleaning: The values of the robot description that were replaced by exact values.
            `cleaning.position` [m] and `cleaning.orientation` [rad] are bounds on the change of the
            tool pose.
        functions: The generated functions by name, including intermediate functions.
        labels: The branch of each solution index, keyed by the name of the function or method, as
            in `robot.labels["ik"]` and `robot.labels["chain_branches"]`.
        redundancy: The name, index in q, unit and meaning of each redundancy parameter (for
            `fixed=`). A swivel angle has the index None.
        free_coordinates: The names of the coordinates that the inverse of a task sets to 0, as in
            `robot.free_coordinates["position"]`.
        loops: The loop names, or () for a serial robot.
        loop_solution: How the loops are solved: "closed form", "newton", or "" without loops.
        chain_joints: The joints of the main chain, in the order of `theta`.
        passive_joints: The joints that are neither actuated nor in the main chain.
        configuration_variables: All loop variables, in the order of `z`.
        reference: The configuration that selects the branch, or None without loops.
        manifest: The complete manifest, with the bodies of the robot.
        folder: The folder of the generated files.
        digest: SHA-256 of the manifest, which covers all equations.
    """

    def __init__(self, manifest: Manifest) -> None:
        """Load the functions of a manifest, after compilation if the cache lacks them.

        Raises:
            ChaslesError: If the functions cannot be compiled or loaded; the message states why.
        """
        if not isinstance(manifest, Manifest):
            hint = 'call chasles.load("arm.urdf", base=..., tip=...)'
            raise InputTypeError(f"Robot: expected a manifest, got {manifest!r}; {hint}")
        pickler = _pickler(manifest)
        functions = load_functions(manifest, pickler, Robot)
        vars(self).update(manifest=manifest, functions=MappingProxyType(functions))
        vars(self).update({name: functions[name] for name in self._public})
        nearest = nearest_function(self, pickler("ik_nearest"))
        vars(self).update({} if nearest is None else {"ik_nearest": nearest})

    def __dir__(self) -> list[str]:
        """Return the attributes that this robot has."""
        return [name for name in super().__dir__() if not lacks(self, name)]

    def __setattr__(self, name: str, value: object) -> NoReturn:
        """Raise an error, because a robot cannot be changed."""
        raise AttributeError(f"a Robot is immutable: cannot set {name!r}", name=name, obj=self)

    def __delattr__(self, name: str) -> NoReturn:
        """Raise an error, because a robot cannot be changed."""
        raise AttributeError(f"a Robot is immutable: cannot delete {name!r}", name=name, obj=self)

    def __repr__(self) -> str:
        """Return the title, the coordinates and the functions."""
        coordinates = ", ".join(f"{c.name} [{c.unit}]" for c in self.coordinates)
        functions = ", ".join(self._public)
        title = "" if self.title == self.name else f"{self.title}; "
        return f"<Robot {self.name}: {title}q = ({coordinates}); {functions}>"

    def __eq__(self, other: object) -> bool:
        """Test whether two robots have the same manifest."""
        return self.digest == other.digest if isinstance(other, Robot) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.digest)

    def __reduce__(self) -> tuple[Callable[..., Robot], tuple[str, str]]:
        """Pickle the folder and the digest; unpickling loads the robot from its folder."""
        return _restore, (_address(self.folder), self.digest)


def _address(folder: Path) -> str:
    installed = shipped_folders().get(folder.name) == folder or is_of_shelf(folder)
    return folder.name if installed else str(folder.absolute())


def _restore(address: str, digest: str) -> Robot:
    folder = find_folder(address)
    manifest = read_manifest(folder)
    if manifest.digest != digest:
        raise MismatchError(f"{folder}: the folder differs from the pickled robot {manifest.name}")
    return Robot(manifest)


@functools.cache
def _restore_once(address: str, digest: str) -> Robot:
    """Restore and cache a robot, because dask sends the robot with every chunk of an array."""
    return _restore(address, digest)


def _restore_function(address: str, digest: str, name: str) -> Any:
    robot = _restore_once(address, digest)
    return robot.functions.get(name) or getattr(robot, name)


def _pickler(manifest: Manifest) -> Callable[[str], tuple[Any, ...]]:
    address = _address(manifest.folder)
    return lambda name: (_restore_function, (address, manifest.digest, name))
