/* Levenberg-Marquardt on compiled forward kinematics, within joint limits.
 *
 * Of a pose T_d that is wanted and the pose T(q) of the tool, e is the twist from one to the other
 * in base axes, with W the weights of its six parts. From a start, each step solves
 *
 *     (J^T W^2 J + lambda 1) dq = J^T W^2 e,    lambda = mu |W e|^2 / 2
 *
 * for the coordinates that no limit holds: those that stand at a limit and would go beyond it keep
 * their values. The step is cut off at the limits; it is taken if |W e| falls, and mu falls too;
 * else mu rises. As lambda vanishes with the error, convergence is quadratic, also at
 * singularities' edge; where the error cannot vanish the iteration ends at its least.
 *
 * Where branches meet, the error hardly falls along the tangent: there Halley's step, by J + H dq / 2
 * with the Hessian H, is tried as well.
 *
 * A start that gains little is followed by the next: starts are a table of configurations with their
 * poses, of which the one whose pose is nearest comes first. Where none reaches the pose, the best
 * are brought to the least error nearby, of distance and angle apart.
 *
 * Source: Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method,
 * 2011 (lambda by the squared error); Bertsekas, Projected Newton methods for optimization problems
 * with simple constraints, 1982 (which coordinates a limit holds); Lloyd, Irani and Ahmadi, Fast and
 * robust inverse kinematics of serial robots using Halley's method, 2022 (J + H dq / 2).
 */
#ifndef CHASLES_NUMERIC_H
#define CHASLES_NUMERIC_H

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "contract/_kernel.h"
#include "numerics/_turn.h"

#define SPACE 6
#define POSE 16
#define KERNELS 4
#define MOST_THREADS 256
#define PIECE 16 /* poses that a thread takes at a time */

/* How an iteration ended. */
enum { CONVERGED, LIMITS, STALLED, BUDGET, NO_POSE };

#define FIRST_MU 0.1
#define MU_FALLS 0.3
#define MU_RISES 8.0
#define LEAST_LAMBDA 1e-14 /* J^T J is known to 1e-16, and may be singular */
#define MOST_LAMBDA 1e8    /* then even the smallest steps lead nowhere */
#define LONGEST_STEP 1.0   /* radian or metre in a coordinate: further, J tells nothing */
#define SMALLEST_STEP 1e-15
/* Parts of the squared error: IDLE steps that gain less are the last. From most starts that gain
 * little the next start is the shorter way; where none reaches the pose, the best is brought to the
 * least error nearby. */
#define HASTY_GAIN 0.2
#define PATIENT_GAIN 1e-12
#define NEAR 1e-5 /* residual from which patience pays: a solution is near, at a singularity */
#define IDLE 2
/* An error below CURVED that a step leaves more than a part of (CURVED_GAIN of its square) is met by
 * Halley's step too. */
#define CURVED 0.03
#define CURVED_GAIN 0.2
#define PATIENCE 4 /* part of the budget that is kept for it: 1 / PATIENCE, MOST_PATIENCE at most */
#define MOST_PATIENCE 400
#define FINALISTS 16 /* starts whose ends are brought to the least error nearby, the best first */
#define CORRECTIONS 12   /* Newton steps of a platform onto its actuators' values */
#define RIGID 1e-5 /* sum of what rows lack of unit vectors at right angles */
#define CLOSED 1e-14     /* metre or radian to which it is brought there */

/* ---------------------------------------------------------------------- arm */

/* The axis of a joint ahead of the tip: constant as seen from the frame before it. */
typedef struct {
    int frame, joint; /* -1: the base */
    double axis[SPACE];
} Screw;

typedef struct {
    /* Of the tool: (pose and Jacobian, Hessian). Of a link: (poses of all links[, rates of the
     * chain's joints by coordinates]), with the link and the screws before it. Of a platform: (pose,
     * Jacobian, actuators, their rates by the chain's joints). */
    enum { OF_TOOL, OF_LINK, OF_PLATFORM } kind;
    const chasles_kernel *kernels[KERNELS];
    int n_kernels;
    int n;     /* coordinates */
    int n_all; /* coordinates and, of a platform, the joints of its chain */
    int link, n_links, n_joints, n_screws;
    Screw *screws;
    double *lower, *upper;
    int n_starts;
    double *starts;      /* (n_starts, n_all) */
    double *start_poses; /* (12, n_starts): rows of the pose, entry by entry */
} Arm;

