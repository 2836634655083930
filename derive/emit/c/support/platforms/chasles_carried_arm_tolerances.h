/* Tolerances for joints before and on a platform: name, value, unit and reason. This file is part
 * of chasles and is the same for every robot.
 */
#ifndef CHASLES_CARRIED_ARM_TOLERANCES_H
#define CHASLES_CARRIED_ARM_TOLERANCES_H

/* Error of a polynomial's coefficients relative to its largest coefficient: rounding of products.
 */
#define CHASLES_ARM_NOISE 4e-15
/* A polynomial is zero if it is below this fraction of the product of its factors' sizes: the
 * joints then have a self-motion. */
#define CHASLES_ARM_VANISHED 1e-13
/* Maximum distance of a ball from its plane, relative to the size of the mechanism, if the pose
 * determines all unknown joints. */
#define CHASLES_ARM_CLOSED 1e-12
/* The same for poses with more conditions than unknown joints. Larger distances have no solution
 * nearby. */
#define CHASLES_ARM_NEAR 1e-2
/* Distance, in the same unit, up to which the iteration is tried. Most candidates of an elimination
 * are much nearer or much farther. */
#define CHASLES_ARM_TRIED 0.1
/* Distance at which the iteration ends. */
#define CHASLES_ARM_POLISHED 1e-16
/* Maximum change of an unknown per step [rad, or fraction of the size]; a larger change may reach
 * another solution. */
#define CHASLES_ARM_STEP 0.3
/* Two solutions are equal if their unknowns differ by less than this value. Near a double root, the
 * distances change with the squared difference, so smaller differences are not resolved. */
#define CHASLES_ARM_SAME 1e-6

#endif
