/* Tolerances for the roots of trigonometric polynomials, with name, value, unit and reason. This
 * file is part of chasles and is the same for every robot.
 */
#ifndef CHASLES_CIRCLE_TOLERANCES_H
#define CHASLES_CIRCLE_TOLERANCES_H

/* Two complex roots are tried as real roots if half their distance [rad] is below this value. A
 * residual of 1e-9 separates the two roots of a double root by 1e-4. */
#define CHASLES_NEARLY_REAL 1e-3
/* Size [rad] of the last Newton step to a root of the determinant; a further step would only change
 * rounding errors. */
#define CHASLES_ROOT_FOUND 1e-9
/* The series of an interval is recomputed if the ratio of the polynomial to its error is below this
 * value (five digits). */
#define CHASLES_BLURRED 1e5
/* Two roots of the determinant that are closer together than this value [rad] may have exchanged
 * null vectors. */
#define CHASLES_TWINS 1e-3
/* The sign of the polynomial is uncertain if the ratio of the polynomial to its error is below this
 * value. */
#define CHASLES_UNSURE 10.0
/* Half the distance [rad] of two roots between which the sign of the polynomial is uncertain. */
#define CHASLES_EDGE 1e-4
/* A root of the determinant whose error [rad] is above this value may represent several roots. */
#define CHASLES_DOUBT 3e-4

#endif
