/* Finds all poses of a platform with six rods that end in three double joints. This file is part of
 * chasles and is the same for every robot.
 *
 * Two rods that share a joint keep this joint on a circle about the line through the other ends of
 * the rods. The points on the circle of joint i are P_i = c_i + e_i cos(t_i) + f_i sin(t_i). The
 * known distances between the three joints give the equations |P_i - P_k|^2 = |b_i - b_k|^2, which
 * are bilinear in the cosines and sines of t_i and t_k.
 *
 * For a given angle t_1, the distances from P_1 give two angles t_2 and two angles t_3. The
 * formulas of t_2 and t_3 contain the square roots w_2 and w_3 of two discriminants Delta_2 and
 * Delta_3. The equation of the last distance is F_23 = U + V w_2 + W w_3 + X w_2 w_3 = 0. The
 * product of F_23 over the four sign combinations of w_2 and w_3 contains no square roots.
 * Multiplied by its denominators, the product is a trigonometric polynomial of degree 8 in t_1,
 * whose zeros give up to sixteen poses. If both the platform and the base have three double joints,
 * the axes of all circles lie in one plane. If all angles t_i are measured from the plane of the
 * circle axes, the sines cancel in the polynomial. Without sines, the polynomial has degree 8 in
 * cos(t_1), and the poses come in mirrored pairs.
 *
 * Source:
 *     Innocenti and Parenti-Castelli, Direct position analysis of the Stewart platform mechanism,
 *     1990; Nanua, Waldron and Murthy, Direct kinematic solution of a Stewart platform, 1990.
 */
#ifndef CHASLES_DOUBLE_JOINTS_H
#define CHASLES_DOUBLE_JOINTS_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_circle_roots.h"
#include "chasles_hexapod_tolerances.h"

/* Number of samples of the trigonometric polynomial in the angle of the first joint. */
#define CHASLES_JOINT_SAMPLES 24
/* Maximum number of Newton steps for the three distance equations. */
#define CHASLES_JOINT_STEPS 12

typedef struct {
    double c[3][3], e[3][3], f[3][3];
    double distance[3][3][3];
} chasles_double_joints;

static double chasles_joint_dot(const double *x, const double *y)
{
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
}

static void chasles_joint_cross(const double *x, const double *y, double *z)
{
    z[0] = x[1] * y[2] - x[2] * y[1];
    z[1] = x[2] * y[0] - x[0] * y[2];
    z[2] = x[0] * y[1] - x[1] * y[0];
}

/* Normalizes the vector x and returns its original length. */
static double chasles_joint_normal(double *x)
{
    const double length = sqrt(chasles_joint_dot(x, x));
    for (int k = 0; k < 3; k++)
        x[k] /= length;
    return length;
}

/* Computes the circle of a joint at the end of two rods. Returns the squared radius of the circle,
 * or NaN if the opposite ends of the two rods coincide. */
static double chasles_joint_circle(const double (*a)[3], const double *l, double *c, double *e,
                                   double *f)
{
    double axis[3], aside[3] = {0.0};
    int least = 0;
    for (int k = 0; k < 3; k++)
        axis[k] = a[1][k] - a[0][k];
    const double apart = chasles_joint_normal(axis);
    const double along = 0.5 * (apart + (l[0] - l[1]) * (l[0] + l[1]) / apart);
    const double square = (l[0] - along) * (l[0] + along);
    const double radius = sqrt(fabs(square));
    for (int k = 1; k < 3; k++)
        least = fabs(axis[k]) < fabs(axis[least]) ? k : least;
    aside[least] = 1.0;
    chasles_joint_cross(axis, aside, e);
    chasles_joint_normal(e);
    chasles_joint_cross(axis, e, f);
    for (int k = 0; k < 3; k++) {
        c[k] = a[0][k] + along * axis[k];
        e[k] *= radius, f[k] *= radius;
    }
    return apart > CHASLES_JOINTS_APART ? square : NAN;
}

/* Computes the coefficients of the squared distance between two joints, minus its known value
 * `square`. */
static void chasles_joint_distance(const chasles_double_joints *joints, int i, int k, double square,
                                   double (*Q)[3])
{
    double d[3];
    const double *u[2] = {joints->e[i], joints->f[i]}, *v[2] = {joints->e[k], joints->f[k]};
    for (int n = 0; n < 3; n++)
        d[n] = joints->c[i][n] - joints->c[k][n];
    Q[0][0] = chasles_joint_dot(d, d) + chasles_joint_dot(u[0], u[0]) +
              chasles_joint_dot(v[0], v[0]) - square;
    for (int m = 0; m < 2; m++) {
        Q[1 + m][0] = 2.0 * chasles_joint_dot(d, u[m]);
        Q[0][1 + m] = -2.0 * chasles_joint_dot(d, v[m]);
        for (int n = 0; n < 2; n++)
            Q[1 + m][1 + n] = -2.0 * chasles_joint_dot(u[m], v[n]);
    }
}

