/* Inverse kinematics of an arm of six revolute joints of any geometry; part of chasles, the same
 * for every such robot.
 *
 * Raghavan and Roth's fourteen equations A y = B(s) x hold for the products y of the cosines and
 * sines of two joints (those of the pair), and x = (1, cos, sin) of joint v times (1, cos, sin) of
 * joint w; B depends on the angle s of one more joint, the suppressed one, and A on the pose. Six
 * combinations of rows are free of y. They are doubled with the half angle of v, which gives twelve
 * equations M(s) u = 0 in as many unknowns, (cos 3v/2, sin 3v/2, cos v/2, sin v/2) x (1, cos w,
 * sin w): bounded for every angle, with no infinity at pi. M = M0 + M1 cos s + M2 sin s. A constant
 * change of unknowns takes out what M would have in common with 1 + tan^2(s/2), and leaves the
 * sixteen angles s as the eigenvalues of a matrix. The other joints follow linearly, and Newton
 * steps on the pose end it. No allocation, no state, libm alone.
 */
#ifndef CHASLES_GENERAL_H
#define CHASLES_GENERAL_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_general_equations.h"
#include "chasles_general_newton.h"
#include "chasles_general_tolerances.h"

/* Solutions found so far, none twice. */
typedef struct {
    int count;
    double q[CHASLES_ROOTS][6], residual[CHASLES_ROOTS], margin[CHASLES_ROOTS];
} chasles_general_found;

static void chasles_general_keep(const chasles_general_arm *arm, chasles_general_found *found,
                                 const double *q, double residual, const double *J)
{
    if (!(residual <= CHASLES_SOLVED))
        return;
    const double margin = chasles_general_margin(J, arm->length);
    int own = 0;
    for (; own < found->count; own++) {
        double most = 0.0;
        for (int k = 0; k < 6; k++) {
            const double apart = fabs(chasles_general_wrapped(q[k] - found->q[own][k]));
            most = apart > most ? apart : most;
        }
        if (most < CHASLES_SAME)
            break;
    }
    if (own < found->count) {
        if (found->residual[own] <= residual)
            return;
    } else if (found->count < CHASLES_ROOTS) {
        found->count++;
    } else {
        /* One of infinitely many makes room for one that stands alone. */
        own = 0;
        for (int k = 1; k < CHASLES_ROOTS; k++)
            own = found->margin[k] < found->margin[own] ? k : own;
        if (found->margin[own] >= margin)
            return;
    }
    memcpy(found->q[own], q, 6 * sizeof *q);
    found->residual[own] = residual;
    found->margin[own] = margin;
}

/* The direction in which J moves the pose least, by one step of inverse iteration. */
static void chasles_general_least(const double *J, double length, double *direction)
{
    double a[6][7], norm = 0.0;
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < 6; k++) {
            a[i][k] = i == k ? CHASLES_SHIFT : 0.0;
            for (int m = 0; m < 6; m++) {
                a[i][k] += J[6 * m + i] * J[6 * m + k] * (m < 3 ? 1.0 / (length * length) : 1.0);
            }
        }
        a[i][6] = 1.0 + 0.1 * i;
        direction[i] = 0.0;
    }
    chasles_general_solve(a, direction);
    for (int k = 0; k < 6; k++)
        norm += direction[k] * direction[k];
    norm = norm > 0.0 ? sqrt(norm) : 1.0;
    for (int k = 0; k < 6; k++)
        direction[k] /= norm;
}

/* Newton's steps from a start; from both sides of one where two roots are about to meet. */
static void chasles_general_try(const chasles_general_arm *arm, const double *T,
                                const chasles_general_start *start, int most,
                                chasles_general_found *found)
{
    double q[6], J[36], direction[6], at[16], e[6];
    if (start->imaginary == 0.0) {
        memcpy(q, start->q, sizeof q);
        const double left = chasles_general_polish(arm, T, most, q, J);
        chasles_general_keep(arm, found, q, left, J);
        return;
    }
    arm->pose_jacobian(start->q, at, J);
    chasles_general_least(J, arm->length, direction);
    const double apart = sqrt(chasles_general_error(T, at, e)) + fabs(start->imaginary);
    const double way = start->imaginary > 0.0 ? apart : -apart;
    for (int k = 0; k < 6; k++)
        q[k] = start->q[k] + way * direction[k];
    const double left = chasles_general_polish(arm, T, most, q, J);
    chasles_general_keep(arm, found, q, left, J);
}

