/* Tolerances of the roots of trigonometric polynomials: name, value, unit and reason; part of
 * chasles, the same for every robot.
 */
#ifndef CHASLES_CIRCLE_TOLERANCES_H
#define CHASLES_CIRCLE_TOLERANCES_H

/* rad: half the way between complex roots up to which they may be real: with a residual of 1e-9
 * they are 1e-4 apart. */
#define CHASLES_NEARLY_REAL 1e-3
/* rad: the last step of a root of the determinant: Newton's next would be in rounding. */
#define CHASLES_ROOT_FOUND 1e-9
/* Ratio to errors of the polynomial, below which a part of it is computed anew: five digits. */
#define CHASLES_BLURRED 1e5
/* rad: roots of the determinant nearer than this may have the vectors of each other. */
#define CHASLES_TWINS 1e-3
/* Ratio of the polynomial to its errors up to which its sign is unsure. */
#define CHASLES_UNSURE 10.0
/* rad: half the way between two roots where the sign is unsure. */
#define CHASLES_EDGE 1e-4
/* rad: a root of the determinant that is known no better may be several. */
#define CHASLES_DOUBT 3e-4

#endif
