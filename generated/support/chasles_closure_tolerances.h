/* Tolerances of Newton's iteration on loops: lengths in parts of the robot's size, angles in
 * radians; part of chasles, the same for every robot. */
#ifndef CHASLES_CLOSURE_TOLERANCES_H
#define CHASLES_CLOSURE_TOLERANCES_H

/* Residual up to which the loops are closed: a thousand times the rounding of the equations. */
#define CLOSURE_CLOSED 1e-12
/* Last step of an iteration that has converged: the next would be about its square. */
#define CLOSURE_SETTLED 1e-8
/* Ratio of successive steps above which the start was too far away: by the theorem of Newton and
 * Kantorovich, below 1/2 the solution nearby exists and is unique; the ratio is about half of its
 * number, which is estimated from two steps only. */
#define CLOSURE_CONTRACTION 0.2
/* The same where equations repeat others, and no determinant tells the branches apart. */
#define CLOSURE_CAREFUL 0.05
/* First step above which a start counts as too far away, whatever follows. */
#define CLOSURE_FARTHEST 0.5
/* Share of the way below which no solution is sought, 12 halvings: a singularity is that near. */
#define CLOSURE_SHORTEST 0.000244140625
/* Most steps of one iteration: at that contraction, squared each time, 6 are enough. */
#define CLOSURE_STEPS 8
/* Steps that bring a point of the way near its branch: the second shows whether they contract. */
#define CLOSURE_FEW_STEPS 2
/* Most solutions of the linear system in one call, which bounds its time. */
#define CLOSURE_MOST 240
/* Residual of the legs up to which a pose is reached: a pose of seven digits. */
#define CLOSURE_ON_LEGS 1e-7
/* Deviation of the forward kinematics from a pose that the legs reach above which it is another
 * assembly mode. Two modes that are closer are next to a singularity, where rounding of the
 * coordinates alone moves the pose by 1e-8, its square root, and more. */
#define CLOSURE_SAME_MODE 1e-4

#endif
