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
 * twice the ratio of successive steps, is below 1/2. */
#define CLOSURE_CONTRACTION 0.2
/* If the closure equations are redundant, CLOSURE_CAREFUL is the maximum size of a Newton step
 * relative to the previous step. CLOSURE_FARTHEST is the maximum size of the first Newton step,
 * whether or not the closure equations are redundant. */
#define CLOSURE_CAREFUL 0.05
#define CLOSURE_FARTHEST 0.5
/* Minimum path step as a fraction of the complete path (12 halvings). If shorter path steps are
 * necessary, a singularity is near. */
#define CLOSURE_SHORTEST 0.000244140625
/* Maximum number of steps of one Newton iteration. With quadratic contraction, 6 Newton steps are
 * enough. */
#define CLOSURE_STEPS 8
/* Number of Newton steps at an intermediate point of the path. The second Newton step shows whether
 * the iteration contracts. */
#define CLOSURE_FEW_STEPS 2
/* Maximum number of linear solves per call, which bounds the run time. */
#define CLOSURE_MAX 240
/* Largest leg residual at which a pose counts as reached. This tolerance accepts poses that are
 * given with seven digits. */
#define CLOSURE_ON_LEGS 1e-7
/* Maximum deviation between the pose from the forward kinematics and the pose from the legs, if
 * both poses belong to the same assembly mode. The poses of two assembly modes are closer than this
 * tolerance only near a singularity. Near a singularity, rounding of the coordinates moves the pose
 * by 1e-8 or more. */
#define CLOSURE_SAME_MODE 1e-4

#endif
