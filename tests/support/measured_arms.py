"""Random arms near a nominal arm, and their simulated measurements."""

from typing import NamedTuple

import numpy as np

from chasles import se3


class Truth(NamedTuple):
    """A random arm, a measuring device and its targets on the tool."""

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


def drawn(arm, seed, zero=0.0, count=60):
    """Return an arm with axis errors up to 1 mm or 1 mrad, and offset errors up to `zero` rad."""
    random = np.random.default_rng(seed)
    p = np.array([g.value for g in arm.geometry])
    off = np.array([g.part in ("axis", "tool") for g in arm.geometry])
    p[off] += random.uniform(-1e-3, 1e-3, off.sum())
    T_W_base = se3.exp(random.normal(size=6) * 2)
    q = random.uniform(-2.5, 2.5, (count, arm.n))
    zeros = np.array([g.part == "offset" and g.unit == "rad" for g in arm.geometry])
    p[zeros] += zero * random.uniform(-1, 1, zeros.sum())
    return Truth(p, T_W_base, random.uniform(-0.15, 0.15, (3, 3)), q)
