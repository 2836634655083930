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
/* rad, parts of the length: coordinates of solutions closer than this are one. Double solutions
 * differ by about 1e-8. */
#define CHASLES_SAME 1e-6
/* m, rad: residual beyond which a pose may be out of reach, and slow steps are given up. */
#define CHASLES_NEAR 1e-4
/* Added to pivots that may be 0; rows are of order 1, and rounding leaves about 1e-16 of them. */
#define CHASLES_PIVOT_FLOOR 1e-30
/* Part of the determinant's greatest coefficient that its errors may be: six digits remain. */
#define CHASLES_NOISE 1e-6
/* The determinant, of entries of order 1, where it may vanish for every angle but for rounding;
 * unless its errors are a smaller part of it than those of what rounding alone leaves. Of an arm
 * that is 1e-3 off a structure for which it vanishes, it may be 1e-20 and good to twelve digits. */
#define CHASLES_VANISHED 1e-15
#define CHASLES_CLEAN 1e-9
/* Residual, in parts of the length and its square, of the equations beside the six at a root that
 * is a solution: single ones leave 1e-8, other roots 0.01 and more. */
#define CHASLES_SOLVES_ALL 1e-4
/* Least pivot of the equations of the pair over the greatest, where they are not singular: rounding
 * leaves 1e-16. */
#define CHASLES_TELLS 1e-9
/* rad^2: square of an angle so small that its series ends with its third power. */
#define CHASLES_SMALL_TURN 1e-7
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