/* The pose turned and moved a little, each time another way. */
static void chasles_general_nudged(const double *T, double length, double size, int way,
                                   double *near)
{
    static const double ways[][6] = {
        {0.6, -0.5, 0.4, 0.3, 0.7, -0.6},
        {-0.3, 0.8, 0.5, -0.7, 0.2, 0.5},
        {0.7, 0.2, -0.6, 0.5, -0.4, -0.8},
        {-0.5, -0.6, -0.2, -0.4, 0.6, 0.3},
    };
    const double *w = ways[way % 4];
    const double a = size * w[0], b = size * w[1], c = size * w[2];
    const double n = 1.0 / (1.0 + a * a + b * b + c * c);
    /* Cayley's rotation, so that the pose stays one. */
    const double R[3][3] = {
        {n * (1.0 + a * a - b * b - c * c), 2.0 * n * (a * b - c), 2.0 * n * (a * c + b)},
        {2.0 * n * (a * b + c), n * (1.0 - a * a + b * b - c * c), 2.0 * n * (b * c - a)},
        {2.0 * n * (a * c - b), 2.0 * n * (b * c + a), n * (1.0 - a * a - b * b + c * c)},
    };
    memcpy(near, T, 16 * sizeof *T);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            near[4 * i + k] = R[i][0] * T[k] + R[i][1] * T[4 + k] + R[i][2] * T[8 + k];
        }
        near[4 * i + 3] += size * length * w[3 + i];
    }
}

/* Every solution of a pose in sixteen slots: solutions first, by the suppressed joint; then what
 * lies nearest to a solution where there is none, with what it leaves of the pose. */
static void chasles_general_ik(const chasles_general_arm *arm, const double *T, double *q,
                               double *residual, double *margin)
{
    chasles_general_start starts[CHASLES_ROOTS], others[CHASLES_ROOTS];
    chasles_general_found found;
    double J[36], near[16], ratio;
    found.count = 0;
    int count = 0, finite = 1;
    for (int k = 0; k < 16; k++)
        finite = finite && T[k] - T[k] == 0.0;
    if (!finite) {
        for (int k = 0; k < CHASLES_ROOTS; k++) {
            for (int i = 0; i < 6; i++)
                q[6 * k + i] = NAN;
            residual[k] = margin[k] = NAN;
        }
        return;
    }
    count = chasles_general_starts(arm, T, starts, &ratio);
    double nearest = count < CHASLES_ROOTS ? 0.0 : DBL_MAX;
    int real = 0;
    for (int k = 0; k < count; k++) {
        const double imaginary = fabs(starts[k].imaginary);
        nearest = imaginary < nearest ? imaginary : nearest;
        if (imaginary > 0.0)
            continue;
        chasles_general_try(arm, T, starts + k, 50, &found);
        real++;
    }
    const int unsure = found.count < real || !(ratio > CHASLES_SINGULAR);
    for (int k = 0; k < count; k++) {
        const double imaginary = fabs(starts[k].imaginary);
        if (imaginary > 0.0 && imaginary < CHASLES_NEARLY_REAL) {
            chasles_general_try(arm, T, starts + k, 50, &found);
        }
    }
    /* Solutions come in pairs: of an odd number, or of none, one may hide. So may some where roots
     * ran together or the equations fail; from poses nearby they are found. */
    for (int k = 0; k < 6 && nearest < CHASLES_HIDING; k++) {
        static const double sizes[] = {1e-5, 1e-3, 1e-4, 1e-2, 1e-3, 1e-2};
        if (!unsure && found.count > 0 && found.count % 2 == 0)
            break;
        chasles_general_nudged(T, arm->length, sizes[k], k, near);
        const int some = chasles_general_starts(arm, near, others, &ratio);
        for (int i = 0; i < some; i++) {
            if (fabs(others[i].imaginary) < CHASLES_NEARLY_REAL + 2.0 * sqrt(sizes[k])) {
                chasles_general_polish(arm, near, 3, others[i].q, J);
                chasles_general_try(arm, T, others + i, 50, &found);
            }
        }
    }
    /* Out of reach, or where several solutions run together and steps get short. */
    for (int k = 0; k < count && found.count == 0; k++) {
        if (starts[k].imaginary < 0.0)
            continue;
        double left = chasles_general_polish(arm, T, 200, starts[k].q, J);
        if (left < CHASLES_NEAR)
            left = chasles_general_polish(arm, T, 1000, starts[k].q, J);
        chasles_general_keep(arm, &found, starts[k].q, left, J);
    }
    for (int i = 0; i < found.count; i++) {
        int k = i;
        const int key = arm->joint[2];
        for (; k > 0 && q[6 * (k - 1) + key] > found.q[i][key]; k--) {
            memcpy(q + 6 * k, q + 6 * (k - 1), 6 * sizeof *q);
            residual[k] = residual[k - 1], margin[k] = margin[k - 1];
        }
        memcpy(q + 6 * k, found.q[i], 6 * sizeof *q);
        residual[k] = found.residual[i], margin[k] = found.margin[i];
    }
    int slot = found.count;
    for (int k = 0; k < count + CHASLES_ROOTS && slot < CHASLES_ROOTS; k++) {
        double *own = q + 6 * slot;
        memset(own, 0, 6 * sizeof *q);
        if (k < count)
            memcpy(own, starts[k].q, 6 * sizeof *q);
        residual[slot] = chasles_general_polish(arm, T, 0, own, J);
        margin[slot] = -residual[slot];
        slot += residual[slot] > CHASLES_SOLVED && (k >= count || starts[k].imaginary != 0.0);
    }
}

#endif
