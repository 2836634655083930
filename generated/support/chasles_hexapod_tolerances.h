/* Tolerances of platforms on six rods: name, value, unit and reason; part of chasles, the same for
 * every such robot. Coordinates of a pose have length 1; lengths are in parts of the platform's
 * size where no unit is named.
 */
#ifndef CHASLES_HEXAPOD_TOLERANCES_H
#define CHASLES_HEXAPOD_TOLERANCES_H

/* First Newton correction behind a step along a path: above it another path may be as near. */
#define CHASLES_PATH_NEAR 1e-4
/* The same where two paths ended at one pose, or one was lost, and are followed again, and once
 * more.
 */
#define CHASLES_PATH_NEARER 1e-6
#define CHASLES_PATH_NEAREST 1e-8
/* Second correction: of the order of the square of the first. */
#define CHASLES_PATH_ON 1e-7
/* First and longest step along a path of length 1. */
#define CHASLES_PATH_FIRST 0.05
#define CHASLES_PATH_LONGEST 0.25
/* Shortest step: on a path that ends at a double solution, what is left of the way then moves the
 * pose by less than 1e-5. */
#define CHASLES_PATH_SHORTEST 1e-11
/* Rest of a path that is lost, up to which its end is singular or at infinity, not lost before. */
#define CHASLES_PATH_ALMOST 1e-6
/* 1 - |<x, y>|^2 of two ends that are one: they are known to 1e-13. */
#define CHASLES_ENDS_ARE_ONE 1e-16
/* The same of an end and the conjugate of another: near a singularity fewer digits are known. */
#define CHASLES_ENDS_ARE_PAIRED 1e-10
/* Imaginary part up to which an end is tried as a real pose: near a singularity, ends that differ
 * by the root of rounding are known to 1e-5. */
#define CHASLES_NEARLY_REAL_POSE 1e-3
/* How far Newton's steps may take a real pose from the end of its path: the root of the residual
 * below which it closes, with a singularity's factor. */
#define CHASLES_SAME_END 1e-2
/* Error in the length of a rod up to which a pose is a mode. */
#define CHASLES_RODS_CLOSED 1e-12
/* Error in the length of a rod at which Newton's steps have nothing left to gain. */
#define CHASLES_RODS_POLISHED 1e-15
/* Parts of the platform's size and radians below which two modes are one: at a double solution the
 * rods, whose lengths change with the square of the distance, determine no more digits. */
#define CHASLES_ONE_MODE 1e-6
/* |e.e| of an end at infinity: no rotation has e.e = 0. */
#define CHASLES_AT_INFINITY 1e-9
/* Sine of the middle angle's distance from a quarter turn, below which the outer two are one. */
#define CHASLES_GIMBAL 1e-12

/* Double joints. Error of the polynomial in parts of the largest terms of a sample's sum. */
#define CHASLES_JOINT_NOISE 1e-14
/* The same, of its greatest coefficient, below which it vanishes. */
#define CHASLES_JOINT_VANISHED 1e-9
/* Distance of two ends, square of a circle's radius, and sine of the angle between two sides of
 * three joints, below which they are too flat for circles. */
#define CHASLES_JOINTS_APART 1e-6
/* Square of a sine up to which it is that of a real angle at a zero of the polynomial. */
#define CHASLES_JOINT_UNREAL 1e-4
/* rad: a zero is no further from its pose. */
#define CHASLES_JOINT_TURN 0.05
/* Squares of lengths: error of the joints' distances in a pose. */
#define CHASLES_JOINTS_HELD 1e-11

#endif