typedef struct {
    const double *weights; /* (6,) */
    double tolerance;
    int in_tool_axes, whole, budget;
} Task;

/* What an iteration works on; all of it in one piece of memory. */
typedef struct {
    double *q, *trial, *curved;        /* (n_all,) */
    double *best;                      /* (FINALISTS + 1, n_all): ends in order, the best last */
    double *J, *trial_J, *curved_J;    /* (n, 6): columns */
    double *squares, *A, *g, *step;    /* J^T J and J^T e of those that are free; copies */
    double *scratch;                   /* see scratch_size */
    double *distances;                 /* (n_starts,) */
    int *free;                         /* (n,): the coordinates that are free */
} Work;

typedef struct {
    double T[POSE], e[SPACE], half_square, residual;
} Look;

/* ------------------------------------------------------------ linear algebra */

/* Without a thought for NaN, as fmax and fmin have: those are calls. */
static double larger(double a, double b)
{
    return a > b ? a : b;
}

static double smaller(double a, double b)
{
    return a < b ? a : b;
}

/* A x = b in place of b, by L D L^T of a symmetric matrix (m, m), of which the lower half is read. */
static inline __attribute__((always_inline)) void solve_of_size(double *A, int m, double *b)
{
    for (int i = 0; i < m; i++) {
        double inverse = 1 / A[i * m + i];
        for (int j = i + 1; j < m; j++) {
            double factor = A[j * m + i] * inverse;
            for (int k = i + 1; k <= j; k++) {
                A[j * m + k] -= factor * A[k * m + i];
            }
            b[j] -= factor * b[i];
        }
        A[i * m + i] = inverse;
    }
    for (int i = m; i-- > 0;) {
        double sum = b[i];
        for (int j = i + 1; j < m; j++) {
            sum -= A[j * m + i] * b[j];
        }
        b[i] = sum * A[i * m + i];
    }
}

/* Of the sizes that arms have, each by a loop of its own that the compiler unrolls. */
static void solve_symmetric(double *A, int m, double *b)
{
    if (m == 6) {
        solve_of_size(A, 6, b);
    } else if (m == 7) {
        solve_of_size(A, 7, b);
    } else if (m == 5) {
        solve_of_size(A, 5, b);
    } else {
        solve_of_size(A, m, b);
    }
}

/* A X = B with columns of B in place, by elimination with pivots; 0 where A is singular. */
static int solve_square(double *A, int n, double *B, int columns)
{
    for (int i = 0; i < n; i++) {
        int pivot = i;
        for (int j = i + 1; j < n; j++) {
            if (fabs(A[j * n + i]) > fabs(A[pivot * n + i])) {
                pivot = j;
            }
        }
        if (!(fabs(A[pivot * n + i]) > 0)) {
            return 0;
        }
        for (int k = 0; k < n && pivot != i; k++) {
            double kept = A[i * n + k];
            A[i * n + k] = A[pivot * n + k];
            A[pivot * n + k] = kept;
        }
        for (int k = 0; k < columns && pivot != i; k++) {
            double kept = B[i * columns + k];
            B[i * columns + k] = B[pivot * columns + k];
            B[pivot * columns + k] = kept;
        }
        for (int j = i + 1; j < n; j++) {
            double factor = A[j * n + i] / A[i * n + i];
            for (int k = i + 1; k < n; k++) {
                A[j * n + k] -= factor * A[i * n + k];
            }
            for (int k = 0; k < columns; k++) {
                B[j * columns + k] -= factor * B[i * columns + k];
            }
        }
    }
    for (int i = n; i-- > 0;) {
        for (int k = 0; k < columns; k++) {
            double sum = B[i * columns + k];
            for (int j = i + 1; j < n; j++) {
                sum -= A[i * n + j] * B[j * columns + k];
            }
            B[i * columns + k] = sum / A[i * n + i];
        }
    }
    return 1;
}

