/* Tolerances for platforms on six rods: name, value, unit and reason. This file is part of chasles
 * and is the same for every robot. The pose coordinates are normalized. Lengths without a unit are
 * relative to the platform size.
 */
#ifndef CHASLES_HEXAPOD_TOLERANCES_H
#define CHASLES_HEXAPOD_TOLERANCES_H

/* Maximum first Newton correction after a path step; after a larger correction, another path may be
 * as near. */
#define CHASLES_PATH_NEAR 1e-4
/* If a path is lost or two paths have equal ends, the paths are repeated with smaller maximum
 * corrections: first with NEARER, then with NEAREST. */
#define CHASLES_PATH_NEARER 1e-6
#define CHASLES_PATH_NEAREST 1e-8
/* Maximum second Newton correction, about the square of the first correction. */
#define CHASLES_PATH_ON 1e-7
/* Initial step and maximum step along a path of length 1. */
#define CHASLES_PATH_FIRST 0.05
#define CHASLES_PATH_LONGEST 0.25
/* Minimum step along a path. If the step on a path towards a double solution would be smaller, the
 * rest of the path moves the pose by less than 1e-5. */
#define CHASLES_PATH_SHORTEST 1e-11
/* A lost path counts as ended if its remaining length is below this value. The last point of this
 * path is treated as a singular pose or a point at infinity. */
#define CHASLES_PATH_ALMOST 1e-6
/* Maximum value of 1 - |<x, y>|^2 for two equal path ends whose errors are 1e-13. */
#define CHASLES_ENDS_ARE_ONE 1e-16
/* Maximum value of 1 - |<x, y>|^2 for a complex path end x and a path end whose conjugate is y.
 * Path ends near a singularity have fewer valid digits. */
#define CHASLES_ENDS_ARE_PAIRED 1e-10
/* Maximum imaginary part of a candidate for a real pose; near a singularity, path ends have errors
 * of 1e-5. */
#define CHASLES_NEARLY_REAL_POSE 1e-3
/* Maximum distance between a path end and its refined real pose; it is the square root of the
 * closure tolerance, with a margin for singularities. */
#define CHASLES_SAME_END 1e-2
/* Maximum rod length error of an assembly mode, relative to the platform size. */
#define CHASLES_RODS_CLOSED 1e-12
/* Rod length error, relative to the platform size, at which the iteration of an assembly mode ends.
 */
#define CHASLES_RODS_POLISHED 1e-15
/* Two assembly modes are equal if they differ by less than this value (relative to the platform
 * size, and rad). Near a double solution, a difference of 1e-6 changes the rod lengths only by
 * about 1e-12. */
#define CHASLES_ONE_MODE 1e-6
/* A path end is at infinity if |e.e| is at most this value, where e are the Euler parameters of the
 * pose. No rotation has e.e = 0. */
#define CHASLES_AT_INFINITY 1e-9
/* Gimbal lock occurs if the middle angle differs from a quarter turn by an angle whose sine is
 * below this value; the two outer angles then count as dependent. */
#define CHASLES_GIMBAL 1e-12

/* Maximum error of the polynomial for rods with double joints, relative to the largest summands of
 * a sample. */
#define CHASLES_JOINT_NOISE 1e-14
/* If all coefficients are below this value, relative to the largest summands of a sample, the
 * polynomial is treated as zero. */
#define CHASLES_JOINT_VANISHED 1e-9
/* Minimum distance of two rod ends, minimum squared radius of a circle, and minimum sine of the
 * angle between two sides of the joint triangle. If a distance, radius or sine is below this value,
 * the circles of the joints are not computed. */
#define CHASLES_JOINTS_APART 1e-6
/* A negative value of sin^2 counts as 0 if its magnitude is at most this value. Otherwise, the
 * angle is not real. */
#define CHASLES_JOINT_UNREAL 1e-4
/* Maximum difference [rad] between a zero of the polynomial and the angle of its refined pose. */
#define CHASLES_JOINT_TURN 0.05
/* Maximum error of the squared joint distances in a pose. */
#define CHASLES_JOINTS_HELD 1e-11

#endif
