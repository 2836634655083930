/* Tolerances of the inverse of arms that nearly have a structure: name, value, unit and reason;
 * part of chasles, the same for every such robot. Poses differ by the larger of a distance (m) and
 * an angle (rad).
 */
#ifndef CHASLES_POLISH_TOLERANCES_H
#define CHASLES_POLISH_TOLERANCES_H

/* m, rad: residual at which the iteration ends: rounding of forward kinematics is a tenth of it. */
#define POLISH_CLOSED 1e-14
/* m, rad: residual below which a step without gain is the last: only rounding is left. */
#define POLISH_SETTLED 1e-12
/* m, rad: residual up to which a slot is a solution, as the runtime judges it. */
#define POLISH_SOLVED 1e-9
/* Coordinates (m, rad) of solutions closer than this are one. Double solutions differ by 1e-8. */
#define POLISH_SAME 1e-6
/* The same of a slot whose residual stays above POLISH_SETTLED: its pose is at the border of reach,
 * where a residual of 1e-9 leaves coordinates unsure by its root. */
#define POLISH_SAME_AT_BORDER 1e-4
/* Entries of R R^T - 1 up to which R is a rotation that a pose may have: those of poses in double
 * precision are some 1e-15, in single precision 1e-7. */
#define POLISH_RIGID 1e-9
/* Least trace of the turn from tool to pose plus 1, that is near half a turn: steps stay finite. */
#define POLISH_HALF_TURN 1e-3
/* m, rad: a coordinate moves no further in a step: further away lies another branch. */
#define POLISH_STEP 0.3
/* m, rad: length of a step, and how many steps after it, up to which the equations of that step
 * serve: each shortens the error to about this part. */
#define POLISH_SHORT 1e-3
#define POLISH_MOST_AGAIN 3
/* Bend of what the tool of an arm with fewer joints than freedoms reaches, over the square of a
 * step (radian, parts of the arm's length): two turning joints make a bend of 1 at most. */
#define POLISH_BEND 8.0
/* Least pivot of a step's equations over their damping, at which the step is as long as without. */
#define POLISH_UNDAMPED 100.0
/* Damping over the squared error in steps from a nominal solution. */
#define POLISH_DAMPING 0.1
/* Least damping: squares of singular values are known to 1e-16. */
#define POLISH_LEAST_DAMPING 1e-15
/* Damping over the squared error above which no step helps: the least residual is reached. */
#define POLISH_MOST_DAMPING 1e6
/* Steps of which some are halved, near a dead point: along it, 77 of them were seen. Part of a step
 * that is too short to help: the least residual is reached, or the border of what loops close. */
#define POLISH_MOST_HALVED 150
#define POLISH_LEAST_PART 1e-4
/* Part of the squared error that a step has to leave at most, so that the iteration goes on. */
#define POLISH_SLOW 0.95

/* Displacement (m, rad) of the tool for so many deviations of the axes, in radians and in parts of
 * the arm's length. Not less than 1e-6, for rounding near a singularity leaves 1e-8. */
#define POLISH_DEVIATIONS(count) \
    ((count) * POLISH_DEVIATION * (POLISH_LENGTH > 1.0 ? POLISH_LENGTH : 1.0) + 1e-6)
/* Residual of the nominal arm up to which the true arm might reach a pose: several axes differ. */
#define POLISH_REACH POLISH_DEVIATIONS(POLISH_UNSURE)
/* Residual of the nominal arm up to which its coordinates are a start for a curve, which may lead
 * within reach. */
#define POLISH_START POLISH_DEVIATIONS(30.0)
/* Square of an error (radian, parts of the length) of a start that is on the branch of the true
 * loops: ten deviations, of which one was the largest of a hundred starts within the limits. */
#define POLISH_ON_BRANCH (100.0 * POLISH_DEVIATION * POLISH_DEVIATION)
/* m, rad: residual up to which the nominal arm reaches a pose: rounding near a singularity. */
#define POLISH_FOLD 1e-7
/* Root of a pivot of J J^T, in deviations, below which branches may lie anywhere: a joint that
 * turns by less than this angle from a singularity of the nominal arm may be at one of the true
 * arm. More where few poses are so near, up to 0.01 rad. */
#define POLISH_UNSURE \
    (POLISH_DEVIATION > 2.5e-3 ? 4.0 : POLISH_DEVIATION < 2.5e-4 ? 40.0 : 0.01 / POLISH_DEVIATION)
/* Deviation (radian, parts of the length) times the first step (radian) over the cube of the true
 * arm's least singular value, up to which a branch has no other solution than that to which it
 * leads: of 1469 poses of six arms with errors of 1 to 5 mm and mrad at which one had, none was
 * below. More where no three axes nearly meet: of 300,000 poses of six such arms three had one. */
#define POLISH_SWERVED (POLISH_MEETS ? 310.0 : 1300.0)
/* Size of the displacements of poses around, in deviations: more than the arms differ by. */
#define POLISH_AROUND 2.5
/* Half the length of a line of poses, in deviations: at its ends the nominal arm is as far from a
 * singularity as two arms are not that differ so much. */
#define POLISH_LINE 8.0
/* Longest stride along a curve: of coordinates (radian), and share of half the line. Solutions that
 * are closer together are found from a touch. */
#define POLISH_STRIDE 0.12
#define POLISH_SHARE 0.3
/* Share of half the line up to which an extremum may hide two solutions. */
#define POLISH_TOUCH 0.3
/* Error (radian, parts of the arm's length) before a correction at which a curve is lost. */
#define POLISH_OFF_CURVE 0.05

/* Steps from a nominal solution, of which each doubles the digits; steps from a crossing; strides
 * along a curve; directions of lines, and those that are tried where a solution is known. */
#define POLISH_STEPS 6
#define POLISH_MOST_STEPS 30
#define POLISH_MOST_STRIDES 60
#define POLISH_WAYS 6
#define POLISH_FEW_WAYS 2

/* rad: the bend at a fold is measured so far beside it. */
#define POLISH_BESIDE 0.03
/* Bend at a fold (1/rad), in deviations, up to which the deviation may have made it: where joints
 * turn together without moving the tool, there is no bend at all. */
#define POLISH_FLAT 8.0
/* The same where there is no solution; and square of the slope over the terms with the lack, from
 * which the nearest place is far from the fold's own and the bend may differ there. */
#define POLISH_FLAT_BESIDE 40.0
#define POLISH_TILTED 0.1
/* rad: way from a fold to its solutions, and step beside that way, up to which an equation of
 * second order tells how many there are. */
#define POLISH_LONGEST 0.5
#define POLISH_SIDEWAYS 0.1
/* Part of a step's square that a second one is taken to leave at least. */
#define POLISH_SQUARED 0.01
/* Part of the squared error of a singular place that is in the direction that the Jacobian lacks,
 * below which the error is not: at a fold it is all of it. */
#define POLISH_ASIDE 0.01
/* Part of the terms of this equation's discriminant that their errors may be. */
#define POLISH_CLEAR 0.3
/* Root of a pivot (rad) and residual up to which a branch may be beside a second singularity though
 * the nominal arm misses the pose by far; and their product (m, rad) for a deviation of 1: the
 * nearer the second singularity, the further the deviation moves the fold. Up to ten deviations
 * from the pose the root may be NEARER, in deviations. */
#define POLISH_SECOND 0.02
#define POLISH_FARTHEST POLISH_DEVIATIONS(60.0)
#define POLISH_AMPLIFIED (0.25 * (POLISH_LENGTH > 1.0 ? POLISH_LENGTH : 1.0))
#define POLISH_NEARER 4.0

#endif
