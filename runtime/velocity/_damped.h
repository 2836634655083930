/* Damped least squares within a box, for one Jacobian after another along a path.
 *
 * Wanted is the x nearest to solving J x = y, J (6, n), with lower <= x <= upper. All numbers are
 * comparable: the caller has scaled rows and columns to one unit. With J = U S V^T, the small
 * singular values are damped, each by itself (numerical filtering):
 *
 *     x = sum of  s_i / (s_i^2 + d_i^2)  (u_i . y) v_i,   d_i^2 = (1 - (s_i / e)^2) d^2  if s_i < e
 *                                                                0                      else
 *
 * and where that leaves the box, x minimises  |J x - y|^2 + sum of d_i^2 (v_i . x)^2  within it.
 *
 * The decomposition is that of _orthogonal.h. From one step of a path to the next J changes little,
 * so U is kept: its rows, applied to the next J, are nearly orthogonal already.
 *
 * Sources:
 *     S. Chiaverini, B. Siciliano, O. Egeland, Review of the damped least-squares inverse kinematics
 *     with experiments on an industrial robot manipulator, IEEE Trans. Control Systems Technology 2,
 *     1994: numerical filtering, here of all small singular values instead of the smallest.
 *     A. A. Maciejewski, C. A. Klein, The singular value decomposition: computation and applications
 *     to robotics, Int. J. Robotics Research 8, 1989: keeping U.
 *     P. B. Stark, R. L. Parker, Bounded-variable least squares, Computational Statistics 10, 1995.
 */
#ifndef CHASLES_DAMPED_H
#define CHASLES_DAMPED_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "numerics/_orthogonal.h"

#define DAMPED_ROWS 6
#define DAMPED_ORTHOGONAL 1e-13 /* products of rows, over the larger of their squares */
#define DAMPED_AFRESH 64       /* steps after which U starts anew: rounding wears it out */
#define DAMPED_FREE 1e-4       /* within the box: damping of what J does not see, over e */
#define DAMPED_MOST 1.0         /* d at most */
#define DAMPED_RELEASE 1e-10   /* pull from a bound that frees a variable, over the largest pull */

typedef struct {
    int n;
    double smallest; /* e, a singular value */
    double least;    /* d, to begin with */
    double damping;  /* d now, and e where it is more than that; see damped_judge */
    int age;         /* steps since U started anew */
    double U[DAMPED_ROWS * DAMPED_ROWS]; /* u_i in rows */
    double sigma[DAMPED_ROWS];           /* s_i, in no order */
    double damped[DAMPED_ROWS];          /* d_i^2 */
    double *rows;                        /* (6, n): s_i v_i */
    double *x;                           /* (n) the result */
    int *at;                             /* (n) -1 or 1 where x is at a bound of the box, else 0 */
    double *H, *L, *g, *z;               /* for the box: (n, n), (n, n), (n), (n) */
    int *free;                           /* (n) */
} damped;

/* One block for n columns; 0 if there is no memory. Returned by damped_free. */
static inline int damped_new(damped *s, int n, double smallest, double damping)
{
    size_t N = (size_t)n;
    double *block = malloc((N * (DAMPED_ROWS + 3 + 2 * N)) * sizeof(double) + 2 * N * sizeof(int));
    if (!block) {
        return 0;
    }
    *s = (damped){.n = n, .smallest = smallest, .least = damping, .damping = damping};
    s->age = DAMPED_AFRESH;
    s->rows = block;
    s->x = s->rows + DAMPED_ROWS * N;
    s->g = s->x + N;
    s->z = s->g + N;
    s->H = s->z + N;
    s->L = s->H + N * N;
    s->at = (int *)(s->L + N * N);
    s->free = s->at + N;
    return 1;
}

static inline void damped_free(damped *s)
{
    free(s->rows);
}

/* By the larger of both: what a small row has of a large one is beneath the damping. */
static inline int damped_orthogonal(double aa, double bb, double ab, double unused)
{
    (void)unused;
    return !(fabs(ab) > DAMPED_ORTHOGONAL * fmax(aa, bb));
}

