/* Finds every solution of an arm with a 3-RPS platform and a wrist on the platform. Each leg of the
 * platform keeps a ball joint in a plane. This file is part of chasles and is the same for every
 * robot.
 *
 * The tool pose determines the wrist center. For each of the three balls, the rotation R of the
 * platform satisfies n^T R m = e. In this equation, n is the normal of the ball's plane, and m is
 * the direction from the wrist center to the ball. The right-hand side e is the signed distance
 * from the wrist center to the ball's plane, divided by the distance between wrist center and ball.
 * Newton's iteration refines the rotations of the platform. */
#ifndef CHASLES_CARRIED_WRIST_H
#define CHASLES_CARRIED_WRIST_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_carried_platform.h"

#define CHASLES_WRIST_ROTATIONS 8
/* Maximum number of Newton steps, which is large because each step only halves the error at a
 * double root. */
#define CHASLES_WRIST_STEPS 40

typedef struct {
    void (*legs)(const double *T, const double *P, double *q, double *residual, double *margin);
    void (*fk)(const double *q, double *T);
    int slots, coordinates;
    double size;           /* length of the mechanism (meter) */
    double normals[3][3];  /* normals of the three planes, in base axes */
    double offsets[3];     /* offsets of the three planes (meter) */
    double levers[3][3];   /* unit vectors from wrist center to ball joints, in platform axes */
    double lengths[3];     /* distances between the wrist center and the ball joints (meter) */
    double center[3];      /* wrist center in the platform frame (meter) */
    double tool_center[3]; /* wrist center in the tool frame (meter) */
} chasles_carried_wrist_arm;

/* The equations n^T R m = e of the three ball joints for a tool pose, where R is the platform
 * rotation. `e` contains the right-hand sides. `first` is the index of the first ball, which is the
 * ball with the smallest |e|. `c` and `s` are the cosine and sine of the angle between the
 * direction of the first ball and the normal of its plane. The first axis of `base` is the normal
 * of the first ball's plane. The first axis of `platform` is the direction from the wrist center to
 * the first ball. */
typedef struct {
    double e[3], c, s, base[3][3], platform[3][3];
    int first;
} chasles_wrist_equations;

/* A rotation of the platform, its trace, and its distance from a singularity. */
typedef struct {
    double R[3][3], trace, margin;
} chasles_wrist_rotation;

/* Writes a right-handed orthonormal frame whose first axis is the unit vector z. */
static void chasles_wrist_axes(const double *z, double (*axes)[3])
{
    int k = 0;
    for (int i = 1; i < 3; i++)
        k = fabs(z[i]) < fabs(z[k]) ? i : k;
    const double size = sqrt(1.0 - z[k] * z[k]);
    for (int i = 0; i < 3; i++) {
        axes[0][i] = z[i];
        axes[1][i] = ((i == k) - z[k] * z[i]) / size;
    }
    chasles_carried_cross(axes[0], axes[1], axes[2]);
}

/* Writes the equations of the three balls for the tool pose T. Returns 0 if a ball cannot reach its
 * plane or T is not finite. */
static int chasles_wrist_setup(const chasles_carried_wrist_arm *arm, const double *T,
                               double *center, chasles_wrist_equations *equations)
{
    for (int i = 0; i < 3; i++)
        center[i] = chasles_carried_dot(T + 4 * i, arm->tool_center) + T[4 * i + 3];
    equations->first = 0;
    for (int k = 0; k < 3; k++) {
        const double apart = arm->offsets[k] - chasles_carried_dot(arm->normals[k], center);
        const double e = apart / arm->lengths[k];
        if (!(fabs(e) <= 1.0 + CHASLES_WRIST_CLOSED))
            return 0;
        equations->e[k] = e;
        equations->first = fabs(e) < fabs(equations->e[equations->first]) ? k : equations->first;
    }
    equations->c = equations->e[equations->first];
    equations->s = sqrt(fmax(0.0, 1.0 - equations->c * equations->c));
    chasles_wrist_axes(arm->normals[equations->first], equations->base);
    chasles_wrist_axes(arm->levers[equations->first], equations->platform);
    return 1;
}

/* The angle alpha turns the first ball about the normal of its plane, and beta turns the platform
 * about the direction of the first ball. Writes to `axes` the rotated platform axes for beta = 0.
 * Writes to `linear` the coefficients of cos(beta), sin(beta) and 1 in the equations of the second
 * and third ball. */
static void chasles_wrist_linear(const chasles_carried_wrist_arm *arm,
                                 const chasles_wrist_equations *equations, double c, double s,
                                 double (*axes)[3], double (*linear)[3])
{
    const double(*base)[3] = equations->base, (*platform)[3] = equations->platform;
    for (int i = 0; i < 3; i++) {
        const double outwards = c * base[1][i] + s * base[2][i];
        axes[0][i] = equations->c * base[0][i] + equations->s * outwards;
        axes[1][i] = equations->c * outwards - equations->s * base[0][i];
        axes[2][i] = c * base[2][i] - s * base[1][i];
    }
    for (int i = 0; i < 2; i++) {
        const int k = (equations->first + 1 + i) % 3;
        double n[3], m[3];
        for (int j = 0; j < 3; j++) {
            n[j] = chasles_carried_dot(arm->normals[k], axes[j]);
            m[j] = chasles_carried_dot(arm->levers[k], platform[j]);
        }
        linear[i][0] = m[1] * n[1] + m[2] * n[2];
        linear[i][1] = m[1] * n[2] - m[2] * n[1];
        linear[i][2] = m[0] * n[0] - equations->e[k];
    }
}

