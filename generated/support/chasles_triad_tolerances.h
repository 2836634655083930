/* Tolerances for planar platforms on three rods, each with its name, value, unit and reason. This
 * file is part of chasles and is the same for every robot. */
#ifndef CHASLES_TRIAD_TOLERANCES_H
#define CHASLES_TRIAD_TOLERANCES_H

/* Rounding error of the polynomial's coefficients, relative to 1 plus the largest coefficient. Each
 * coefficient is a sum of products of order 1. */
#define CHASLES_TRIAD_NOISE 4e-15
/* If all coefficients of the polynomial are at most this value, the polynomial counts as zero and
 * the rods can stay parallel. */
#define CHASLES_TRIAD_VANISHED 1e-12
/* Maximum rod length error of an assembly mode, relative to the platform size. */
#define CHASLES_TRIAD_CLOSED 1e-12
/* Newton's iteration of an assembly mode ends at this rod length error, relative to the platform
 * size. */
#define CHASLES_TRIAD_POLISHED 1e-15
/* Maximum rotation per Newton step [rad], because a larger rotation may reach another assembly
 * mode. */
#define CHASLES_TRIAD_STEP 0.3
/* Rounding errors may hide other roots within this distance [rad] of a root. */
#define CHASLES_TRIAD_SEARCHED 2e-2
/* Two assembly modes are equal if their positions (relative to the platform size) and angles [rad]
 * differ by less than this value. Near a double root, a difference of 1e-7 changes the rod lengths
 * only by about 1e-14. */
#define CHASLES_TRIAD_SAME 1e-7

#endif
