/* Tolerances for Newton's iteration on loops: lengths relative to the robot size, angles in
 * radians. This file is part of chasles and is the same for every robot. */
#ifndef CHASLES_CLOSURE_TOLERANCES_H
#define CHASLES_CLOSURE_TOLERANCES_H

/* Largest residual of closed loops: a thousand times the rounding of the equations. */
#define CLOSURE_CLOSED 1e-12
/* Step size of a converged iteration: the next step would be about its square. */
#define CLOSURE_SETTLED 1e-8
/* Above this ratio of successive steps, the start was too far away. By the Newton-Kantorovich
 * theorem, a unique nearby solution exists if the Kantorovich constant is below 1/2. The ratio of
 * two steps is about half of this constant. */
#define CLOSURE_CONTRACTION 0.2
/* Ratio of successive steps for redundant equations. No determinant of these redundant equations
 * distinguishes the branches. */
#define CLOSURE_CAREFUL 0.05
/* A start whose first step is larger than this value is too far away. */
#define CLOSURE_FARTHEST 0.5
/* Minimum stride as a fraction of the path (12 halvings): if a smaller stride is required, a
 * singularity is near. */
#define CLOSURE_SHORTEST 0.000244140625
/* Maximum steps of one iteration: with quadratic contraction, 6 are enough. */
#define CLOSURE_STEPS 8
/* Number of steps at an intermediate point of the path: the second step shows the contraction. */
#define CLOSURE_FEW_STEPS 2
/* Maximum linear solves per call, which bounds the run time. */
#define CLOSURE_MAX 240
/* Largest leg residual of a reached pose; this value accepts poses with seven digits. */
#define CLOSURE_ON_LEGS 1e-7
/* Above this deviation of the forward kinematics from the legs' pose, the pose is another assembly
 * mode. Closer modes are next to a singularity, where rounding of the coordinates
 * alone moves the pose by 1e-8 or more. */
#define CLOSURE_SAME_MODE 1e-4

#endif