/* Writes the trigonometric polynomial whose zeros are the possible angles alpha. Returns 0 if the
 * polynomial is zero everywhere. */
static int chasles_wrist_polynomial(const chasles_carried_wrist_arm *arm,
                                    const chasles_wrist_equations *equations,
                                    chasles_circle_series *series)
{
    const double *cosine = chasles_circle_cosine, *sine = chasles_circle_cosine + 72;
    double values[CHASLES_CARRIED_SAMPLES];
    for (int j = 0; j < CHASLES_CARRIED_SAMPLES; j++) {
        const int at = CHASLES_CARRIED_EVERY * j;
        double axes[3][3], linear[2][3], D[3];
        chasles_wrist_linear(arm, equations, cosine[at], sine[at], axes, linear);
        chasles_carried_cross(linear[0], linear[1], D);
        values[j] = D[0] * D[0] + D[1] * D[1] - D[2] * D[2];
    }
    chasles_carried_series(values, series);
    return series->most > CHASLES_WRIST_VANISHED;
}

/* Writes the errors of the three equations, and their derivatives with respect to a rotation vector
 * in base axes. Returns the largest absolute error of the three equations. */
static double chasles_wrist_error(const chasles_carried_wrist_arm *arm,
                                  const chasles_wrist_equations *equations, const double (*R)[3],
                                  double (*rows)[3], double *errors)
{
    double most = 0.0;
    for (int k = 0; k < 3; k++) {
        double lever[3];
        for (int i = 0; i < 3; i++)
            lever[i] = chasles_carried_dot(R[i], arm->levers[k]);
        chasles_carried_cross(lever, arm->normals[k], rows[k]);
        errors[k] = chasles_carried_dot(arm->normals[k], lever) - equations->e[k];
        const double size = fabs(errors[k]);
        most = !(size <= DBL_MAX) ? HUGE_VAL : size > most ? size : most;
    }
    return most;
}

/* Rotates R by the Rodrigues vector `turn`, which is the rotation axis times the tangent of half
 * the rotation angle. */
static void chasles_wrist_turn(const double *turn, const double (*R)[3], double (*next)[3])
{
    const double scale = 2.0 / (1.0 + chasles_carried_dot(turn, turn));
    for (int j = 0; j < 3; j++) {
        const double v[3] = {R[0][j], R[1][j], R[2][j]};
        double w[3], x[3];
        chasles_carried_cross(turn, v, w);
        chasles_carried_cross(turn, w, x);
        for (int i = 0; i < 3; i++)
            next[i][j] = v[i] + scale * (w[i] + x[i]);
    }
}

/* Solves the equations of the three balls by Newton's iteration. Returns 0 if the iteration does
 * not converge. */
static int chasles_wrist_polished(const chasles_carried_wrist_arm *arm,
                                  const chasles_wrist_equations *equations,
                                  chasles_wrist_rotation *rotation)
{
    double rows[3][3], errors[3], cofactors[3][3], determinant;
    double error =
        chasles_wrist_error(arm, equations, (const double(*)[3])rotation->R, rows, errors);
    for (int step = 0;; step++) {
        double next[3][3], next_rows[3][3], next_errors[3], turn[3];
        for (int i = 0; i < 3; i++)
            chasles_carried_cross(rows[(i + 1) % 3], rows[(i + 2) % 3], cofactors[i]);
        determinant = chasles_carried_dot(rows[0], cofactors[0]);
        if (step == CHASLES_WRIST_STEPS || error <= CHASLES_WRIST_POLISHED)
            break;
        for (int i = 0; i < 3; i++) {
            turn[i] = 0.0;
            for (int k = 0; k < 3; k++)
                turn[i] -= 0.5 * cofactors[k][i] * errors[k] / determinant;
        }
        const double angle = 2.0 * sqrt(chasles_carried_dot(turn, turn));
        if (!(angle <= DBL_MAX))
            break;
        for (int i = 0; i < 3; i++)
            turn[i] *= angle > CHASLES_WRIST_STEP ? CHASLES_WRIST_STEP / angle : 1.0;
        chasles_wrist_turn(turn, (const double(*)[3])rotation->R, next);
        const double then =
            chasles_wrist_error(arm, equations, (const double(*)[3])next, next_rows, next_errors);
        if (!(then < error) && error <= CHASLES_WRIST_CLOSED)
            break;
        error = then;
        memcpy(rotation->R, next, sizeof next);
        memcpy(rows, next_rows, sizeof rows);
        memcpy(errors, next_errors, sizeof errors);
    }
    double sizes = 1.0;
    for (int k = 0; k < 3; k++)
        sizes *= sqrt(chasles_carried_dot(rows[k], rows[k]));
    rotation->margin = sizes > 0.0 ? fabs(determinant) / sizes : 0.0;
    return error <= CHASLES_WRIST_CLOSED;
}

