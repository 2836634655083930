"""Assembly modes of random six-rod platforms agree with Newton's method.

Each platform is of one of four kinds: general, flat, 6-3 or 3-3. A 6-3 platform has three double
joints on the moving platform. A 3-3 platform has three double joints on the moving platform and
three on the base. The rod lengths are computed from a random platform pose. The C solver must find
all assembly modes that multi-start Newton iteration finds, with correct rod lengths.
"""

import ctypes
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from chasles.derive.emit.c.header import support
from chasles.derive.emit.c.written import SUPPORTS
from chasles.derive.loops.modes.hexapod import NO_JOINTS, HexapodTables, RodNumbers, double_joints
from chasles.derive.loops.modes.hexapod_starts import starts
from tests.support.native import Source, compiled

from .campaign import Campaign, Outcome

OF_EACH_KIND, STARTS = 2, 2_000
"""Number of platforms per kind and trial, and number of Newton starts per platform."""
KINDS = ("6-6", "flat", "6-3", "3-3")
WRONG, SAME, REGULAR = 1e-10, 1e-6, 1e-5
"""Maximum rod length error, maximum distance at which two modes count as equal, and minimum
Jacobian determinant of a regular mode."""
NEWTON = Path(__file__).parents[1] / "support" / "native" / "rods_newton.c"
AXES = (2, 1, 0)
SHIM = """
#include "chasles_hexapod.h"
static void given(const double *q, double *a, double *l)
{
    memcpy(a, q, 18 * sizeof *a), memcpy(l, q + 18, 6 * sizeof *l);
}
__attribute__((visibility("default"))) void modes(
    chasles_hexapod_platform *platform, const double *q, double *theta, double *margin,
    double *unsure)
{
    platform->rods = given;
    chasles_hexapod_modes(platform, q, theta, margin, unsure);
}
"""


@cache
def library() -> ctypes.CDLL:
    files = {name: support(name) for name in SUPPORTS["hexapod"]}
    source = Source("platform_modes", {"modes.c": SHIM, **files}, ())
    return ctypes.CDLL(str(compiled(source)))


class Platform(ctypes.Structure):
    """``chasles_hexapod_platform`` in C."""

    _fields_ = (
        ("rods", ctypes.c_void_p),
        ("size", ctypes.c_double),
        ("origin", ctypes.c_double * 3),
        ("middle", ctypes.c_double * 3),
        ("axis", ctypes.c_int * 3),
        ("moves", ctypes.c_int),
        ("paths", ctypes.c_int),
        ("joined", ctypes.c_int),
        ("pairs", ctypes.c_int * 6),
        ("b", ctypes.c_double * 18),
        ("a", ctypes.c_double * 36),
        ("c", ctypes.c_double * 12),
        ("starts", ctypes.c_double * 640),
    )


@dataclass(frozen=True)
class Judged:
    """Comparison of the assembly modes of a six-rod platform with Newton's method.

    Attributes:
        missed: Number of assembly modes that only Newton's method finds.
        wrong: Number of assembly modes whose rod lengths are wrong.
        more: Number of nonsingular assembly modes that only the C solver finds.
        unsure: Whether the list of complex-valued solutions may be incomplete.
        modes: Number of assembly modes found by the C solver.
    """

    missed: int
    wrong: int
    more: int
    unsure: bool
    modes: int


def trial(number: int) -> Outcome:
    rng = np.random.default_rng(number)
    kinds = KINDS * OF_EACH_KIND
    found = [judged(*random_rods(kind, rng), STARTS, rng) for kind in kinds]
    failures = [
        f"platform {k}, {kind}: {j.missed} missed, {j.wrong} wrong"
        for k, (kind, j) in enumerate(zip(kinds, found, strict=True))
        if j.missed or j.wrong
    ]
    counts = {
        "platforms": len(found),
        "modes": sum(j.modes for j in found),
        "modes that Newton's iteration does not find": sum(j.more for j in found),
        "unsure platforms": sum(j.unsure for j in found),
    }
    return Outcome(counts, tuple(failures), {"modes of a platform": max(j.modes for j in found)})


