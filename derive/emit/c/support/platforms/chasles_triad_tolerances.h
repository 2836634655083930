/* Tolerances for planar platforms on three rods: name, value, unit and reason. This file is part of
 * chasles and is the same for every robot.
 */
#ifndef CHASLES_TRIAD_TOLERANCES_H
#define CHASLES_TRIAD_TOLERANCES_H

/* Error of the polynomial's coefficients, which are sums of products of order 1. */
#define CHASLES_TRIAD_NOISE 4e-15
/* Maximum coefficient of a polynomial that is zero except for rounding: the rods can then stay
 * parallel.
 */
#define CHASLES_TRIAD_VANISHED 1e-12
/* Maximum rod length error of an assembly mode, relative to the platform size. */
#define CHASLES_TRIAD_CLOSED 1e-12
/* Rod length error at which the iteration of an assembly mode ends. */
#define CHASLES_TRIAD_POLISHED 1e-15
/* Maximum rotation per step [rad]; a larger rotation may reach another assembly mode. */
#define CHASLES_TRIAD_STEP 0.3
/* Distance [rad] around a root in which other roots may be hidden by rounding. */
#define CHASLES_TRIAD_SEARCHED 2e-2
/* Below this difference (relative to the platform size, and rad), two assembly modes are equal. At
 * a double root, rod lengths change with the squared distance and determine no more digits. */
#define CHASLES_TRIAD_SAME 1e-7

#endif