static void cross(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* R^T x (or R x) of a pose by rows. */
static void turned(const double *T, int back, const double *x, double *out)
{
    for (int i = 0; i < 3; i++) {
        out[i] = back ? T[i] * x[0] + T[4 + i] * x[1] + T[8 + i] * x[2]
                      : T[4 * i] * x[0] + T[4 * i + 1] * x[1] + T[4 * i + 2] * x[2];
    }
}

/* ---------------------------------------------------------------- kinematics */

static void call_kernel(const chasles_kernel *kernel, const double *x, double *first,
                        double *second)
{
    const double *const inputs[] = {x};
    double *const outputs[] = {first, second};
    kernel->call(inputs, outputs);
}

/* The mixed Jacobian of a link's origin: each screw before it, brought to the base by the frame that
 * it is constant in, moves that point. */
static void look_at_link(const Arm *self, const double *q, double *T, double *J, double *scratch)
{
    double *poses = scratch, *rates = poses + POSE * self->n_links;
    int n = self->n;
    call_kernel(self->kernels[0], q, poses, NULL);
    memcpy(T, poses + POSE * self->link, POSE * sizeof(double));
    if (self->n_kernels > 1) {
        call_kernel(self->kernels[1], q, rates, NULL);
    }
    memset(J, 0, SPACE * n * sizeof(double));
    const double origin[] = {T[3], T[7], T[11]};
    for (int s = 0; s < self->n_screws; s++) {
        const Screw *screw = &self->screws[s];
        double v[3], w[3], arm[3], lever[3];
        memcpy(v, screw->axis, sizeof v);
        memcpy(w, screw->axis + 3, sizeof w);
        memcpy(arm, origin, sizeof arm);
        if (screw->frame >= 0) {
            const double *frame = poses + POSE * screw->frame;
            turned(frame, 0, screw->axis, v);
            turned(frame, 0, screw->axis + 3, w);
            for (int i = 0; i < 3; i++) {
                arm[i] -= frame[4 * i + 3];
            }
        }
        cross(w, arm, lever);
        for (int k = 0; k < n; k++) {
            double rate = self->n_kernels > 1 ? rates[screw->joint * n + k] : screw->joint == k;
            for (int i = 0; i < 3; i++) {
                J[i * n + k] += rate * (v[i] + lever[i]);
                J[(i + 3) * n + k] += rate * w[i];
            }
        }
    }
}

/* x: coordinates, and of a platform then the joints of its chain. */
static void look_at_platform(const Arm *self, const double *x, double *T, double *J,
                             double *scratch)
{
    int n = self->n;
    double *rates = scratch, *transposed = rates + n * n;
    const double *theta = x + n;
    call_kernel(self->kernels[0], theta, T, NULL);
    call_kernel(self->kernels[1], theta, J, NULL);
    call_kernel(self->kernels[3], theta, transposed, NULL);
    /* J_q = J_theta B^-1: B^T J_q^T = J_theta^T. */
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            rates[i * n + j] = transposed[j * n + i];
        }
    }
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < SPACE; i++) {
            transposed[k * SPACE + i] = J[i * n + k];
        }
    }
    int solved = solve_square(rates, n, transposed, SPACE);
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < SPACE; i++) {
            J[i * n + k] = solved ? transposed[k * SPACE + i] : NAN;
        }
    }
}

/* Brings the chain's joints of a platform to where its actuators have their values: Newton's
 * iteration; 0 where it does not get there. */
static int follow_actuators(const Arm *self, double *x, double *scratch)
{
    int n = self->n;
    double *rates = scratch, *here = rates + n * n, before = INFINITY;
    double *theta = x + n;
    for (int k = 0; k < CORRECTIONS; k++) {
        double most = 0;
        call_kernel(self->kernels[2], theta, here, NULL);
        for (int i = 0; i < n; i++) {
            here[i] = x[i] - here[i];
            most = larger(most, fabs(here[i]));
            if (isnan(here[i])) {
                return 0;
            }
        }
        if (most <= CLOSED || (most < 1e-12 && most >= before)) {
            return 1;
        }
        if (most > 2 * before) {
            return 0;
        }
        before = most;
        call_kernel(self->kernels[3], theta, rates, NULL);
        if (!solve_square(rates, n, here, 1)) {
            return 0;
        }
        for (int i = 0; i < n; i++) {
            theta[i] += here[i];
        }
    }
    return 0;
}

