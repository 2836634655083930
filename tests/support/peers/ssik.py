"""ssik (Srinivasa): generates a module for each arm.

The module calls compiled solvers.
"""

import hashlib
import importlib.util
from types import ModuleType

import numpy as np
from ssik import Manipulator
from ssik.core.codegen import emit_artifact

from tests.support.native import BUILD
from tests.support.oracles.screws import Screws
from tests.support.peers.interface import Inverse, aligned, offsets


def inverse(chain: Screws) -> Inverse | None:
    if len(chain.axes) not in (6, 7) or not chain.revolute.all():
        return None
    module = _generated(chain)

    def call(T: np.ndarray):
        return module.solve(T, respect_limits=False)

    return Inverse("ssik", call, _read, aligned(chain), lambda T: [call(pose) for pose in T])


def _generated(chain: Screws) -> ModuleType:
    P = offsets(chain)
    name = f"ssik_{hashlib.sha256(chain.axes.tobytes() + P.tobytes()).hexdigest()[:16]}"
    path = BUILD / f"{name}.py"
    if not path.exists():
        BUILD.mkdir(parents=True, exist_ok=True)
        arm = Manipulator.from_axes(chain.axes, P)
        emit_artifact(
            kb=arm.kinbody, plan=arm.dispatch_plan, module_name=name, output_path=str(path)
        )
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _read(found):
    return [solution.q for solution in found], [True] * len(found)
