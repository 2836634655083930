/* Tolerances for Newton's iteration on loops, with lengths relative to the robot size and angles in
 * radians. This file is part of chasles and is the same for every robot.
 */
#ifndef CHASLES_CLOSURE_TOLERANCES_H
#define CHASLES_CLOSURE_TOLERANCES_H

/* Largest residual at which loops count as closed. */
#define CLOSURE_CLOSED 1e-12
/* Maximum size of the last Newton step of a converged iteration. */
#define CLOSURE_SETTLED 1e-8
/* The size of a Newton step must be at most this fraction of the previous step. By the
 * Newton-Kantorovich theorem, a unique nearby solution exists if the Kantorovich constant, about
 * twice this ratio, is below 1/2. */
#define CLOSURE_CONTRACTION 0.2
/* If the equations are redundant, CLOSURE_CAREFUL is the maximum size of a step relative to the
 * previous step. CLOSURE_FARTHEST is the maximum size of the first step, whether or not the
 * equations are redundant. */
#define CLOSURE_CAREFUL 0.05
#define CLOSURE_FARTHEST 0.5
/* Minimum step as a fraction of the path (12 halvings). If the iteration needs shorter steps, a
 * singularity is near. */
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
/* Maximum deviation between the pose from the forward kinematics and the pose from the legs, if
 * both poses belong to the same assembly mode. With a larger deviation, the two poses belong to
 * different assembly modes. The poses of two assembly modes are closer than this value only near a
 * singularity. There, rounding of the coordinates moves the pose by 1e-8 or more. */
#define CLOSURE_SAME_MODE 1e-4

#endif
