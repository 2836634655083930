/* Tolerances of the inverse of general arms: name, value, unit and reason; part of chasles, the
 * same for every such robot. Poses differ by the larger of a distance (m) and an angle (rad).
 */
#ifndef CHASLES_GENERAL_TOLERANCES_H
#define CHASLES_GENERAL_TOLERANCES_H

/* m, rad: residual up to which a slot is a solution, as the runtime judges it. */
#define CHASLES_SOLVED 1e-9
/* m, rad: residual at which Newton's steps end: rounding of forward kinematics is a tenth of it. */
#define CHASLES_CLOSED 1e-14
/* m, rad: residual below which a step that does not help ends them: rounding may be in its way. */
#define CHASLES_NEARLY_CLOSED 1e-12
/* rad: coordinates of solutions closer than this are one. Double solutions differ by about 1e-8. */
#define CHASLES_SAME 1e-6
/* rad: half the way between complex roots up to which they may be real: with a residual of 1e-9
 * they are 1e-4 apart. */
#define CHASLES_NEARLY_REAL 1e-3
/* m, rad: residual beyond which a pose may be out of reach, and slow steps are given up. */
#define CHASLES_NEAR 1e-4
/* rad: the last step of a root of the determinant: Newton's next would be in rounding. */
#define CHASLES_ROOT_FOUND 1e-9
/* Added to pivots that may be 0; rows are of order 1, and rounding leaves about 1e-16 of them. */
#define CHASLES_PIVOT_FLOOR 1e-30
/* Part of the determinant's greatest coefficient that its errors may be: six digits remain. */
#define CHASLES_NOISE 1e-6
/* The determinant, of entries of order 1, where it may vanish for every angle but for rounding. */
#define CHASLES_VANISHED 1e-15
/* Ratio to errors of the polynomial, below which a part of it is computed anew: five digits. */
#define CHASLES_BLURRED 1e5
/* rad: roots of the determinant nearer than this may have the vectors of each other. */
#define CHASLES_TWINS 1e-3
/* Ratio of the polynomial to its errors up to which its sign is unsure. */
#define CHASLES_UNSURE 10.0
/* rad: half the way between two roots where the sign is unsure. */
#define CHASLES_EDGE 1e-4
/* rad^2: square of an angle so small that its series ends with its third power. */
#define CHASLES_SMALL_TURN 1e-7
/* rad: a root of the determinant that is known no better may be several. */
#define CHASLES_DOUBT 3e-4
/* Damping of Newton's steps, over the squares of J's entries: at first far from a solution and near
 * to one, where it is dropped, and where steps are given up. */
#define CHASLES_DAMPING_FAR 1e-5
#define CHASLES_DAMPING_NEAR 1e-14
#define CHASLES_DAMPING_DROPPED 1e-13
#define CHASLES_DAMPING_MOST 1e3
/* What is added to the diagonal of J^T J, whose eigenvector of the least eigenvalue is looked for.
 */
#define CHASLES_SHIFT 1e-10

#endif
