/* Tolerances for platforms on six rods: name, value, unit and reason. This file is part of chasles
 * and is the same for every robot. Pose coordinates are normalized; lengths without a unit are
 * relative to the platform size.
 */
#ifndef CHASLES_HEXAPOD_TOLERANCES_H
#define CHASLES_HEXAPOD_TOLERANCES_H

/* Maximum first Newton correction after a path step: beyond this value, another path may be as
 * near. */
#define CHASLES_PATH_NEAR 1e-4
/* Maximum first Newton correction when lost paths and paths with equal ends are repeated for the
 * first and second time. */
#define CHASLES_PATH_NEARER 1e-6
#define CHASLES_PATH_NEAREST 1e-8
/* Maximum second correction: of the order of the squared first correction. */
#define CHASLES_PATH_ON 1e-7
/* Initial and maximum step along a path of length 1. */
#define CHASLES_PATH_FIRST 0.05
#define CHASLES_PATH_LONGEST 0.25
/* Minimum step: on a path to a double solution, the rest of the path then moves the pose by less
 * than 1e-5. */
#define CHASLES_PATH_SHORTEST 1e-11
/* Largest remaining length of a lost path that is treated as a singular or infinite end. */
#define CHASLES_PATH_ALMOST 1e-6
/* Largest 1 - |<x, y>|^2 of equal ends: ends have errors of 1e-13. */
#define CHASLES_ENDS_ARE_ONE 1e-16
/* Largest 1 - |<x, y>|^2 of an end x and the conjugate y of another end: near a singularity, fewer
 * digits are valid. */
#define CHASLES_ENDS_ARE_PAIRED 1e-10
/* Largest imaginary part of a candidate real pose: near a singularity, ends have errors of 1e-5. */
#define CHASLES_NEARLY_REAL_POSE 1e-3
/* Maximum distance between a path end and its refined real pose: the square root of the closure
 * tolerance, enlarged for singularities. */
#define CHASLES_SAME_END 1e-2
/* Largest rod length error of a mode. */
#define CHASLES_RODS_CLOSED 1e-12
/* Rod length error at which the iteration of a mode ends. */
#define CHASLES_RODS_POLISHED 1e-15
/* Two modes closer than this (relative to the platform size, and rad) are equal. At a double
 * solution, rod lengths change with the squared distance and determine no more digits. */
#define CHASLES_ONE_MODE 1e-6
/* Largest |e.e| of an end at infinity: no rotation has e.e = 0. */
#define CHASLES_AT_INFINITY 1e-9
/* Gimbal lock: below this sine of the middle angle's distance from a quarter turn, the outer two
 * angles are dependent. */
#define CHASLES_GIMBAL 1e-12

/* Double joints: error of the polynomial relative to the largest summands of a sample. */
#define CHASLES_JOINT_NOISE 1e-14
/* Largest coefficient of a polynomial that vanishes, relative to the largest summands of a sample.
 */
#define CHASLES_JOINT_VANISHED 1e-9
/* Minimum distance of two ends, squared circle radius, and sine of the angle between two sides of
 * the joint triangle; smaller values are too degenerate for circles. */
#define CHASLES_JOINTS_APART 1e-6
/* Largest violation of sin^2 >= 0 for a real angle at a zero of the polynomial. */
#define CHASLES_JOINT_UNREAL 1e-4
/* rad: maximum distance of a zero from its pose. */
#define CHASLES_JOINT_TURN 0.05
/* Squared lengths: error of the joint distances in a pose. */
#define CHASLES_JOINTS_HELD 1e-11

#endif