static int scratch_size(const Arm *self)
{
    int n = self->n;
    int of_link = POSE * self->n_links + self->n_joints * n, of_platform = 2 * n * n + n;
    return of_link + of_platform + SPACE * n * n + 2 * SPACE * n;
}

/* The twist from one pose to another in base axes: by the logarithm of T^-1 T_d, or where the task
 * leaves some of it open, the way of the origin and the turn apart. */
static void twist_between(const double *T, const double *T_d, int whole, double *e)
{
    double p[3], *w = e + 3;
    for (int i = 0; i < 3; i++) {
        p[i] = T_d[4 * i + 3] - T[4 * i + 3];
    }
    Turn turn = turn_between(T, T_d, w);
    memcpy(e, p, sizeof p);
    if (whole) {
        /* v = V^-1 p = p - w x p / 2 + k w x (w x p). */
        double wp[3], wwp[3];
        /* Of half the angle; the other quotient is 0 by 0 at a half turn. */
        double cotangent = turn.cosine < 0 ? turn.sine / (1 - turn.cosine)
                                           : (1 + turn.cosine) / turn.sine;
        double angle = turn.angle;
        double k = angle > 1e-4 ? (1 - angle * cotangent / 2) / (angle * angle) : 1.0 / 12;
        cross(w, p, wp);
        cross(w, wp, wwp);
        for (int i = 0; i < 3; i++) {
            e[i] = p[i] - wp[i] / 2 + k * wwp[i];
        }
    }
}

/* What twists (n, 6), in the axes of the task, take off an error of which some parts may stay: of
 * the way p what the tip's turn makes of it, where it is seen from the tip; of the turn w the
 * derivative of its logarithm. */
static void see_from_afar(const Task *task, const double *p, const double *w, double *columns,
                          int n)
{
    double angle = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    double k = angle > 1e-4 ? (1 - angle / (2 * tan(angle / 2))) / (angle * angle) : 1.0 / 12;
    double half = task->in_tool_axes ? -0.5 : 0.5;
    for (double *column = columns; column < columns + SPACE * n; column += SPACE) {
        double *turn = column + 3, by_p[3], by_w[3], twice[3];
        cross(turn, p, by_p);
        cross(w, turn, by_w);
        cross(w, by_w, twice);
        for (int i = 0; i < 3; i++) {
            column[i] += task->in_tool_axes ? by_p[i] : 0;
            turn[i] += half * by_w[i] + k * twice[i];
        }
    }
}

/* Twists (n, 6) in the axes of the task. */
static void see(const Task *task, const double *T, double *columns, int n)
{
    for (int i = 0; i < SPACE * n && task->in_tool_axes; i += 3) {
        double seen[3];
        turned(T, 1, columns + i, seen);
        memcpy(columns + i, seen, sizeof seen);
    }
}

/* Twists (n, 6), weighed. */
static void weigh(const Task *task, double *columns, int n)
{
    for (int i = 0; i < SPACE; i++) {
        for (int k = 0; k < n && task->weights[i] != 1; k++) {
            columns[k * SPACE + i] *= task->weights[i];
        }
    }
}