/* Decomposes J (6, n). Returns the smallest of its min(6, n) singular values. */
static inline double damped_decompose(damped *s, const double *J)
{
    int n = s->n;
    if (s->age++ >= DAMPED_AFRESH) {
        memset(s->U, 0, sizeof s->U);
        for (int i = 0; i < DAMPED_ROWS; i++) {
            s->U[(DAMPED_ROWS + 1) * i] = 1;
        }
        s->age = 0;
    }
    for (int i = 0; i < DAMPED_ROWS; i++) {
        double *row = s->rows + i * n;
        memset(row, 0, n * sizeof *row);
        for (int k = 0; k < DAMPED_ROWS; k++) {
            double u = s->U[DAMPED_ROWS * i + k];
            for (int j = 0; j < n; j++) {
                row[j] += u * J[k * n + j];
            }
        }
    }
    rows_orthogonalize(s->rows, DAMPED_ROWS, n, s->U, DAMPED_ROWS, damped_orthogonal, 0);
    double ordered[DAMPED_ROWS], below = fmax(s->smallest, s->damping);
    for (int i = 0; i < DAMPED_ROWS; i++) {
        double value = sqrt(rows_dot(s->rows + i * n, s->rows + i * n, n));
        double part = value / below;
        s->sigma[i] = value;
        s->damped[i] = part < 1 ? (1 - part * part) * s->damping * s->damping : 0;
        int place = i;
        for (; place > 0 && ordered[place - 1] < value; place--) {
            ordered[place] = ordered[place - 1];
        }
        ordered[place] = value;
    }
    return ordered[(n < DAMPED_ROWS ? n : DAMPED_ROWS) - 1];
}

/* x of the last decomposition, without a box. */
static inline void damped_solve(damped *s, const double y[DAMPED_ROWS])
{
    memset(s->x, 0, s->n * sizeof *s->x);
    for (int i = 0; i < DAMPED_ROWS; i++) {
        double square = s->sigma[i] * s->sigma[i] + s->damped[i];
        double along = rows_dot(s->U + DAMPED_ROWS * i, y, DAMPED_ROWS) / square;
        for (int j = 0; j < s->n; j++) {
            s->x[j] += along * s->rows[i * s->n + j];
        }
    }
}

/* Solves for the free variables while the others stay, into z; H is positive definite. */
static inline void damped_solve_free(damped *s, int count)
{
    int n = s->n;
    double *L = s->L, *z = s->z;
    for (int a = 0; a < count; a++) {
        int i = s->free[a];
        double right = s->g[i];
        for (int j = 0; j < n; j++) {
            right -= s->at[j] ? s->H[i * n + j] * s->x[j] : 0;
        }
        for (int b = 0; b <= a; b++) {
            double rest = s->H[i * n + s->free[b]] - rows_dot(L + a * n, L + b * n, b);
            L[a * n + b] = b < a ? rest / L[b * n + b] : sqrt(fmax(rest, 1e-300));
        }
        z[a] = (right - rows_dot(L + a * n, z, a)) / L[a * n + a];
    }
    for (int a = count - 1; a >= 0; a--) {
        for (int b = a + 1; b < count; b++) {
            z[a] -= L[b * n + a] * z[b];
        }
        z[a] /= L[a * n + a];
    }
}

/* Goes from x towards z, up to the first bound; 1 if it met one. */
static inline int damped_advance(damped *s, int count, const double *lower, const double *upper)
{
    double part = 1;
    int met = -1;
    for (int a = 0; a < count; a++) {
        int i = s->free[a];
        double bound = s->z[a] < lower[i] ? lower[i] : upper[i];
        double to_bound = (bound - s->x[i]) / (s->z[a] - s->x[i]);
        if ((s->z[a] < lower[i] || s->z[a] > upper[i]) && to_bound < part) {
            part = fmax(to_bound, 0);
            met = a;
        }
    }
    for (int a = 0; a < count; a++) {
        s->x[s->free[a]] += part * (s->z[a] - s->x[s->free[a]]);
    }
    if (met < 0) {
        return 0;
    }
    int i = s->free[met];
    s->at[i] = s->z[met] < lower[i] ? -1 : 1;
    s->x[i] = s->at[i] < 0 ? lower[i] : upper[i];
    return 1;
}

