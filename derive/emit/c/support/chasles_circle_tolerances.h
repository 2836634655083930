/* Tolerances for roots of trigonometric polynomials: name, value, unit and reason. This file is
 * part of chasles and is the same for every robot.
 */
#ifndef CHASLES_CIRCLE_TOLERANCES_H
#define CHASLES_CIRCLE_TOLERANCES_H

/* Two complex roots are tried as real roots if half their distance [rad] is smaller. A residual of
 * 1e-9 separates a double root by 1e-4. */
#define CHASLES_NEARLY_REAL 1e-3
/* Size [rad] of the last Newton step to a root of the determinant; the next step would be rounding.
 */
#define CHASLES_ROOT_FOUND 1e-9
/* An interval is recomputed if the ratio of the polynomial to its error is below this value (five
 * digits). */
#define CHASLES_BLURRED 1e5
/* Below this distance [rad], two roots of the determinant may have exchanged null vectors. */
#define CHASLES_TWINS 1e-3
/* The sign of the polynomial is uncertain up to this ratio of the polynomial to its error. */
#define CHASLES_UNSURE 10.0
/* Half distance [rad] of two roots with an uncertain sign of the polynomial between them. */
#define CHASLES_EDGE 1e-4
/* Above this error [rad], a root of the determinant may represent several roots. */
#define CHASLES_DOUBT 3e-4

#endif