/* The two angles t at which g[0] + g[1] cos(t) + g[2] sin(t) is zero. The vectors (1, cos, sin) of
 * the two angles are m + w n and m - w n, where w is the square root of delta. `square` is the
 * squared norm of (g[1], g[2]). */
typedef struct {
    double m[3], n[3], delta, square;
} chasles_joint_pair;

static void chasles_joint_solved(const double *g, chasles_joint_pair *pair)
{
    const double square = g[1] * g[1] + g[2] * g[2], inverse = 1.0 / square;
    pair->square = square;
    pair->delta = square - g[0] * g[0];
    pair->m[0] = 1.0, pair->m[1] = -g[0] * g[1] * inverse, pair->m[2] = -g[0] * g[2] * inverse;
    pair->n[0] = 0.0, pair->n[1] = -g[2] * inverse, pair->n[2] = g[1] * inverse;
}

/* For a given angle of the first joint, computes the two possible angles of the second joint and
 * the two possible angles of the third. */
static void chasles_joint_neighbours(const chasles_double_joints *joints, double cosine,
                                     double sine, chasles_joint_pair *pairs)
{
    const double(*to)[3] = joints->distance[0], (*from)[3] = joints->distance[2];
    double g[3], h[3];
    for (int k = 0; k < 3; k++) {
        g[k] = to[0][k] + to[1][k] * cosine + to[2][k] * sine;
        h[k] = from[k][0] + from[k][1] * cosine + from[k][2] * sine;
    }
    chasles_joint_solved(g, pairs);
    chasles_joint_solved(h, pairs + 1);
}

/* Returns the bilinear form x^T Q y. */
static double chasles_joint_form(const double *x, const double (*Q)[3], const double *y)
{
    double sum = 0.0;
    for (int i = 0; i < 3; i++)
        sum += x[i] * chasles_joint_dot(Q[i], y);
    return sum;
}

/* Computes the coefficients U, V, W and X of the last distance equation. */
static void chasles_joint_last(const chasles_double_joints *joints, const chasles_joint_pair *pairs,
                               double *parts)
{
    const double(*Q)[3] = joints->distance[1];
    parts[0] = chasles_joint_form(pairs[0].m, Q, pairs[1].m);
    parts[1] = chasles_joint_form(pairs[0].n, Q, pairs[1].m);
    parts[2] = chasles_joint_form(pairs[0].m, Q, pairs[1].n);
    parts[3] = chasles_joint_form(pairs[0].n, Q, pairs[1].n);
}

/* Evaluates the polynomial at an angle of the first joint. Writes the sum of the absolute values of
 * the polynomial's terms to `size`. */
static double chasles_joint_sample(const chasles_double_joints *joints, double cosine, double sine,
                                   double *size)
{
    chasles_joint_pair pairs[2];
    double F[4];
    chasles_joint_neighbours(joints, cosine, sine, pairs);
    chasles_joint_last(joints, pairs, F);
    const double d2 = pairs[0].delta, d3 = pairs[1].delta;
    const double P = F[0] * F[0] + F[2] * F[2] * d3 - d2 * (F[1] * F[1] + F[3] * F[3] * d3);
    const double Q = 2.0 * (F[0] * F[2] - d2 * F[1] * F[3]);
    const double s = pairs[0].square * pairs[1].square;
    *size = s * s * (P * P + Q * Q * fabs(d3));
    return s * s * (P * P - Q * Q * d3);
}

/* Computes the polynomial in the angle of the first joint from samples. Returns 0 if the polynomial
 * is not finite or is zero everywhere. */
static int chasles_joint_series(const chasles_double_joints *joints, chasles_circle_series *series)
{
    const int every = CHASLES_CELLS / CHASLES_JOINT_SAMPLES;
    double value[CHASLES_JOINT_SAMPLES], most = 0.0;
    for (int k = 0; k < CHASLES_JOINT_SAMPLES; k++) {
        double size;
        value[k] = chasles_joint_sample(joints, chasles_circle_cosine[every * k],
                                        chasles_circle_cosine[every * k + 72], &size);
        most = !(size <= DBL_MAX) ? HUGE_VAL : size > most ? size : most;
    }
    memset(series, 0, sizeof *series);
    for (int m = 0; m <= CHASLES_DEGREE; m++) {
        for (int k = 0; k < CHASLES_JOINT_SAMPLES; k++) {
            const int at = every * m * k % CHASLES_CELLS;
            series->a[m] += value[k] * chasles_circle_cosine[at];
            series->b[m] += value[k] * chasles_circle_cosine[at + 72];
        }
        const double weight = (m > 0 ? 2.0 : 1.0) / (CHASLES_JOINT_SAMPLES * most);
        series->a[m] *= weight, series->b[m] *= weight;
        const double size = fabs(series->a[m]) + fabs(series->b[m]);
        series->most = size > series->most ? size : series->most;
    }
    series->noise = CHASLES_JOINT_NOISE;
    return most <= DBL_MAX && series->most > CHASLES_JOINT_VANISHED;
}

