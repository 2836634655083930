/* Tolerances for a wrist on a platform: name, value, unit and reason. This file is part of chasles
 * and is the same for every robot.
 */
#ifndef CHASLES_CARRIED_WRIST_TOLERANCES_H
#define CHASLES_CARRIED_WRIST_TOLERANCES_H

/* Error of the polynomial's coefficients, which are sums of products of order 1. */
#define CHASLES_CARRIED_NOISE 4e-15
/* Maximum coefficient at which the polynomial counts as zero; the platform is then singular. */
#define CHASLES_CARRIED_VANISHED 1e-12
/* Maximum distance of a ball from its plane, relative to its distance from the wrist center. */
#define CHASLES_CARRIED_CLOSED 1e-12
/* Distance of a ball from its plane, in the same unit, at which the iteration ends. */
#define CHASLES_CARRIED_POLISHED 1e-15
/* Maximum rotation per step [rad]; a larger rotation may reach another solution. */
#define CHASLES_CARRIED_STEP 0.3
/* Two rotations are equal if their entries differ by less than this value. Near a double root, the
 * distances change with the squared rotation, so smaller differences are not resolved. */
#define CHASLES_CARRIED_SAME 1e-7

#endif
