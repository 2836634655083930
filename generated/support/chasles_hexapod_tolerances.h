/* Tolerances for platforms on six rods, each with its name, value, unit and reason. This file is
 * part of chasles and is the same for every robot. The Study coordinates of each pose are
 * normalized to length 1. Lengths without a unit are relative to the platform size. */
#ifndef CHASLES_HEXAPOD_TOLERANCES_H
#define CHASLES_HEXAPOD_TOLERANCES_H

#define CHASLES_PATH_NEAR 1e-4
/* Paths that do not reach their end, and different paths that reach the same end, are tracked a
 * second time and, if necessary, a third time. The second attempt limits the Newton corrections to
 * CHASLES_PATH_NEARER, and the third attempt to CHASLES_PATH_NEAREST. */
#define CHASLES_PATH_NEARER 1e-6
#define CHASLES_PATH_NEAREST 1e-8
/* Maximum length of the second Newton correction. The length of the second correction is about the
 * square of the length of the first. */
#define CHASLES_PATH_ON 1e-7
/* Initial step and maximum step of the path parameter, which runs from 0 to 1. */
#define CHASLES_PATH_FIRST 0.05
#define CHASLES_PATH_LONGEST 0.25
/* Minimum step of the path parameter. */
#define CHASLES_PATH_SHORTEST 1e-11
/* A path ends at the path parameter 1. If path tracking fails at a path parameter above 1 minus
 * this value, the path counts as complete. The last point of a path that failed near its end is
 * treated as a singular pose or a point at infinity. */
#define CHASLES_PATH_ALMOST 1e-6
/* The ends x and y of two paths count as equal if 1 - |<x, y>|^2 is below this value. */
#define CHASLES_ENDS_ARE_ONE 1e-16
/* Let y be the complex conjugate of one path end. Another path end x counts as equal to y if 1 -
 * |<x, y>|^2 is at most this value. Near a singularity, the pose at the end of a path has fewer
 * correct digits. CHASLES_NEARLY_REAL_POSE is the maximum imaginary part of a candidate for a real
 * pose. */
#define CHASLES_ENDS_ARE_PAIRED 1e-10
#define CHASLES_NEARLY_REAL_POSE 1e-3
/* Maximum distance between the end of a path and the real pose to which Newton's method converges.
 */
#define CHASLES_SAME_END 1e-2
/* Maximum rod length error of an assembly mode, relative to the platform size. */
#define CHASLES_RODS_CLOSED 1e-12
/* Newton's iteration of an assembly mode ends at this rod length error, relative to the platform
 * size. */
#define CHASLES_RODS_POLISHED 1e-15
/* Two assembly modes are equal if they differ by less than this value (relative to the platform
 * size, and rad). Near a double solution, a difference of 1e-6 changes the rod lengths only by
 * about 1e-12. */
#define CHASLES_ONE_MODE 1e-6
/* A path end is at infinity if |e.e| is at most this value, where e are the Euler parameters of the
 * pose. */
#define CHASLES_AT_INFINITY 1e-9
/* Gimbal lock occurs if the absolute cosine of the middle rotation angle is at most this value. In
 * gimbal lock, the last rotation angle is set to zero. */
#define CHASLES_GIMBAL 1e-12

/* Rounding error of the polynomial for rods with double joints, relative to its largest terms. The
 * polynomial counts as zero if the ratio of each coefficient to the largest terms is below
 * CHASLES_JOINT_VANISHED. */
#define CHASLES_JOINT_NOISE 1e-14
#define CHASLES_JOINT_VANISHED 1e-9
/* Minimum distance of two rod ends, minimum squared radius of a circle, and minimum sine of the
 * angle between two sides of the joint triangle. If a distance, radius or sine is below this value,
 * the circles of the joints are not computed. */
#define CHASLES_JOINTS_APART 1e-6
/* A negative value of sin^2 counts as 0 if its magnitude is at most this value; otherwise, the
 * angle is not real. */
#define CHASLES_JOINT_UNREAL 1e-4
/* Maximum difference [rad] between a zero of the polynomial and the refined angle of the first
 * joint. */
#define CHASLES_JOINT_TURN 0.05
/* Maximum error of the squared joint distances in a pose. */
#define CHASLES_JOINTS_HELD 1e-11

#endif