/* Solves the three distance equations by Newton's iteration. Returns the largest absolute residual
 * of the three distance equations. */
static double chasles_joint_polished(const chasles_double_joints *joints, double (*x)[3])
{
    double left = HUGE_VAL;
    for (int step = 0; step < CHASLES_JOINT_STEPS; step++) {
        double value[3], own[3], other[3], worst = 0.0, turn[3];
        for (int i = 0; i < 3; i++) {
            const int k = (i + 1) % 3;
            const double(*Q)[3] = joints->distance[i];
            const double d[3] = {0.0, -x[i][2], x[i][1]}, e[3] = {0.0, -x[k][2], x[k][1]};
            value[i] = chasles_joint_form(x[i], Q, x[k]);
            own[i] = chasles_joint_form(d, Q, x[k]), other[i] = chasles_joint_form(x[i], Q, e);
            const double size = fabs(value[i]);
            worst = size > worst || size != size ? size : worst;
        }
        if (!(worst < left))
            break;
        left = worst;
        const double determinant = own[0] * own[1] * own[2] + other[0] * other[1] * other[2];
        for (int i = 0; i < 3; i++) {
            const int k = (i + 1) % 3, n = (i + 2) % 3;
            turn[i] = -value[i] * own[k] * own[n] + value[k] * other[i] * own[n] -
                      value[n] * other[i] * other[k];
            turn[i] /= determinant;
        }
        for (int i = 0; i < 3; i++) {
            if (!(fabs(turn[i]) < CHASLES_JOINT_TURN))
                return left;
        }
        for (int i = 0; i < 3; i++) {
            const double c = x[i][1] - turn[i] * x[i][2], s = x[i][2] + turn[i] * x[i][1];
            const double size = sqrt(c * c + s * s);
            x[i][1] = c / size, x[i][2] = s / size;
        }
    }
    return left;
}

/* Computes the orthonormal frame of a triangle, with one axis in each matrix row. Returns the sine
 * of the triangle's interior angle at its first corner. */
static double chasles_joint_axes(const double (*corners)[3], double (*axes)[3])
{
    double side[3];
    for (int k = 0; k < 3; k++) {
        axes[0][k] = corners[1][k] - corners[0][k];
        side[k] = corners[2][k] - corners[0][k];
    }
    chasles_joint_normal(axes[0]);
    chasles_joint_normal(side);
    chasles_joint_cross(axes[0], side, axes[2]);
    const double sine = chasles_joint_normal(axes[2]);
    chasles_joint_cross(axes[2], axes[0], axes[1]);
    return sine;
}

/* Computes the quaternion of a rotation. */
static void chasles_joint_quaternion(const double (*R)[3], double *e)
{
    const double trace = R[0][0] + R[1][1] + R[2][2];
    int i = 0;
    for (int k = 1; k < 3; k++)
        i = R[k][k] > R[i][i] ? k : i;
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    if (trace > R[i][i]) {
        e[0] = 1.0 + trace;
        e[1] = R[2][1] - R[1][2], e[2] = R[0][2] - R[2][0], e[3] = R[1][0] - R[0][1];
    } else {
        e[0] = R[k][j] - R[j][k];
        e[1 + i] = 1.0 + 2.0 * R[i][i] - trace;
        e[1 + j] = R[i][j] + R[j][i], e[1 + k] = R[i][k] + R[k][i];
    }
    const double size = sqrt(e[0] * e[0] + chasles_joint_dot(e + 1, e + 1));
    for (int n = 0; n < 4; n++)
        e[n] /= size;
}

/* Computes the pose (a quaternion and a position) that maps the joint positions b to the points x
 * on the circles of the joints. */
static void chasles_joint_pose(const chasles_double_joints *joints, const double (*b)[3],
                               const double (*x)[3], double *pose)
{
    double at[3][3], from[3][3], to[3][3], R[3][3];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            at[i][k] = joints->c[i][k] + joints->e[i][k] * x[i][1] + joints->f[i][k] * x[i][2];
    }
    chasles_joint_axes(b, from);
    chasles_joint_axes((const double(*)[3])at, to);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            R[i][k] = to[0][i] * from[0][k] + to[1][i] * from[1][k] + to[2][i] * from[2][k];
    }
    chasles_joint_quaternion((const double(*)[3])R, pose);
    for (int i = 0; i < 3; i++)
        pose[4 + i] = at[0][i] - chasles_joint_dot(R[i], b[0]);
}

