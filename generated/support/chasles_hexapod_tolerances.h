/* Tolerances for platforms on six rods: name, value, unit and reason. This file is part of chasles
 * and is the same for every robot. Pose coordinates are normalized. Lengths without a unit are
 * relative to the platform size.
 */
#ifndef CHASLES_HEXAPOD_TOLERANCES_H
#define CHASLES_HEXAPOD_TOLERANCES_H

/* Maximum first Newton correction after a path step: after a larger correction, another path may be
 * as near. */
#define CHASLES_PATH_NEAR 1e-4
/* If a path is lost, or two paths have equal ends, the paths are repeated with these smaller
 * maximum corrections: first NEARER, then NEAREST. */
#define CHASLES_PATH_NEARER 1e-6
#define CHASLES_PATH_NEAREST 1e-8
/* Maximum second Newton correction, of the order of the squared first correction. */
#define CHASLES_PATH_ON 1e-7
/* Initial and maximum step along a path of length 1. */
#define CHASLES_PATH_FIRST 0.05
#define CHASLES_PATH_LONGEST 0.25
/* Minimum step along a path. If a path to a double solution ends before such a step, the rest of
 * the path moves the pose by less than 1e-5. */
#define CHASLES_PATH_SHORTEST 1e-11
/* Maximum remaining length of a lost path whose last point is treated as a singular or infinite
 * end. */
#define CHASLES_PATH_ALMOST 1e-6
/* Maximum 1 - |<x, y>|^2 of two equal path ends with errors of 1e-13. */
#define CHASLES_ENDS_ARE_ONE 1e-16
/* Maximum 1 - |<x, y>|^2 of a path end x and the conjugate y of another path end: near a
 * singularity, fewer digits are valid. */
#define CHASLES_ENDS_ARE_PAIRED 1e-10
/* Maximum imaginary part of a candidate for a real pose: near a singularity, path ends have errors
 * of 1e-5. */
#define CHASLES_NEARLY_REAL_POSE 1e-3
/* Maximum distance between a path end and its refined real pose: the square root of the closure
 * tolerance, with a margin for singularities. */
#define CHASLES_SAME_END 1e-2
/* Maximum rod length error of an assembly mode. */
#define CHASLES_RODS_CLOSED 1e-12
/* Rod length error at which the iteration of an assembly mode ends. */
#define CHASLES_RODS_POLISHED 1e-15
/* Below this difference (relative to the platform size, and rad), two assembly modes are equal. At
 * a double solution, rod lengths change with the squared distance and determine no more digits. */
#define CHASLES_ONE_MODE 1e-6
/* Maximum |e.e| of a path end at infinity: no rotation has e.e = 0. */
#define CHASLES_AT_INFINITY 1e-9
/* Gimbal lock: the outer two angles count as dependent if the middle angle differs from a quarter
 * turn by an angle with a sine below this value. */
#define CHASLES_GIMBAL 1e-12

/* Rods with double joints: error of the polynomial relative to the largest summands of a sample. */
#define CHASLES_JOINT_NOISE 1e-14
/* Maximum coefficient of a polynomial that is treated as zero, relative to the largest summands of
 * a sample.
 */
#define CHASLES_JOINT_VANISHED 1e-9
/* Minimum distance of two rod ends, minimum squared circle radius, and minimum sine of the angle
 * between two sides of the joint triangle. Smaller values are too degenerate for circles. */
#define CHASLES_JOINTS_APART 1e-6
/* Maximum violation of sin^2 >= 0 for a real angle at a zero of the polynomial. */
#define CHASLES_JOINT_UNREAL 1e-4
/* Maximum difference [rad] between a zero of the polynomial and the angle of its refined pose. */
#define CHASLES_JOINT_TURN 0.05
/* Maximum error of the squared joint distances in a pose. */
#define CHASLES_JOINTS_HELD 1e-11

#endif
