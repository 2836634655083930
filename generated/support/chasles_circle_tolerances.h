/* Tolerances for the roots of trigonometric polynomials. This file is part of chasles and is the
 * same for every robot. */
#ifndef CHASLES_CIRCLE_TOLERANCES_H
#define CHASLES_CIRCLE_TOLERANCES_H

/* Two close complex roots are tried as real roots if half the distance between the two roots [rad]
 * is below this value. */
#define CHASLES_NEARLY_REAL 1e-3
/* Maximum size [rad] of the last Newton step to a root of the determinant. Further Newton steps
 * would only change rounding errors. */
#define CHASLES_ROOT_FOUND 1e-9
/* A Taylor series is recomputed if the sum of its absolute coefficients is less than this multiple
 * of its rounding error. */
#define CHASLES_BLURRED 1e5
/* If two roots of the determinant are closer than this distance [rad], rounding errors may exchange
 * the null vectors of the matrix at these roots. */
#define CHASLES_TWINS 1e-3
/* The sign of a polynomial value is uncertain if the magnitude of the value is below this multiple
 * of its rounding error. */
#define CHASLES_UNSURE 10.0
/* If the sign of a polynomial at an interval end is uncertain, the search assumes two roots with
 * this imaginary part [rad]. */
#define CHASLES_EDGE 1e-4
/* If the error [rad] of a root of the determinant exceeds this value, the root may represent
 * several roots. */
#define CHASLES_DOUBT 3e-4

#endif
