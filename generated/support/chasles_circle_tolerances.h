/* Tolerances for the roots of trigonometric polynomials. This file is part of chasles and is the
 * same for every robot. */
#ifndef CHASLES_CIRCLE_TOLERANCES_H
#define CHASLES_CIRCLE_TOLERANCES_H

/* Two complex roots are tried as real roots if half their distance [rad] is below this value. A
 * residual of 1e-9 separates a double root into two roots at a distance of 1e-4. */
#define CHASLES_NEARLY_REAL 1e-3
/* Size [rad] of the last Newton step to a root of the determinant. Further steps would only change
 * rounding errors. */
#define CHASLES_ROOT_FOUND 1e-9
/* A Taylor series is recomputed if the polynomial is less than this multiple of its error (five
 * digits). */
#define CHASLES_BLURRED 1e5
/* Distance [rad] below which two roots of the determinant may have exchanged their null vectors. */
#define CHASLES_TWINS 1e-3
/* The sign of the polynomial is uncertain below this multiple of its error. */
#define CHASLES_UNSURE 10.0
/* Half the distance [rad] of two roots with an uncertain sign between them. */
#define CHASLES_EDGE 1e-4
/* Error [rad] from which a root of the determinant may represent several roots. */
#define CHASLES_DOUBT 3e-4

#endif
