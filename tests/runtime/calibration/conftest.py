"""An arm with parametric functions, and measurements of a drawn arm near it."""

from typing import NamedTuple

import numpy as np
import pytest
from derivations import ROBOTS

import chasles
from chasles import screws
from chasles.derive import load, write
from chasles.derive.chain.parametric import PARAMETRIC


@pytest.fixture(scope="session")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parametric") / "ur5e"
    write(load(ROBOTS / "ur5e.toml"), folder, ["fk", *PARAMETRIC])
    return chasles.load(folder)


class Truth(NamedTuple):
    """A drawn arm, the device's frame and the targets on the tool."""

    p: np.ndarray
    T_W_base: np.ndarray
    targets: np.ndarray
    q: np.ndarray

    def poses(self, arm, q):
        return self.T_W_base @ arm.fk_p(q, self.p)

    def positions(self, arm, q):
        T = self.poses(arm, q)
        turned = np.einsum("nij,mj->nmi", T[:, :3, :3], self.targets)
        return T[:, None, :3, 3] + turned


@pytest.fixture
def truth(arm, request):
    """Axes and tool off by up to 1 mm and 1 mrad, 60 configurations."""
    random = np.random.default_rng(getattr(request, "param", 0))
    p = np.array([g.value for g in arm.geometry])
    off = np.array([g.part in ("axis", "tool") for g in arm.geometry])
    p[off] += random.uniform(-1e-3, 1e-3, off.sum())
    T_W_base = screws.exp(random.normal(size=6) * 2)
    q = random.uniform(-2.5, 2.5, (60, arm.n))
    return Truth(p, T_W_base, random.uniform(-0.15, 0.15, (3, 3)), q)