/* Pose, error, and Jacobian at x, column by column; all weighed as the task does. */
static void look(const Arm *self, const Task *task, const double *T_d, const double *x,
                 double *columns, double *scratch, Look *out)
{
    int n = self->n;
    double *J = scratch;
    if (self->kind == OF_TOOL) {
        call_kernel(self->kernels[0], x, out->T, J);
    } else if (self->kind == OF_LINK) {
        look_at_link(self, x, out->T, J, scratch + SPACE * n);
    } else {
        look_at_platform(self, x, out->T, J, scratch + SPACE * n);
    }
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < SPACE; i++) {
            columns[k * SPACE + i] = J[i * n + k];
        }
    }
    double *e = out->e, distance = 0, angle = 0, p[3];
    for (int i = 0; i < 3; i++) {
        p[i] = T_d[4 * i + 3] - out->T[4 * i + 3];
    }
    twist_between(out->T, T_d, task->whole, e);
    if (task->in_tool_axes) {
        double seen[SPACE];
        turned(out->T, 1, e, seen);
        turned(out->T, 1, e + 3, seen + 3);
        memcpy(e, seen, sizeof seen);
        turned(out->T, 1, p, seen);
        memcpy(p, seen, sizeof p);
    }
    see(task, out->T, columns, n);
    if (!task->whole) {
        see_from_afar(task, p, e + 3, columns, n);
    }
    weigh(task, columns, n);
    double sum = 0;
    for (int i = 0; i < SPACE; i++) {
        double w = task->weights[i];
        if (w > 0) {
            distance += i < 3 ? p[i] * p[i] : 0;
            angle += i < 3 ? 0 : e[i] * e[i];
        }
        e[i] *= w;
        sum += e[i] * e[i];
    }
    out->half_square = sum / 2;
    /* A sum is NaN where one of them is. */
    out->residual = (distance + angle) * 0 + sqrt(distance > angle ? distance : angle);
}

/* ---------------------------------------------------------------- an attempt */

static double dot(const double *a, const double *b)
{
    return (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]) + (a[4] * b[4] + a[5] * b[5]);
}

/* Finds the coordinates that are free to move; how many. */
static int find_free(const Arm *self, const Work *work, const double *e)
{
    int m = 0;
    for (int k = 0; k < self->n; k++) {
        double way = dot(work->J + k * SPACE, e);
        int held = (way < 0 && work->q[k] <= self->lower[k]) ||
                   (way > 0 && work->q[k] >= self->upper[k]);
        if (!held) {
            work->free[m++] = k;
        }
    }
    return m;
}

/* J^T J and J^T e of the free coordinates. */
static void normal_equations(const Work *work, const double *columns, const double *e, int m)
{
    for (int a = 0; a < m; a++) {
        const double *column = columns + work->free[a] * SPACE;
        work->g[a] = dot(column, e);
        for (int b = 0; b <= a; b++) {
            work->squares[a * m + b] = dot(column, columns + work->free[b] * SPACE);
        }
    }
}

/* The damped step of the free coordinates, taken from q and cut off at the limits; how far the
 * farthest goes. */
static double move(const Arm *self, const Work *work, int m, double lambda, double *to)
{
    double longest = 0, moved = 0;
    memcpy(work->A, work->squares, m * m * sizeof(double));
    memcpy(work->step, work->g, m * sizeof(double));
    for (int a = 0; a < m; a++) {
        work->A[a * m + a] += lambda;
    }
    solve_symmetric(work->A, m, work->step);
    for (int a = 0; a < m; a++) {
        longest = larger(longest, fabs(work->step[a]));
    }
    double part = longest > LONGEST_STEP ? LONGEST_STEP / longest : 1;
    memcpy(to, work->q, self->n_all * sizeof(double));
    for (int a = 0; a < m; a++) {
        int k = work->free[a];
        double there = work->q[k] + part * work->step[a];
        to[k] = smaller(larger(there, self->lower[k]), self->upper[k]);
        moved = larger(moved, fabs(to[k] - work->q[k]));
    }
    return moved;
}

/* Halley's step: from q by J + H dq / 2, dq being the step to work->trial. */
static void move_curved(const Arm *self, const Task *task, const Work *work, const Look *now,
                        int m, double lambda)
{
    int n = self->n;
    double *H = work->scratch, *columns = H + SPACE * n * n;
    call_kernel(self->kernels[1], work->q, H, NULL);
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < SPACE; i++) {
            const double *row = H + (i * n + k) * n;
            double sum = 0;
            for (int j = 0; j < n; j++) {
                sum += row[j] * (work->trial[j] - work->q[j]);
            }
            columns[k * SPACE + i] = sum / 2;
        }
    }
    see(task, now->T, columns, n);
    weigh(task, columns, n);
    for (int i = 0; i < SPACE * n; i++) {
        columns[i] += work->J[i];
    }
    normal_equations(work, columns, now->e, m);
    move(self, work, m, lambda, work->curved);
}

