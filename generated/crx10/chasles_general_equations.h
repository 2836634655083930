/* The equations of Raghavan and Roth for an arm of six revolute joints, as the eigenvalues of a
 * matrix; part of chasles, the same for every such robot. What the names mean is told in
 * chasles_general.h.
 */
#ifndef CHASLES_GENERAL_EQUATIONS_H
#define CHASLES_GENERAL_EQUATIONS_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_eigenvalues.h"
#include "chasles_general_tolerances.h"

#define CHASLES_ROOTS 16

/* What an arm is, besides its pose and Jacobian. Local angles are sign * q. */
typedef struct {
    /* left[14][9]: the columns of 1 and of the eight products y. */
    void (*left)(const double *T, double *left);
    void (*pose_jacobian)(const double *q, double *T, double *J);
    int joint[6]; /* index in q: the pair, suppressed, v, w, and the joint that is left */
    double sign[6];
    double length;          /* m, the arm's size: weighs metres against radians */
    double right[3][14][9]; /* B: of 1, cos s, sin s */
    double own[12][12];     /* unknowns (alpha, beta, gamma) to u as they meet 1 / (1 - i t) */
    double back[12][12];    /* inverse of the same as they meet t: the negative is taken here */
} chasles_general_arm;

typedef struct {
    double factor[14][8]; /* the triangle of A */
    double head[3][8][9]; /* the rows of B that go with it */
    double M[3][12][12];
} chasles_general_system;

typedef struct {
    double q[6];
    double imaginary; /* of s; 0 for a real root */
    double along;     /* s */
} chasles_general_start;

static double chasles_general_wrapped(double angle)
{
    const double turn = 6.283185307179586476925286766559;
    const double wrapped = angle - turn * floor(angle / turn + 0.5);
    return wrapped <= -0.5 * turn ? 0.5 * turn : wrapped;
}

/* The six equations without y, doubled, and the eight that give y. */
static void chasles_general_eliminate(const chasles_general_arm *arm, const double *T,
                                      chasles_general_system *system)
{
    double left[14 * 9], S[14][36];
    arm->left(T, left);
    for (int i = 0; i < 14; i++) {
        for (int k = 0; k < 8; k++)
            S[i][k] = left[9 * i + 1 + k];
        for (int m = 0; m < 3; m++) {
            for (int k = 0; k < 9; k++)
                S[i][8 + 9 * m + k] = arm->right[m][i][k];
        }
        S[i][8] -= left[9 * i];
        S[i][35] = 0.0;
    }
    /* Householder's reflections of the columns of y. */
    for (int j = 0; j < 8; j++) {
        double norm = 0.0, h[14], sum[36] = {0.0};
        for (int i = j; i < 14; i++)
            norm += S[i][j] * S[i][j];
        norm = copysign(sqrt(norm), S[j][j]);
        const double scale = norm * (norm + S[j][j]);
        if (scale == 0.0)
            continue;
        for (int i = j; i < 14; i++)
            h[i] = S[i][j];
        h[j] += norm;
        for (int i = j; i < 14; i++) {
            for (int k = 0; k < 36; k++)
                sum[k] += h[i] * S[i][k];
        }
        for (int k = 0; k < 36; k++)
            sum[k] /= scale;
        for (int i = j; i < 14; i++) {
            for (int k = 0; k < 36; k++)
                S[i][k] -= h[i] * sum[k];
        }
    }
    for (int i = 0; i < 8; i++) {
        for (int k = 0; k < 8; k++)
            system->factor[i][k] = S[i][k];
        for (int m = 0; m < 3; m++) {
            for (int k = 0; k < 9; k++)
                system->head[m][i][k] = S[i][8 + 9 * m + k];
        }
    }
    for (int m = 0; m < 3; m++) {
        for (int i = 0; i < 6; i++) {
            double *even = system->M[m][i], *odd = system->M[m][6 + i];
            const double *row = S[8 + i] + 8 + 9 * m;
            for (int k = 0; k < 3; k++) {
                const double one = row[k], c = 0.5 * row[3 + k], s = 0.5 * row[6 + k];
                even[k] = c, even[3 + k] = s, even[6 + k] = one + c, even[9 + k] = s;
                odd[k] = -s, odd[3 + k] = c, odd[6 + k] = s, odd[9 + k] = one - c;
            }
        }
    }
}

