/* Tolerances for planar platforms on three rods: name, value, unit and reason. This file is part of
 * chasles and is the same for every robot.
 */
#ifndef CHASLES_TRIAD_TOLERANCES_H
#define CHASLES_TRIAD_TOLERANCES_H

/* Error of the polynomial's coefficients, which are sums of products of order 1. */
#define CHASLES_TRIAD_NOISE 4e-15
/* Largest coefficient of a polynomial that vanishes except for rounding: the rods can stay
 * parallel.
 */
#define CHASLES_TRIAD_VANISHED 1e-12
/* Relative to the platform size: largest rod length error of a mode. */
#define CHASLES_TRIAD_CLOSED 1e-12
/* Rod length error at which the iteration of a mode ends. */
#define CHASLES_TRIAD_POLISHED 1e-15
/* rad: maximum rotation per step; a larger rotation may reach another mode. */
#define CHASLES_TRIAD_STEP 0.3
/* rad: search distance around roots for other roots hidden by rounding. */
#define CHASLES_TRIAD_SEARCHED 2e-2
/* Two modes closer than this (relative to the platform size, and rad) are equal. At a double root,
 * rod lengths change with the squared distance and determine no more digits. */
#define CHASLES_TRIAD_SAME 1e-7

#endif