static void swap(double **a, double **b)
{
    double *kept = *a;
    *a = *b;
    *b = kept;
}

/* Pose and error at x, of a platform once its chain has followed; 0 where there is none. */
static int look_there(const Arm *self, const Task *task, const double *T_d, const Work *work,
                      double *x, double *columns, int *budget, Look *out)
{
    *budget -= 1;
    if (self->kind == OF_PLATFORM && !follow_actuators(self, x, work->scratch)) {
        return 0;
    }
    look(self, task, T_d, x, columns, work->scratch, out);
    return isfinite(out->residual);
}

/* A step from work->q into work->trial; 0 where none leads anywhere. *better: whether the error is
 * less there, which then is in *now. */
static int step_from(const Arm *self, const Task *task, const double *T_d, Work *work, Look *now,
                     int m, double lambda, int *budget, int *better)
{
    Look there, curved;
    if (lambda > MOST_LAMBDA || move(self, work, m, lambda, work->trial) <= SMALLEST_STEP) {
        return 0;
    }
    double least = now->half_square;
    *better = look_there(self, task, T_d, work, work->trial, work->trial_J, budget, &there) &&
              there.half_square < least;
    least = *better ? there.half_square : least;
    /* Where branches meet, an error that is small already hardly falls along the tangent. */
    if (self->kind == OF_TOOL && *budget > 0 && now->residual < CURVED &&
        least > CURVED_GAIN * now->half_square) {
        move_curved(self, task, work, now, m, lambda);
        if (look_there(self, task, T_d, work, work->curved, work->curved_J, budget, &curved) &&
            curved.half_square < least) {
            swap(&work->trial, &work->curved);
            swap(&work->trial_J, &work->curved_J);
            there = curved;
            *better = 1;
        }
        normal_equations(work, work->J, now->e, m);
    }
    if (*better) {
        *now = there;
    }
    return 1;
}

/* From work->q to where the error is least nearby, as long as that gains enough; how it ended. */
static int attempt(const Arm *self, const Task *task, const double *T_d, double least_gain,
                   Work *work, Look *now, int *budget)
{
    double mu = FIRST_MU;
    int idle = 0;
    if (!look_there(self, task, T_d, work, work->q, work->J, budget, now)) {
        now->half_square = INFINITY;
        return STALLED;
    }
    while (!(now->residual <= task->tolerance)) {
        int m = find_free(self, work, now->e), better = 0;
        int end = m < self->n ? LIMITS : STALLED;
        double before = now->half_square;
        normal_equations(work, work->J, now->e, m);
        while (!better) {
            double lambda = mu * before + LEAST_LAMBDA;
            if (*budget <= 0) {
                return BUDGET;
            }
            if (!step_from(self, task, T_d, work, now, m, lambda, budget, &better)) {
                return end;
            }
            mu *= better ? MU_FALLS : MU_RISES;
        }
        swap(&work->q, &work->trial);
        swap(&work->J, &work->trial_J);
        double gain = now->residual < NEAR ? PATIENT_GAIN : least_gain;
        idle = now->half_square > (1 - gain) * before ? idle + 1 : 0;
        if (idle >= IDLE) {
            return end;
        }
    }
    return CONVERGED;
}

/* ------------------------------------------------------------------ one pose */

typedef struct {
    double *q, *residual; /* (n,), one */
    unsigned char *success;
    signed char *ending;
    int *iterations, *restarts;
} Found;