/* Solves the first n columns of a for the rest in place; returns the least ratio of pivots. */
static double chasles_general_divide(double (*a)[28])
{
    double least = DBL_MAX, most = 0.0;
    for (int j = 0; j < 12; j++) {
        int p = j;
        for (int i = j + 1; i < 12; i++) {
            if (fabs(a[i][j]) > fabs(a[p][j]))
                p = i;
        }
        const double pivot = fabs(a[p][j]);
        if (!(pivot > 0.0))
            return 0.0;
        least = pivot < least ? pivot : least;
        most = pivot > most ? pivot : most;
        if (p != j) {
            double row[28];
            memcpy(row, a[p], sizeof row);
            memcpy(a[p], a[j], sizeof row);
            memcpy(a[j], row, sizeof row);
        }
        const double inverse = 1.0 / a[j][j];
        for (int i = j + 1; i < 12; i++) {
            const double factor = a[i][j] * inverse;
            for (int k = j; k < 28; k++)
                a[i][k] -= factor * a[j][k];
        }
    }
    for (int j = 11; j >= 0; j--) {
        const double inverse = 1.0 / a[j][j];
        for (int k = 12; k < 28; k++)
            a[j][k] *= inverse;
        for (int i = 0; i < j; i++) {
            const double factor = a[i][j];
            for (int k = 12; k < 28; k++)
                a[i][k] -= factor * a[j][k];
        }
    }
    return least / most;
}

/* The matrix whose eigenvalues are tan((s - from) / 2); returns its least ratio of pivots. */
static double chasles_general_companion(const chasles_general_arm *arm,
                                        const chasles_general_system *system, double from,
                                        double (*H)[16])
{
    const double c = cos(from), s = sin(from);
    double a[12][28], plus[12][12], twice[12][12];
    for (int i = 0; i < 12; i++) {
        for (int k = 0; k < 12; k++) {
            const double m0 = system->M[0][i][k];
            const double along = c * system->M[1][i][k] + s * system->M[2][i][k];
            plus[i][k] = m0 + along;
            a[i][k] = m0 - along;
            twice[i][k] = 2.0 * (c * system->M[2][i][k] - s * system->M[1][i][k]);
        }
        for (int k = 12; k < 28; k++)
            a[i][k] = 0.0;
        for (int m = 0; m < 12; m++) {
            for (int k = 0; k < 12; k++)
                a[i][12 + k] += plus[i][m] * arm->own[m][k];
            for (int k = 0; k < 4; k++)
                a[i][24 + k] += twice[i][m] * arm->own[m][8 + k];
        }
    }
    const double ratio = chasles_general_divide(a);
    for (int i = 0; i < 12; i++) {
        double row[16] = {0.0};
        for (int m = 0; m < 12; m++) {
            for (int k = 0; k < 16; k++)
                row[k] -= arm->back[i][m] * a[m][12 + k];
        }
        memcpy(H[i < 8 ? i : i + 4], row, sizeof row);
    }
    memset(H[8], 0, 4 * sizeof H[8]);
    for (int k = 0; k < 4; k++)
        H[8 + k][12 + k] = 1.0;
    return ratio;
}

/* A vector that M(s) takes nearest to zero, by elimination with the largest pivot of all. */
static void chasles_general_null(const chasles_general_system *system, double c, double s,
                                 double *u)
{
    double a[12][12];
    int name[12];
    for (int i = 0; i < 12; i++) {
        name[i] = i;
        for (int k = 0; k < 12; k++) {
            a[i][k] = system->M[0][i][k] + c * system->M[1][i][k] + s * system->M[2][i][k];
        }
    }
    for (int j = 0; j < 11; j++) {
        int row = j, column = j;
        double most = -1.0;
        for (int i = j; i < 12; i++) {
            for (int k = j; k < 12; k++) {
                if (fabs(a[i][k]) > most)
                    most = fabs(a[i][k]), row = i, column = k;
            }
        }
        if (!(most > 0.0))
            break;
        for (int k = 0; k < 12; k++) {
            const double kept = a[row][k];
            a[row][k] = a[j][k], a[j][k] = kept;
        }
        for (int i = 0; i < 12; i++) {
            const double kept = a[i][column];
            a[i][column] = a[i][j], a[i][j] = kept;
        }
        const int kept = name[column];
        name[column] = name[j], name[j] = kept;
        const double inverse = 1.0 / a[j][j];
        for (int i = j + 1; i < 12; i++) {
            const double factor = a[i][j] * inverse;
            for (int k = j; k < 12; k++)
                a[i][k] -= factor * a[j][k];
        }
    }
    u[name[11]] = 1.0;
    for (int j = 10; j >= 0; j--) {
        double sum = 0.0;
        for (int k = j + 1; k < 12; k++)
            sum += a[j][k] * u[name[k]];
        u[name[j]] = a[j][j] != 0.0 ? -sum / a[j][j] : 0.0;
    }
}

