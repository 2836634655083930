"""A five-bar in Pinocchio as an open tree with a closure constraint.

Newton's method solves the constraint. The constraint Jacobian gives the rates,
``J_passive z' = -J_actuated q'``. The code is specific to the five-bar. The code uses only the
constraint rows in the plane of the five-bar. Newton's method starts each pose from the previous
configuration.
"""

import numpy as np
import pinocchio as pin

CLOSED = 1e-12
"""The iteration stops at this residual [m]."""
CORRECTIONS = 20
MIXED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
ACTUATED, PASSIVE = slice(0, 4, 2), slice(1, 4, 2)


class FiveBar:
    """Two cranks and two couplers, with a common pin at the tool.

    Attributes:
        z: Angles of left crank, left elbow, right crank and right elbow [rad]. The next iteration
            starts from these angles.
        corrections: Number of Newton steps that have corrected the elbow angles.
    """

    def __init__(self, w: float, a: float, b: float, z: np.ndarray) -> None:
        """Build the tree, the constraint and the tool.

        Args:
            w: Half the distance of the base joints [m].
            a: Length of the cranks [m].
            b: Length of the couplers [m].
            z: A configuration at which the loop nearly closes.
        """
        self.model, pivot = pin.Model(), _shift(b)
        left, right = (self._leg(x, a) for x in (-w, w))
        frame = pin.Frame("tool", left, 0, pivot, pin.FrameType.OP_FRAME)
        self.tool = self.model.addFrame(frame)
        kind, local = pin.ContactType.CONTACT_3D, pin.ReferenceFrame.LOCAL
        self.closure = pin.RigidConstraintModel(kind, self.model, left, pivot, right, pivot, local)
        self.data, self.closed = self.model.createData(), self.closure.createData()
        self.z, self.corrections = np.array(z), 0
        self.z_D_q = np.zeros((4, 2))
        self.z_D_q[ACTUATED] = np.eye(2)

    def _leg(self, x: float, a: float) -> int:
        crank = self.model.addJoint(0, pin.JointModelRZ(), _shift(x), f"crank at {x}")
        return self.model.addJoint(crank, pin.JointModelRZ(), _shift(a), f"elbow at {x}")

    def close(self, q: np.ndarray) -> np.ndarray:
        """Close the loop at crank angles q. Return the constraint Jacobian (3, 4)."""
        model, data, closure, closed, z = self.model, self.data, self.closure, self.closed, self.z
        z[ACTUATED] = q
        for _ in range(CORRECTIONS):
            pin.computeJointJacobians(model, data, z)
            closure.calc(model, data, closed)
            J = pin.getConstraintJacobian(model, data, closure, closed)
            gap = closed.c1Mc2.translation
            if abs(gap[0]) < CLOSED and abs(gap[1]) < CLOSED:
                return J
            z[PASSIVE] += np.linalg.solve(J[:2, PASSIVE], gap[:2])
            self.corrections += 1
        raise ArithmeticError(f"the loop does not close at q = {q}")

    def fk_jacobian(self, q: np.ndarray) -> tuple[pin.SE3, np.ndarray]:
        """Return the tool pose and the mixed Jacobian (6, 2) with respect to q."""
        z_D_q = self._map(self.close(q))
        J = pin.getFrameJacobian(self.model, self.data, self.tool, MIXED)
        return pin.updateFramePlacement(self.model, self.data, self.tool), J @ z_D_q

    def velocity_map(self, z: np.ndarray) -> np.ndarray:
        """Return the map (4, 2) from crank rates to all joint rates."""
        pin.computeJointJacobians(self.model, self.data, z)
        return self._map(
            pin.getConstraintJacobian(self.model, self.data, self.closure, self.closed)
        )

    def _map(self, J: np.ndarray) -> np.ndarray:
        self.z_D_q[PASSIVE] = -np.linalg.solve(J[:2, PASSIVE], J[:2, ACTUATED])
        return self.z_D_q


def _shift(x: float) -> pin.SE3:
    return pin.SE3(np.eye(3), np.array([x, 0.0, 0.0]))
