/* Tolerances for a platform with joints before or on it: name, value, unit and reason. This file is
 * part of chasles and is the same for every robot.
 */
#ifndef CHASLES_CARRIED_TOLERANCES_H
#define CHASLES_CARRIED_TOLERANCES_H

/* Error of a polynomial's coefficients relative to 1 and to its largest coefficient: rounding of
 * products. */
#define CHASLES_CARRIED_NOISE 4e-15

/* Joints before and on a platform. */

/* A polynomial is zero if it is below this fraction of the product of its factors' sizes: the
 * joints then have a self-motion. */
#define CHASLES_ARM_VANISHED 1e-13
/* Solutions are accepted up to this distance of a ball joint from its plane, relative to the size
 * of the mechanism. This value is used if the pose determines all unknown joints. */
#define CHASLES_ARM_CLOSED 1e-12
/* Maximum distance of a ball from its plane, relative to the size of the mechanism, if a pose has
 * more conditions than unknown joints. If the distance exceeds this value, there is no solution
 * nearby. */
#define CHASLES_ARM_NEAR 1e-2
/* Distance, in the same unit, up to which the iteration is tried. For most candidates of an
 * elimination, the distance is much smaller or much larger than this value. */
#define CHASLES_ARM_TRIED 0.1
/* The iteration ends if the distance of each ball joint from its plane is at most this value. */
#define CHASLES_ARM_POLISHED 1e-16
/* Maximum change of an unknown per step [rad, or fraction of the size]; a larger change may reach
 * another solution. */
#define CHASLES_ARM_STEP 0.3
/* Two solutions are equal if their unknown joints differ by less than this value (rad, or relative
 * to the size). Near a double root, a difference of 1e-6 changes the residual only by about 1e-12.
 */
#define CHASLES_ARM_SAME 1e-6

/* A wrist on a platform. */

/* Maximum coefficient at which the polynomial counts as zero; the platform is then singular. */
#define CHASLES_WRIST_VANISHED 1e-12
/* Maximum distance of a ball from its plane, relative to its distance from the wrist center. */
#define CHASLES_WRIST_CLOSED 1e-12
/* Distance of a ball from its plane, in the same unit, at which the iteration ends. */
#define CHASLES_WRIST_POLISHED 1e-15
/* Maximum rotation per step [rad]; a larger rotation may reach another solution. */
#define CHASLES_WRIST_STEP 0.3
/* Two rotations are equal if their entries differ by less than this value. Near a double root, a
 * difference in rotation of 1e-6 changes the distances only by about 1e-12. */
#define CHASLES_WRIST_SAME 1e-7

#endif