/* Squares of the distances of the table's poses from the one wanted, the task's weights at work. */
static void measure_starts(const Arm *self, const Task *task, const double *T_d,
                           double *distances)
{
    int count = self->n_starts;
    double place = 0, turn = 0;
    for (int i = 0; i < 3; i++) {
        place = larger(place, task->weights[i]);
        turn = larger(turn, task->weights[i + 3]);
    }
    memset(distances, 0, count * sizeof(double));
    for (int i = 0; i < 12; i++) {
        const double *entry = self->start_poses + (size_t)i * count, wanted = T_d[i];
        double weight = i % 4 == 3 ? place * place : turn * turn / 2;
        for (int s = 0; s < count; s++) {
            double off = entry[s] - wanted;
            distances[s] += weight * off * off;
        }
    }
}

static int nearest_start(const double *distances, int count)
{
    int nearest = 0;
    for (int s = 1; s < count; s++) {
        nearest = distances[s] < distances[nearest] ? s : nearest;
    }
    return nearest;
}

/* Whether it is a place and a rotation, to single precision. */
static int is_pose(const double *T)
{
    double off = (T[3] + T[7] + T[11]) * 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            const double *a = T + 4 * i, *b = T + 4 * j;
            off += fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] - (i == j));
        }
    }
    double across[3];
    cross(T, T + 4, across);
    return off <= RIGID && across[0] * T[8] + across[1] * T[9] + across[2] * T[10] > 0;
}

/* The first start is the seed, where there is one, then come those of the table; 0 where none is
 * left. */
static int next_start(const Arm *self, const Task *task, const double *T_d, const double *seed,
                      int tried, Work *work)
{
    size_t row = self->n_all * sizeof(double);
    if (seed && tried == 0) {
        memcpy(work->q, seed, row);
        return 1;
    }
    if (tried == (seed != NULL)) {
        measure_starts(self, task, T_d, work->distances);
    }
    int next = nearest_start(work->distances, self->n_starts);
    if (self->n_starts == 0 || !(work->distances[next] < INFINITY)) {
        return 0;
    }
    work->distances[next] = INFINITY;
    memcpy(work->q, self->starts + (size_t)next * self->n_all, row);
    return 1;
}

/* Puts work->q among the best ends so far, in order; how many there are. */
static int keep_end(const Arm *self, Work *work, double half_square, double *errors, int count)
{
    size_t row = self->n_all * sizeof(double);
    int place = count < FINALISTS ? count : FINALISTS - 1;
    if (!(half_square < INFINITY) || (count == FINALISTS && !(half_square < errors[place]))) {
        return count;
    }
    for (; place > 0 && half_square < errors[place - 1]; place--) {
        errors[place] = errors[place - 1];
        memcpy(work->best + place * self->n_all, work->best + (place - 1) * self->n_all, row);
    }
    errors[place] = half_square;
    memcpy(work->best + place * self->n_all, work->q, row);
    return count < FINALISTS ? count + 1 : count;
}

/* From x to the least of distance and angle nearby, which the logarithm of the whole mixes. */
static int patient_attempt(const Arm *self, const Task *task, const double *T_d, const double *x,
                           Work *work, Look *now, int *budget)
{
    Task apart = *task;
    apart.whole = 0;
    memcpy(work->q, x, self->n_all * sizeof(double));
    return attempt(self, &apart, T_d, PATIENT_GAIN, work, now, budget);
}