/* Runs Newton's iteration from the platform rotation with the angles alpha and beta. If the
 * resulting rotation is new, inserts this rotation into the list of rotations. The list of
 * rotations is sorted by the trace of the rotation matrix, which decreases with the rotation angle.
 * Returns the number of rotations in the list. */
static int chasles_wrist_added(const chasles_carried_wrist_arm *arm,
                               const chasles_wrist_equations *equations, const double (*axes)[3],
                               double beta, chasles_wrist_rotation *found, int count)
{
    chasles_wrist_rotation own;
    const double c = cos(beta), s = sin(beta), (*platform)[3] = equations->platform;
    for (int i = 0; i < 3; i++) {
        const double y = c * axes[1][i] + s * axes[2][i], z = c * axes[2][i] - s * axes[1][i];
        for (int j = 0; j < 3; j++)
            own.R[i][j] = axes[0][i] * platform[0][j] + y * platform[1][j] + z * platform[2][j];
    }
    if (count == CHASLES_WRIST_ROTATIONS || !chasles_wrist_polished(arm, equations, &own))
        return count;
    own.trace = own.R[0][0] + own.R[1][1] + own.R[2][2];
    int at = count;
    for (int k = 0; k < count; k++) {
        double apart = 0.0;
        for (int i = 0; i < 9; i++)
            apart = fmax(apart, fabs(own.R[i / 3][i % 3] - found[k].R[i / 3][i % 3]));
        if (apart < CHASLES_WRIST_SAME)
            return count;
        at = k < at && own.trace > found[k].trace ? k : at;
    }
    memmove(found + at + 1, found + at, (size_t)(count - at) * sizeof *found);
    found[at] = own;
    return count + 1;
}

/* Writes all possible rotations of the platform, and returns the number of rotations. */
static int chasles_wrist_rotations(const chasles_carried_wrist_arm *arm,
                                   const chasles_wrist_equations *equations,
                                   chasles_wrist_rotation *found)
{
    chasles_circle_series series;
    chasles_circle_roots roots;
    int count = 0;
    if (!chasles_wrist_polynomial(arm, equations, &series))
        return 0;
    chasles_circle_real(0, 0, &series, &roots);
    for (int k = 0; k < roots.count; k++) {
        double near = roots.imaginary[k];
        for (int i = 0; i < roots.count; i++) {
            const double apart = fabs(chasles_circle_wrapped(roots.angle[i] - roots.angle[k]));
            near = i != k && apart < CHASLES_TWINS && apart > near ? apart : near;
        }
        for (int side = near > 0.0 ? -1 : 0; side <= (near > 0.0); side++) {
            const double alpha = roots.angle[k] + side * near;
            double axes[3][3], linear[2][3];
            chasles_wrist_linear(arm, equations, cos(alpha), sin(alpha), axes, linear);
            const double sizes[2] = {hypot(linear[0][0], linear[0][1]),
                                     hypot(linear[1][0], linear[1][1])};
            const double *L = linear[sizes[1] > sizes[0]], size = sizes[sizes[1] > sizes[0]];
            const double middle = atan2(L[1], L[0]);
            const double aside = acos(fmax(-1.0, fmin(1.0, -L[2] / size)));
            for (int sign = -1; sign <= 1; sign += 2)
                count = chasles_wrist_added(arm, equations, (const double(*)[3])axes,
                                            middle + sign * aside, found, count);
        }
    }
    return count;
}

/* Writes every inverse-kinematics solution for a tool pose to the solution slots, and NaN to unused
 * slots. */
static void chasles_carried_wrist_ik(const chasles_carried_wrist_arm *arm, const double *T,
                                     const double *given, double *q, double *residual,
                                     double *margin)
{
    chasles_wrist_equations equations;
    chasles_wrist_rotation found[CHASLES_WRIST_ROTATIONS];
    double center[3], P[16] = {0.0};
    const int slots = arm->slots, n = arm->coordinates;
    int count = 0;
    (void)given;
    if (chasles_wrist_setup(arm, T, center, &equations))
        count = chasles_wrist_rotations(arm, &equations, found);
    chasles_carried_unused(slots * count, slots * CHASLES_WRIST_ROTATIONS, n, q, residual, margin);
    P[15] = 1.0;
    for (int k = 0; k < count; k++) {
        for (int i = 0; i < 3; i++) {
            memcpy(P + 4 * i, found[k].R[i], sizeof found[k].R[i]);
            P[4 * i + 3] = center[i] - chasles_carried_dot(found[k].R[i], arm->center);
        }
        arm->legs(T, P, q + slots * n * k, residual + slots * k, margin + slots * k);
        chasles_carried_reached(arm->fk, T, arm->size, found[k].margin, slots, n, q + slots * n * k,
                                residual + slots * k, margin + slots * k);
    }
}

#endif
