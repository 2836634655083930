/* Logarithms of rotations and rigid displacements between two poses. The function
 * rotation_vector_between writes axis times angle. The function displacement_between writes the
 * difference of the origins and the rotation vector. The function twist_between writes the twist
 * whose exponential is the whole displacement. Source: R. M. Murray, Z. Li, S. S. Sastry, A
 * Mathematical Introduction to Robotic Manipulation, 1994, chapter 2. */
#pragma once

#include <math.h>
#include <string.h>

#include "numerics/_tolerances.h"
#include "numerics/_vectors.h"

typedef struct {
    double angle, sine, cosine; /* angle in [0, pi] */
} RotationAngle;

/* Writes the rotation vector of R_B R_A^T, in base axes. NaN in either pose results in NaN. */
static inline RotationAngle rotation_vector_between(const double *A, const double *B, double *omega)
{
    double R[3][3];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            R[i][j] = dot3(B + 4 * i, A + 4 * j);
        }
    }
    double w[3] = {(R[2][1] - R[1][2]) / 2, (R[0][2] - R[2][0]) / 2, (R[1][0] - R[0][1]) / 2};
    double sine = sqrt(dot3(w, w));
    double cosine = (R[0][0] + R[1][1] + R[2][2] - 1) / 2, angle = atan2(sine, cosine);
    double factor = sine > 0 ? angle / sine : 1;
    if (cosine < 0) {
        /* Near pi, the sine and the vector w are inaccurate. For angles above pi / 2, the axis is
         * therefore computed from the longest column of (R + R^T) / 2 - cos(angle) 1. */
        int k = R[0][0] > R[1][1] ? 0 : 1;
        k = R[2][2] > R[k][k] ? 2 : k;
        double a[3], length = 0, side = 0;
        for (int i = 0; i < 3; i++) {
            a[i] = (R[i][k] + R[k][i]) / 2 - (i == k ? cosine : 0);
            length += a[i] * a[i];
            side += a[i] * w[i];
        }
        memcpy(w, a, sizeof w);
        factor = copysign(angle / sqrt(length), side);
    }
    for (int i = 0; i < 3; i++) {
        omega[i] = factor * w[i];
    }
    return (RotationAngle){angle, sine, cosine};
}

/* Writes the origin difference p and the rotation vector omega from A to B, in base axes. */
static inline RotationAngle displacement_between(const double *A, const double *B, double *out)
{
    for (int i = 0; i < 3; i++) {
        out[i] = B[4 * i + 3] - A[4 * i + 3];
    }
    return rotation_vector_between(A, B, out + 3);
}

/* The coefficient (1 - (a/2) cot(a/2)) / a^2 of w x (w x .) in the inverse derivative of the
 * exponential. The arguments are a = |w| and h = (a/2) cot(a/2). */
static inline double logarithm_coefficient(double angle, double h)
{
    return angle > LOGARITHM_SMALL_ANGLE ? (1 - h) / (angle * angle) : 1.0 / 12;
}

/* Writes the twist (v, w) from pose A to pose B at the origin of A, with v = p - w x p / 2 + k w x
 * (w x p). */
static inline void twist_between(const double *A, const double *B, double *twist)
{
    double wp[3], wwp[3];
    const double *w = twist + 3;
    RotationAngle turn = displacement_between(A, B, twist);
    /* cot(angle / 2). */
    double cotangent =
        turn.cosine < 0 ? turn.sine / (1 - turn.cosine) : (1 + turn.cosine) / turn.sine;
    double k = logarithm_coefficient(turn.angle, turn.angle * cotangent / 2);
    cross(w, twist, wp);
    cross(w, wp, wwp);
    for (int i = 0; i < 3; i++) {
        twist[i] = twist[i] - wp[i] / 2 + k * wwp[i];
    }
}