/* The other joints at an angle s of the suppressed one. */
static void chasles_general_back(const chasles_general_arm *arm,
                                 const chasles_general_system *system, const double *T,
                                 double along, double *q)
{
    const double cs = cos(along), ss = sin(along);
    double u[12], r[3] = {0.0}, local[5];
    chasles_general_null(system, cs, ss, u);
    /* u is a product of two vectors: their directions, from the largest row. */
    int row = 0;
    double most = -1.0;
    for (int i = 0; i < 4; i++) {
        const double size =
            u[3 * i] * u[3 * i] + u[3 * i + 1] * u[3 * i + 1] + u[3 * i + 2] * u[3 * i + 2];
        if (size > most)
            most = size, row = i;
    }
    for (int i = 0; i < 4; i++) {
        const double weight =
            u[3 * i] * u[3 * row] + u[3 * i + 1] * u[3 * row + 1] + u[3 * i + 2] * u[3 * row + 2];
        for (int k = 0; k < 3; k++)
            r[k] += weight * u[3 * i + k];
    }
    const double sign = copysign(1.0, r[0]);
    const double w = atan2(sign * r[2], sign * r[1]);
    const double v = 2.0 * atan2(u[9] * r[0] + u[10] * r[1] + u[11] * r[2],
                                 u[6] * r[0] + u[7] * r[1] + u[8] * r[2]);
    const double of_v[3] = {1.0, cos(v), sin(v)}, of_w[3] = {1.0, cos(w), sin(w)};
    double y[8];
    for (int i = 7; i >= 0; i--) {
        double sum = 0.0;
        for (int k = 0; k < 9; k++) {
            sum +=
                of_v[k / 3] * of_w[k % 3] *
                (system->head[0][i][k] + cs * system->head[1][i][k] + ss * system->head[2][i][k]);
        }
        for (int k = i + 1; k < 8; k++)
            sum -= system->factor[i][k] * y[k];
        y[i] = system->factor[i][i] != 0.0 ? sum / system->factor[i][i] : 0.0;
    }
    local[0] = atan2(y[5], y[2]), local[1] = atan2(y[1], y[0]);
    local[2] = along, local[3] = v, local[4] = w;
    for (int k = 0; k < 5; k++)
        q[arm->joint[k]] = chasles_general_wrapped(arm->sign[k] * local[k]);
    /* The last turns what is left of the pose about its axis. */
    const int last = arm->joint[5];
    double at[16], J[36], axis[3], vector[3] = {0.0}, trace = 0.0;
    q[last] = 0.0;
    arm->pose_jacobian(q, at, J);
    for (int k = 0; k < 3; k++) {
        const double a[3] = {at[k], at[4 + k], at[8 + k]}, b[3] = {T[k], T[4 + k], T[8 + k]};
        axis[k] = J[6 * (3 + k) + last];
        vector[0] += a[1] * b[2] - a[2] * b[1];
        vector[1] += a[2] * b[0] - a[0] * b[2];
        vector[2] += a[0] * b[1] - a[1] * b[0];
        trace += a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    }
    q[last] = atan2(axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2], trace - 1.0);
}

/* Starts for Newton's steps, one a root; how many. Also how far M was from being singular. */
static int chasles_general_starts(const chasles_general_arm *arm, const double *T,
                                  chasles_general_start *starts, double *ratio)
{
    static const double from[] = {0.4, 2.5, -1.7, 1.45, -2.75, -0.65};
    chasles_general_system system;
    double H[16][16], best[16][16], re[16], im[16], at = 0.0;
    *ratio = -1.0;
    chasles_general_eliminate(arm, T, &system);
    for (int k = 0; k < 6 && *ratio < CHASLES_PIVOT; k++) {
        const double own = chasles_general_companion(arm, &system, from[k], H);
        if (own > *ratio) {
            *ratio = own, at = from[k];
            memcpy(best, H, sizeof H);
        }
    }
    if (!(*ratio > 0.0))
        return 0;
    chasles_general_balance(best);
    chasles_general_hessenberg(best);
    const int count = chasles_general_eigenvalues(best, re, im);
    for (int k = 0; k < count; k++) {
        const double x = re[k], y = im[k];
        chasles_general_start *start = starts + k;
        start->along = at + atan2(x, 1.0 - y) + atan2(x, 1.0 + y);
        start->imaginary =
            y == 0.0 ? 0.0
                     : 0.5 * log(((1.0 + y) * (1.0 + y) + x * x) / ((1.0 - y) * (1.0 - y) + x * x));
        if (y < 0.0) {
            memcpy(start->q, starts[k - 1].q, sizeof start->q);
        } else {
            chasles_general_back(arm, &system, T, start->along, start->q);
        }
    }
    return count;
}

#endif