/* Computes (1, cos, sin) of the three joint angles from `angle`, which is a root of the polynomial.
 * Returns whether a real pose exists at this angle. */
static int chasles_joint_real(const chasles_double_joints *joints, double angle, double (*x)[3])
{
    chasles_joint_pair pairs[2];
    double F[4], best = HUGE_VAL, w[2];
    const double cosine = cos(angle), sine = sin(angle);
    chasles_joint_neighbours(joints, cosine, sine, pairs);
    chasles_joint_last(joints, pairs, F);
    for (int i = 0; i < 2; i++) {
        if (pairs[i].delta < -CHASLES_JOINT_UNREAL * pairs[i].square)
            return 0;
        w[i] = sqrt(fmax(0.0, pairs[i].delta));
    }
    for (int sides = 0; sides < 4; sides++) {
        const double w2 = sides & 1 ? -w[0] : w[0], w3 = sides & 2 ? -w[1] : w[1];
        const double value = fabs(F[0] + F[1] * w2 + F[2] * w3 + F[3] * w2 * w3);
        if (!(value < best))
            continue;
        best = value;
        x[0][0] = 1.0, x[0][1] = cosine, x[0][2] = sine;
        for (int k = 0; k < 3; k++) {
            x[1][k] = pairs[0].m[k] + w2 * pairs[0].n[k];
            x[2][k] = pairs[1].m[k] + w3 * pairs[1].n[k];
        }
    }
    return chasles_joint_polished(joints, x) < CHASLES_JOINTS_HELD &&
           fabs(x[0][2] * cosine - x[0][1] * sine) < CHASLES_JOINT_TURN;
}

/* Computes all poses from the real roots of the polynomial in the angle of the first joint. Returns
 * the number of poses, or -1 if the number is uncertain. */
static int chasles_joint_poses(const chasles_double_joints *joints, const double (*b)[3],
                               double (*poses)[7])
{
    chasles_circle_series series;
    chasles_circle_roots roots;
    if (!chasles_joint_series(joints, &series))
        return -1;
    chasles_circle_real(0, 0, &series, &roots);
    if (roots.unresolved || roots.count > 2 * CHASLES_DEGREE)
        return -1;
    for (int k = 0; k < roots.count; k++) {
        double x[3][3];
        for (int i = 0; i < k; i++) {
            if (fabs(chasles_circle_wrapped(roots.angle[i] - roots.angle[k])) < CHASLES_TWINS)
                return -1;
        }
        /* A simple root belongs to exactly one pose, and this pose is real. */
        if (roots.imaginary[k] > 0.0 || !chasles_joint_real(joints, roots.angle[k], x))
            return -1;
        chasles_joint_pose(joints, b, (const double(*)[3])x, poses[k]);
    }
    return roots.count;
}

/* Computes all poses of a body on six rods of lengths l. The rods connect six points a to three
 * body points b, with two rods per body point. Returns the number of poses, or -1 if the number is
 * uncertain. */
static int chasles_double_joint_poses(const double (*a)[3], const double *l, const double (*b)[3],
                                      double (*poses)[7])
{
    double squares[3], axes[3][3];
    int count = -1;
    if (!(chasles_joint_axes(b, axes) > CHASLES_JOINTS_APART))
        return -1;
    for (int first = 0; first < 3 && count < 0; first++) {
        chasles_double_joints joints;
        const double own[3][3] = {
            {b[first][0], b[first][1], b[first][2]},
            {b[(first + 1) % 3][0], b[(first + 1) % 3][1], b[(first + 1) % 3][2]},
            {b[(first + 2) % 3][0], b[(first + 2) % 3][1], b[(first + 2) % 3][2]}};
        for (int i = 0; i < 3; i++) {
            const int at = (first + i) % 3;
            squares[i] =
                chasles_joint_circle(a + 2 * at, l + 2 * at, joints.c[i], joints.e[i], joints.f[i]);
            if (squares[i] < -CHASLES_JOINTS_APART)
                return 0;
            if (!(squares[i] > CHASLES_JOINTS_APART))
                return -1;
        }
        for (int i = 0; i < 3; i++) {
            double d[3];
            const int k = (i + 1) % 3;
            for (int n = 0; n < 3; n++)
                d[n] = own[i][n] - own[k][n];
            chasles_joint_distance(&joints, i, k, chasles_joint_dot(d, d), joints.distance[i]);
        }
        count = chasles_joint_poses(&joints, own, poses);
    }
    return count;
}

#endif
