/* Tolerances of planar platforms on three rods: name, value, unit and reason; part of chasles, the
 * same for every such robot.
 */
#ifndef CHASLES_TRIAD_TOLERANCES_H
#define CHASLES_TRIAD_TOLERANCES_H

/* Errors of the polynomial's coefficients: they are sums of products of order 1. */
#define CHASLES_TRIAD_NOISE 4e-15
/* Greatest coefficient of a polynomial that vanishes but for rounding: the rods can stay parallel.
 */
#define CHASLES_TRIAD_VANISHED 1e-12
/* Parts of the platform's size: error in the length of a rod up to which a pose is a mode. */
#define CHASLES_TRIAD_CLOSED 1e-12
/* The same, at which Newton's steps have nothing left to gain. */
#define CHASLES_TRIAD_POLISHED 1e-15
/* rad: angle that a step may turn by: further away lies another mode. */
#define CHASLES_TRIAD_STEP 0.3
/* rad: distance up to which roots are looked for beside others where rounding may hide some. */
#define CHASLES_TRIAD_BESIDE 2e-2
/* Parts of the platform's size, and rad, below which two modes are one: at a double root the
 * lengths, which change with the square of the distance, determine no more digits. */
#define CHASLES_TRIAD_SAME 1e-7

#endif