def random_rods(kind: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rod ends a (base) and b (platform) (6, 3), and rod lengths (6,) at a random pose."""
    a = rng.normal(size=(6, 3))
    b = rng.normal(size=(6, 3)) * rng.uniform(0.3, 1)
    if kind == "flat":
        a[:, 2] = b[:, 2] = 0
    if kind in ("6-3", "3-3"):
        b = b[[0, 0, 1, 1, 2, 2]]
    if kind == "3-3":
        a = a[[0, 1, 1, 2, 2, 0]]
    e = rng.normal(size=4)
    p = rng.normal(size=3)
    d = p + b @ rotations(e[None] / np.linalg.norm(e))[0].T - a
    return a, b, np.linalg.norm(d, axis=1)


def judged(
    a: np.ndarray,
    b: np.ndarray,
    lengths: np.ndarray,
    count: int,
    rng: np.random.Generator,
) -> Judged:
    """Compare the assembly modes of a platform with the poses that Newton's method finds."""
    theta, unsure = modes(a, b, lengths)
    own_e, own_p = quaternions(theta), theta[:, :3]
    left, _ = excess(a, b, lengths, own_e, own_p)
    e, p = newton(a, b, lengths, count, rng)
    _, J = excess(a, b, lengths, e, p)
    regular = np.abs(np.linalg.det(J)) > REGULAR
    e, p = e[regular], p[regular]
    there = _apart(own_e, own_p, e, p) < SAME
    _, J_own = excess(a, b, lengths, own_e, own_p)
    singular = np.abs(np.linalg.det(J_own)) <= REGULAR
    return Judged(
        int((~there.any(0)).sum()),
        int((np.abs(left).max(1, initial=0.0) > WRONG).sum()),
        int((~there.any(1) & ~singular).sum()),
        unsure > 0,
        len(theta),
    )


def modes(a: np.ndarray, b: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, float]:
    found = solved(numbered(a, b, lengths), a, lengths)
    return found.theta[np.isfinite(found.margin)], found.unsure


@dataclass(frozen=True)
class Solved:
    """Results of the C solver: joints (n, 6), margins (n,) and ``unsure``."""

    theta: np.ndarray
    margin: np.ndarray
    unsure: float


def numbered(
    a: np.ndarray, b: np.ndarray, usual: np.ndarray, *, eliminates: bool = True
) -> Platform:
    """Return the parameters of a six-rod platform as a C structure."""
    joints = double_joints(a.tolist(), b.tolist()) if eliminates else NO_JOINTS
    drawn = np.random.default_rng(0).uniform(0.8, 1.2, (12, 6)) * usual
    rods = RodNumbers(np.tile(a, (12, 1, 1)), b, drawn)
    tables = HexapodTables.of(rods, AXES, joints, *starts(rods.family))
    platform = Platform()
    for name, kind in Platform._fields_[1:]:
        flat = np.asarray(getattr(tables, name)).ravel()
        setattr(platform, name, flat[0].item() if flat.size == 1 else kind(*flat.tolist()))
    return platform


def solved(platform: Platform, a: np.ndarray, lengths: np.ndarray) -> Solved:
    n = platform.paths
    theta, margin, unsure = np.empty((n, 6)), np.empty(n), np.empty(1)
    q = np.concatenate([a.ravel(), lengths])
    pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (q, theta, margin, unsure)]
    library().modes(ctypes.byref(platform), *pointers)
    return Solved(theta, margin, float(unsure[0]))


def newton(
    a: np.ndarray, b: np.ndarray, lengths: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct modes (quaternions, positions) that Newton finds from random poses."""
    e = rng.normal(size=(count, 4))
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    # At the start poses, the distance between the ends of the first rod equals the rod length.
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    p = a[0] + lengths[0] * direction - rotations(e) @ b[0]
    arrays = [np.ascontiguousarray(values) for values in (a, b, lengths, e, p)]
    *rods, starts_e, starts_p = (array.ctypes.data_as(ctypes.c_void_p) for array in arrays)
    closes = ctypes.c_double(WRONG / 100)
    count_found = _newton_library().rods_newton(*rods, count, starts_e, starts_p, closes)
    return _distinct(arrays[3][:count_found], arrays[4][:count_found])


@cache
def _newton_library() -> ctypes.CDLL:
    return ctypes.CDLL(str(compiled(Source("rods_newton", {NEWTON.name: NEWTON.read_text()}))))


def _distinct(e: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    kept_e, kept_p = np.empty((0, 4)), np.empty((0, 3))
    while len(e):
        kept_e, kept_p = np.vstack([kept_e, e[:1]]), np.vstack([kept_p, p[:1]])
        others = _apart(e[:1], p[:1], e, p)[0] > SAME
        e, p = e[others], p[others]
    return kept_e, kept_p


def _apart(e1: np.ndarray, p1: np.ndarray, e2: np.ndarray, p2: np.ndarray) -> np.ndarray:
    """Return distances (n1, n2) of modes: the larger of position and orientation difference."""
    one, other = e1[:, None], e2[None]
    turned = np.minimum(np.abs(one - other).max(-1), np.abs(one + other).max(-1))
    return np.asarray(np.maximum(turned, np.abs(p1[:, None] - p2[None]).max(-1)))


def excess(
    a: np.ndarray, b: np.ndarray, lengths: np.ndarray, e: np.ndarray, p: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return rod length errors (n, 6) and their derivatives with respect to a twist."""
    r = b @ np.swapaxes(rotations(e), 1, 2)
    d = p[:, None] + r - a
    distance = np.linalg.norm(d, axis=-1)
    n = d / distance[..., None]
    return distance - lengths, np.concatenate([n, np.cross(r, n)], -1)


def rotations(e: np.ndarray) -> np.ndarray:
    w, v = e[:, 0, None, None], e[:, 1:]
    zero = np.zeros(len(e))
    x, y, z = v.T
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    cross = np.moveaxis(np.array(rows), -1, 0)
    return np.asarray(np.eye(3) + 2 * w * cross + 2 * cross @ cross)


def quaternions(theta: np.ndarray) -> np.ndarray:
    e = np.tile([1.0, 0, 0, 0], (len(theta), 1))
    for k, axis in zip((3, 4, 5), AXES, strict=True):
        turn = np.zeros((len(theta), 4))
        turn[:, 0], turn[:, 1 + axis] = np.cos(theta[:, k] / 2), np.sin(theta[:, k] / 2)
        e = _product(e, turn)
    return e


def _product(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    scalar = x[:, 0] * y[:, 0] - (x[:, 1:] * y[:, 1:]).sum(1)
    vector = x[:, :1] * y[:, 1:] + y[:, :1] * x[:, 1:] + np.cross(x[:, 1:], y[:, 1:])
    return np.concatenate([scalar[:, None], vector], 1)


CAMPAIGN = Campaign(
    "platforms",
    "The modes of a random platform on six rods include all that Newton's iteration finds.",
    trial,
)
