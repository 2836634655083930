/* Tolerances for roots of trigonometric polynomials: name, value, unit and reason. This file is
 * part of chasles and is the same for every robot.
 */
#ifndef CHASLES_CIRCLE_TOLERANCES_H
#define CHASLES_CIRCLE_TOLERANCES_H

/* rad: half distance of a complex root pair that may be real: a residual of 1e-9 separates a double
 * root by 1e-4. */
#define CHASLES_NEARLY_REAL 1e-3
/* rad: last step of a root of the determinant; the next Newton step would be rounding. */
#define CHASLES_ROOT_FOUND 1e-9
/* Ratio of the polynomial to its error below which an interval is recomputed: five digits. */
#define CHASLES_BLURRED 1e5
/* rad: closer roots of the determinant may have exchanged null vectors. */
#define CHASLES_TWINS 1e-3
/* Ratio of the polynomial to its error up to which its sign is uncertain. */
#define CHASLES_UNSURE 10.0
/* rad: half distance of two roots with an uncertain sign between them. */
#define CHASLES_EDGE 1e-4
/* rad: a root of the determinant with a larger error may be several roots. */
#define CHASLES_DOUBT 3e-4

#endif
