/* Tolerances for Newton's iteration on loops, with lengths relative to the robot size and angles in
 * radians. This file is part of chasles and is the same for every robot.
 */
#ifndef CHASLES_CLOSURE_TOLERANCES_H
#define CHASLES_CLOSURE_TOLERANCES_H

/* Largest residual at which loops count as closed. Rounding errors are a thousand times smaller. */
#define CLOSURE_CLOSED 1e-12
/* Step size at which the iteration counts as converged, because the next step would be about its
 * square. */
#define CLOSURE_SETTLED 1e-8
/* If the ratio of successive steps is above this value, the start was too far away. By the
 * Newton-Kantorovich theorem, a unique nearby solution exists if the Kantorovich constant is below
 * 1/2. The ratio of two successive steps is about half of the Kantorovich constant. */
#define CLOSURE_CONTRACTION 0.2
/* Maximum ratio of successive steps if the equations are redundant. Redundant equations have no
 * determinant that distinguishes the branches. */
#define CLOSURE_CAREFUL 0.05
/* If the first step is larger than this value, the start was too far away. */
#define CLOSURE_FARTHEST 0.5
/* Minimum step as a fraction of the path (12 halvings). If the iteration needs steps below this
 * value, a singularity is near. */
#define CLOSURE_SHORTEST 0.000244140625
/* Maximum number of steps of one iteration; with quadratic contraction, 6 steps are enough. */
#define CLOSURE_STEPS 8
/* Number of steps at an intermediate point of the path; the second step shows whether the iteration
 * contracts. */
#define CLOSURE_FEW_STEPS 2
/* Maximum number of linear solves per call, which bounds the run time. */
#define CLOSURE_MAX 240
/* Largest leg residual at which a pose counts as reached; this value accepts poses with seven
 * digits. */
#define CLOSURE_ON_LEGS 1e-7
/* If the pose of the forward kinematics deviates from the pose of the legs by more than this value,
 * the two poses belong to different assembly modes. Assembly modes closer than this value are next
 * to a singularity, where rounding of the coordinates moves the pose by 1e-8 or more. */
#define CLOSURE_SAME_MODE 1e-4

#endif