static void solve(const Arm *self, const Task *task, const double *T_d, const double *seed,
                  Work *work, const Found *found)
{
    int kept = task->budget / PATIENCE < MOST_PATIENCE ? task->budget / PATIENCE : MOST_PATIENCE;
    int budget = task->budget - kept, tried = 0, ends = 0;
    int ending = is_pose(T_d) ? STALLED : NO_POSE;
    size_t row = self->n_all * sizeof(double);
    double errors[FINALISTS], *best_q = work->best + FINALISTS * self->n_all;
    Look now, best = {.half_square = INFINITY, .residual = NAN};
    for (int k = 0; k < self->n_all; k++) {
        best_q[k] = NAN;
    }
    for (; ending != CONVERGED && ending != NO_POSE && budget > 0; tried++) {
        if (!next_start(self, task, T_d, seed, tried, work)) {
            break;
        }
        ending = attempt(self, task, T_d, HASTY_GAIN, work, &now, &budget);
        ends = keep_end(self, work, now.half_square, errors, ends);
        if (ending == CONVERGED || now.half_square < best.half_square) {
            best = now;
            memcpy(best_q, work->q, row);
        }
    }
    budget += kept;
    int last = ending;
    for (int k = 0; k < ends && last != CONVERGED && budget > 0; k++) {
        const double *end = work->best + k * self->n_all;
        int most = k == 0 || budget < MOST_PATIENCE ? budget : MOST_PATIENCE, left = most;
        last = patient_attempt(self, task, T_d, end, work, &now, &left);
        budget -= most - left;
        if (k == 0 || last == CONVERGED || now.half_square < best.half_square) {
            best = now;
            ending = last;
            memcpy(best_q, work->q, row);
        }
    }
    if (ending == BUDGET && budget > 0) {
        ending = patient_attempt(self, task, T_d, best_q, work, &best, &budget);
        memcpy(best_q, work->q, row);
    }
    memcpy(found->q, best_q, self->n * sizeof(double));
    *found->residual = best.residual;
    *found->success = best.residual <= task->tolerance;
    *found->ending = ending;
    *found->iterations = task->budget - budget;
    *found->restarts = tried > 1 ? tried - 1 : 0;
}

/* ---------------------------------------------------------------- many poses */

typedef struct {
    const Arm *arm;
    const Task *task;
    const double *poses, *seeds; /* (count, 16); (count, n_all) or NULL */
    Found found;                 /* of the first pose */
    size_t count;
    atomic_size_t next;
    atomic_int short_of_memory;
} Batch;

static Work work_of(const Arm *self, double *memory, int *free_joints)
{
    int n = self->n, n_all = self->n_all;
    Work work = {.free = free_joints};
    double **const parts[] = {&work.q,       &work.trial,    &work.curved,  &work.best, &work.J,
                              &work.trial_J, &work.curved_J, &work.squares, &work.A,    &work.g,
                              &work.step,    &work.scratch,  &work.distances};
    const int sizes[] = {n_all,     n_all,     n_all, (FINALISTS + 1) * n_all, SPACE * n,
                         SPACE * n, SPACE * n, n * n, n * n,                   n,
                         n,         scratch_size(self),     self->n_starts};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        *parts[i] = memory;
        memory += sizes[i];
    }
    return work;
}

static size_t work_size(const Arm *self)
{
    size_t n = self->n;
    return (FINALISTS + 4) * self->n_all + 3 * SPACE * n + 2 * n * n + 2 * n + scratch_size(self) +
           self->n_starts;
}

/* Pieces of the batch, as long as there are some. What a pose gives depends on nothing but itself. */
static void *solve_pieces(void *argument)
{
    Batch *batch = argument;
    const Arm *self = batch->arm;
    double *memory = malloc(work_size(self) * sizeof(double));
    int *free_joints = malloc(self->n * sizeof(int));
    if (!memory || !free_joints) {
        atomic_store(&batch->short_of_memory, 1);
    } else {
        Work work = work_of(self, memory, free_joints);
        size_t count = batch->count, first;
        while ((first = atomic_fetch_add(&batch->next, PIECE)) < count) {
            for (size_t k = first; k < count && k < first + PIECE; k++) {
                const Found *all = &batch->found;
                const Found found = {all->q + k * self->n, all->residual + k,   all->success + k,
                                     all->ending + k,      all->iterations + k, all->restarts + k};
                const double *seed = batch->seeds ? batch->seeds + k * self->n_all : NULL;
                solve(self, batch->task, batch->poses + k * POSE, seed, &work, &found);
            }
        }
    }
    free(memory);
    free(free_joints);
    return NULL;
}

/* With so many threads, or as many as the system starts. */
static void solve_all(Batch *batch, int threads)
{
    pthread_t others[MOST_THREADS];
    int started = 0;
    while (started < threads - 1 &&
           pthread_create(&others[started], NULL, solve_pieces, batch) == 0) {
        started++;
    }
    solve_pieces(batch);
    for (int k = 0; k < started; k++) {
        pthread_join(others[k], NULL);
    }
}

#endif