/* Frees the variable that is pulled from its bound the most; 0 if none is. */
static inline int damped_release(damped *s, const double *lower, const double *upper)
{
    int n = s->n, best = -1;
    double most = 0;
    for (int i = 0; i < n; i++) {
        most = fmax(most, DAMPED_RELEASE * fabs(s->g[i]));
    }
    for (int i = 0; i < n; i++) {
        if (s->at[i] == 0 || lower[i] == upper[i]) {
            continue;
        }
        double pull = -s->at[i] * (s->g[i] - rows_dot(s->H + i * n, s->x, n));
        if (pull > most) {
            most = pull;
            best = i;
        }
    }
    if (best < 0) {
        return 0;
    }
    s->at[best] = 0;
    return 1;
}

/* x within the box, from that of damped_solve; nothing else is done where it is inside. A variable
 * at a bound has its value exactly. */
static inline void damped_box(damped *s, const double *lower, const double *upper)
{
    int n = s->n, outside = 0;
    for (int i = 0; i < n; i++) {
        s->at[i] = s->x[i] < lower[i] ? -1 : s->x[i] > upper[i] ? 1 : 0;
        outside |= s->at[i];
    }
    if (!outside) {
        return;
    }
    memset(s->H, 0, (size_t)n * n * sizeof *s->H);
    for (int k = 0; k < DAMPED_ROWS; k++) {
        double square = s->sigma[k] * s->sigma[k], *row = s->rows + k * n;
        double weight = square > 0 ? 1 + s->damped[k] / square : 0;
        for (int i = 0; i < n; i++) {
            for (int j = 0; j < n; j++) {
                s->H[i * n + j] += weight * row[i] * row[j];
            }
        }
    }
    double unseen = DAMPED_FREE * s->smallest;
    for (int i = 0; i < n; i++) {
        s->H[(n + 1) * i] += unseen * unseen;
    }
    for (int i = 0; i < n; i++) {
        s->g[i] = rows_dot(s->H + i * n, s->x, n);
    }
    for (int i = 0; i < n; i++) {
        s->x[i] = s->at[i] < 0 ? lower[i] : s->at[i] > 0 ? upper[i] : s->x[i];
    }
    /* Every round leaves x in the box; far fewer are needed than are allowed. */
    for (int round = 0; round < 8 * n; round++) {
        int count = 0;
        for (int i = 0; i < n; i++) {
            if (!s->at[i]) {
                s->free[count++] = i;
            }
        }
        damped_solve_free(s, count);
        if (!damped_advance(s, count, lower, upper) && !damped_release(s, lower, upper)) {
            return;
        }
    }
}

/* |J x - y|^2 for the x found. */
static inline double damped_remains(const damped *s, const double y[DAMPED_ROWS])
{
    double sum = 0;
    for (int i = 0; i < DAMPED_ROWS; i++) {
        double rest = rows_dot(s->U + DAMPED_ROWS * i, y, DAMPED_ROWS) -
                      rows_dot(s->rows + i * s->n, s->x, s->n);
        sum += rest * rest;
    }
    return sum;
}

/* Adapts the damping to how far J is to be trusted (Marquardt): of the squares before a step, after
 * it as J had it, and after it in fact. At the border of reach a step along a lost direction, which
 * J overrates, would else go back and forth across the singularity. */
static inline void damped_judge(damped *s, double before, double expected, double after)
{
    double gained = before - after, promised = before - expected;
    if (promised <= 1e-12 * before) {
        return;
    }
    if (gained < 0.25 * promised) {
        s->damping = fmin(2 * s->damping, DAMPED_MOST);
    }
    else if (gained > 0.75 * promised) {
        s->damping = fmax(s->damping / 1.05, s->least);
    }
}

#endif
