"""One call and a batch from Python, beside Pinocchio; import and load."""

import subprocess
import sys
from collections.abc import Callable

import numpy as np

import chasles

from .report import alternated, out, ratios, save, table

ROUNDS = 7
CALLS = 20_000
BATCH = 100_000


def run() -> None:
    """Prints and saves all of it."""
    results: dict[str, object] = {"startup": startup()}
    try:
        import pinocchio as pin  # noqa: PLC0415
    except ImportError:
        out.print("Pinocchio is not installed (extra `crosscheck`): no comparison of calls")
    else:
        results["calls"] = calls(pin)
    save("calls", results)


def startup() -> dict[str, float]:
    """Seconds to import chasles beyond NumPy, and to load a robot that is in the cache."""
    chasles.load("ur5e")
    importing = _measured("import numpy", "import chasles")
    loading = _measured("import chasles", "chasles.load('ur5e')")
    table(
        "Start",
        ("what", "ms", "bar ms"),
        [("import beyond NumPy", importing * 1e3, 100), ("load ur5e", loading * 1e3, 20)],
    )
    return {"import": importing, "load": loading}


def _measured(before: str, statement: str) -> float:
    code = (
        f"import time\n{before}\nstart = time.perf_counter()\n{statement}\n"
        "print(time.perf_counter() - start)"
    )
    command = [sys.executable, "-c", code]
    runs = [subprocess.run(command, check=True, capture_output=True) for _ in range(5)]
    return min(float(done.stdout) for done in runs)


def calls(pin) -> dict[str, list[float]]:
    """Calls of fk and of fk with its Jacobian, against Pinocchio's on the same arm."""
    arm = chasles.load("ur5e")
    model, tool = _pinocchio_ur5e(pin)
    data = model.createData()
    q = np.random.default_rng(0).uniform(-3, 3, (BATCH, 6))
    one = q[0].copy()
    mixed = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def pin_fk() -> None:
        pin.forwardKinematics(model, data, one)
        pin.updateFramePlacement(model, data, tool)

    def pin_fk_jacobian() -> None:
        pin.computeFrameJacobian(model, data, one, tool, mixed)
        pin.updateFramePlacement(model, data, tool)

    pairs: dict[str, tuple[Callable[[], object], Callable[[], object], int]] = {
        "fk": (lambda: arm.fk(one), pin_fk, CALLS),
        "fk and Jacobian": (lambda: arm.fk_jacobian_mixed(one), pin_fk_jacobian, CALLS),
    }
    rows, found = [], {}
    for name, (own, peer, count) in pairs.items():
        times = alternated(
            {"chasles": _repeated(own, count), "Pinocchio": _repeated(peer, count)}, ROUNDS
        )
        median, smallest = ratios(times, "Pinocchio", "chasles")
        best = [min(times[who]) / count * 1e9 for who in ("chasles", "Pinocchio")]
        rows.append((name, *best, median, smallest))
        found[name] = [*best, median, smallest]
    batch = min(alternated({"chasles": lambda: arm.fk(q)}, ROUNDS)["chasles"]) / BATCH * 1e9
    rows.append(("fk, batch, a pose", batch, "", "", ""))
    table(
        "UR5e from Python, one thread",
        ("call", "chasles ns", "Pinocchio ns", "median ratio", "least"),
        rows,
    )
    return found


def _repeated(work: Callable[[], object], count: int) -> Callable[[], None]:
    def repeat() -> None:
        for _ in range(count):
            work()

    return repeat


def _pinocchio_ur5e(pin):
    half = np.pi / 2
    rows = [
        (0.1625, 0, half),
        (0, -0.425, 0),
        (0, -0.3922, 0),
        (0.1333, 0, half),
        (0.0997, 0, -half),
        (0.0996, 0, 0),
    ]
    model, parent, placement = pin.Model(), 0, pin.SE3.Identity()
    for k, (d, a, alpha) in enumerate(rows):
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"j{k}")
        placement = pin.SE3(pin.utils.rotate("x", alpha), np.array([a, 0, d]))
    frame = pin.Frame("tool", parent, 0, placement, pin.FrameType.OP_FRAME)
    return model, model.addFrame(frame)
