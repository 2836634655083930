/* Tolerances for a parallel platform with further joints before its legs or on the platform, each
 * with its name, value, unit and reason. This file is part of chasles and is the same for every
 * robot. */
#ifndef CHASLES_CARRIED_TOLERANCES_H
#define CHASLES_CARRIED_TOLERANCES_H

/* Rounding error of a polynomial's coefficients, relative to 1 plus the largest coefficient. */
#define CHASLES_CARRIED_NOISE 4e-15

/* Tolerances for the solver in chasles_carried_arm.h. */

/* A polynomial counts as zero if it is below this fraction of the product of the sizes of its
 * factors. If the polynomial is zero for all angles, the joints have a self-motion. */
#define CHASLES_ARM_VANISHED 1e-13
/* With three unknown joints, a solution is accepted only if each ball joint is within this distance
 * (relative to the mechanism size) of its plane. */
#define CHASLES_ARM_CLOSED 1e-12
/* With fewer than three unknown joints, the equations of a pose are redundant. With redundant
 * equations, a solution is accepted only if each ball joint is within this distance (relative to
 * the mechanism size) of its plane. */
#define CHASLES_ARM_NEAR 1e-2
/* Newton's iteration starts only if each ball joint is at most this distance from its plane. */
#define CHASLES_ARM_TRIED 0.1
/* Newton's iteration ends if each ball joint is at most this distance from its plane. */
#define CHASLES_ARM_POLISHED 1e-16
/* Maximum change of an unknown per Newton step [rad, or relative to the mechanism size], because a
 * larger change may reach another solution. */
#define CHASLES_ARM_STEP 0.3
/* Two solutions are equal if their unknown joints differ by less than this value (rad, or relative
 * to the mechanism size). Near a double root, a difference of 1e-6 changes the residual only by
 * about 1e-12. */
#define CHASLES_ARM_SAME 1e-6

/* Tolerances for a wrist on a platform. */

/* If all coefficients of the polynomial are at most this value, the polynomial counts as zero and
 * the platform is singular. */
#define CHASLES_WRIST_VANISHED 1e-12
/* Maximum distance of a ball joint from its plane in a solution, relative to the distance of the
 * ball joint from the wrist center. */
#define CHASLES_WRIST_CLOSED 1e-12
/* Newton's iteration ends at this distance of a ball joint from its plane, relative to the distance
 * of the ball joint from the wrist center. */
#define CHASLES_WRIST_POLISHED 1e-15
/* Maximum rotation per Newton step [rad], because a larger rotation may reach another solution. */
#define CHASLES_WRIST_STEP 0.3
/* Two rotations are equal if their matrix entries differ by less than this value. */
#define CHASLES_WRIST_SAME 1e-7

#endif
