/* chasles._rates: joint rates of a twist, one tick of a controller after another or a batch.
 *
 * Three NumPy generalized ufuncs, which broadcast leading dimensions:
 *   bounds    the rates that joint, rate and acceleration limits leave
 *   solve     joint rates of a twist within them, by damped least squares
 *   gradient  a measure of manipulability and its gradient
 * All that is solved is in pure numbers: rows of the Jacobian times `row` (1 / length for linear
 * ones, 1 for angular, 0 for those that do not count), columns times `unit` (length of a slider,
 * 1 of a turning joint).
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <fenv.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <numpy/arrayobject.h>
#include <numpy/ufuncobject.h>

#include "velocity/_damped.h"
#include "numerics/_orthogonal.h"

#define TWIST 6
#define ORTHOGONAL 1e-15 /* cosine at which two rows are */
#define NOUGHT 1e-13     /* singular value, by the largest, below which its vector is rounding */
#define NULL_MOTION 1e-12 /* size of a secondary motion, by that asked for, that is none */

/* ------------------------------------------------------------------ decomposition */

/* J = sum of sigma[i] u[i] v[i]^T, the largest first; u (6, 6), v (6, n), `count` of them. */
typedef struct {
    int n, count;
    double sigma[TWIST];
    double u[TWIST][TWIST];
    double *v;
    double *work; /* (6, larger of 6 and n) */
} Svd;

/* By the cosine between them, rounding of the whole aside. */
static int rows_are_orthogonal(double aa, double bb, double ab, double total)
{
    return !(fabs(ab) > ORTHOGONAL * (sqrt(aa * bb) + ORTHOGONAL * total));
}

/* A unit vector orthogonal to `count` others (stride m), zero where `out` is and none is left. */
static void complete(double *x, const double *others, int count, int m, const char *out)
{
    double best = -1;
    int at = -1;
    for (int k = 0; k < m; k++) {
        double left = out && out[k] ? -1 : 1;
        for (int i = 0; i < count; i++) {
            left -= others[i * m + k] * others[i * m + k];
        }
        if (left > best) {
            best = left, at = k;
        }
    }
    memset(x, 0, m * sizeof *x);
    if (at < 0 || best < 1e-6) {
        return;
    }
    x[at] = 1;
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < count; i++) {
            double along = rows_dot(x, others + i * m, m);
            for (int k = 0; k < m; k++) {
                x[k] -= along * others[i * m + k];
            }
        }
    }
    double size = sqrt(rows_dot(x, x, m));
    for (int k = 0; k < m; k++) {
        x[k] /= size;
    }
}

/* Of J (6, n) without the columns that are out. */
static void decompose(Svd *svd, const double *J, const char *out)
{
    int n = svd->n, wide = n >= TWIST, p = wide ? TWIST : n, m = wide ? n : TWIST;
    double *W = svd->work, Y[TWIST][TWIST] = {{0}}, size[TWIST];
    int order[TWIST];
    for (int a = 0; a < TWIST; a++) {
        for (int k = 0; k < n; k++) {
            W[wide ? a * m + k : k * m + a] = out[k] ? 0 : J[a * n + k];
        }
    }
    for (int i = 0; i < p; i++) {
        Y[i][i] = 1;
    }
    rows_orthogonalize(W, p, m, Y[0], TWIST, rows_are_orthogonal, rows_dot(W, W, p * m));
    for (int i = 0; i < p; i++) {
        size[i] = sqrt(rows_dot(W + i * m, W + i * m, m));
        int j = i;
        for (; j > 0 && size[order[j - 1]] < size[i]; j--) {
            order[j] = order[j - 1];
        }
        order[j] = i;
    }
    /* Rows of W are sigma times a unit vector on the longer side, rows of Y those on the other. */
    double sorted[TWIST * TWIST];
    double *longer = wide ? svd->v : sorted;
    svd->count = p;
    for (int i = 0; i < p; i++) {
        const double *from = W + order[i] * m;
        double sigma = size[order[i]], *to = longer + i * m;
        svd->sigma[i] = sigma;
        if (sigma <= NOUGHT * svd->sigma[0]) {
            complete(to, longer, i, m, wide ? out : NULL);
            continue;
        }
        for (int k = 0; k < m; k++) {
            to[k] = from[k] / sigma;
        }
    }
    for (int i = 0; i < p; i++) {
        for (int a = 0; a < TWIST; a++) {
            svd->u[i][a] = wide ? Y[order[i]][a] : sorted[i * TWIST + a];
        }
        for (int k = 0; k < n && !wide; k++) {
            svd->v[i * n + k] = Y[order[i]][k];
        }
    }
}

/* lambda^2 of a singular value. */
static double damping_of(double sigma, double border)
{
    return sigma < border ? (border - sigma) * (border + sigma) : 0;
}

/* y = J# V; where sigma < border that is sigma / border^2, elsewhere 1 / sigma. */
static void apply_inverse(const Svd *svd, int rank, double border, const double *V, double *y)
{
    memset(y, 0, svd->n * sizeof *y);
    for (int i = 0; i < rank && i < svd->count; i++) {
        double sigma = svd->sigma[i];
        double along = rows_dot(svd->u[i], V, TWIST);
        double factor = sigma < border ? sigma / (border * border) : 1 / sigma;
        for (int k = 0; k < svd->n; k++) {
            y[k] += factor * along * svd->v[i * svd->n + k];
        }
    }
}

/* ------------------------------------------------------------------ within bounds */

typedef struct {
    int n, rank;
    double border;
    Svd svd;
    char *out, *best_out, *limited;
    double *J, *lo, *hi, *z, *unit; /* J (6, n) and the others (n), in pure numbers */
    double *y, *a, *b, *best_a, *best_b, *held, *exact_lo, *exact_hi;
    double V[TWIST], row[TWIST];
    double *memory;
} Work;

static int work_new(Work *w, int n)
{
    int longer = n < TWIST ? TWIST : n;
    size_t doubles = (size_t)TWIST * (2 * n + longer) + 13 * (size_t)n;
    w->n = w->svd.n = n;
    w->memory = calloc(doubles * sizeof(double) + 3 * (size_t)n + 1, 1);
    if (!w->memory) {
        return -1;
    }
    double *next = w->memory;
    w->J = next, next += TWIST * n;
    w->svd.v = next, next += TWIST * n;
    w->svd.work = next, next += TWIST * longer;
    double **vectors[] = {&w->lo,     &w->hi,     &w->z,    &w->unit,     &w->y,       &w->a, &w->b,
                          &w->best_a, &w->best_b, &w->held, &w->exact_lo, &w->exact_hi};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++, next += n) {
        *vectors[i] = next;
    }
    w->out = (char *)next, w->best_out = w->out + n, w->limited = w->best_out + n;
    return 0;
}

/* The largest s in [0, 1] for which every s a + b is within bounds, -1 if none; and the joint that
 * is in the way of a larger one. */
static double scale_of(const Work *w, int *critical)
{
    double least = 0, most = 1;
    *critical = -1;
    for (int k = 0; k < w->n; k++) {
        if (w->out[k]) {
            continue;
        }
        double a = w->a[k], from = w->lo[k] - w->b[k], to = w->hi[k] - w->b[k];
        if (a < 0) {
            double swap = from;
            a = -a, from = -to, to = -swap;
        }
        /* No division where the quotient lies outside of [0, 1]. */
        double above = to >= a ? 1 : to < 0 ? -1 : to / a;
        double below = from <= 0 ? 0 : from > a ? 2 : from / a;
        if (above < most) {
            most = above, *critical = k;
        }
        if (below > least) {
            least = below;
            if (below > 1 && *critical < 0) {
                *critical = k;
            }
        }
    }
    return most >= least && most >= 0 ? most : -1;
}

/* The s in [0, 1] for which s a is nearest to the bounds, by least squares: the slope of the squared
 * distance grows with s. */
static double nearest_scale(const double *a, const double *lo, const double *hi, int n)
{
    double from = 0, to = 1;
    for (int i = 0; i < 40; i++) {
        double s = (from + to) / 2, slope = 0;
        for (int k = 0; k < n; k++) {
            double y = s * a[k];
            slope += a[k] * (y - fmin(fmax(y, lo[k]), hi[k]));
        }
        if (slope > 0) {
            to = s;
        } else {
            from = s;
        }
    }
    return from;
}

static int violated(const Work *w)
{
    for (int k = 0; k < w->n; k++) {
        if (w->y[k] < w->lo[k] || w->y[k] > w->hi[k]) {
            return 1;
        }
    }
    return 0;
}

typedef struct {
    double scale;
    int critical; /* the joint that keeps the scale from being larger, or -1 */
} Candidate;

/* y = a + b: the task by the joints that are not out, which make up for what those do at their
 * bounds; how far it may be scaled. */
static Candidate candidate(Work *w)
{
    int n = w->n;
    double left[TWIST];
    apply_inverse(&w->svd, w->rank, w->border, w->V, w->a);
    for (int i = 0; i < TWIST; i++) {
        left[i] = -rows_dot(w->J + i * n, w->held, n);
    }
    apply_inverse(&w->svd, w->rank, w->border, left, w->b);
    for (int k = 0; k < n; k++) {
        w->b[k] = w->out[k] ? w->held[k] : w->b[k];
        w->a[k] = w->out[k] ? 0 : w->a[k];
        w->y[k] = w->a[k] + w->b[k];
    }
    Candidate found = {1, -1};
    if (violated(w)) {
        found.scale = scale_of(w, &found.critical);
    }
    return found;
}

static void keep_better(Work *w, Candidate found, Candidate *best)
{
    if (found.scale > best->scale) {
        *best = found;
        memcpy(w->best_a, w->a, w->n * sizeof(double));
        memcpy(w->best_b, w->b, w->n * sizeof(double));
        memcpy(w->best_out, w->out, w->n);
    }
}

/* Without the joints that are out; whether the task can be done so without damping. */
static int can_do_without(Work *w)
{
    decompose(&w->svd, w->J, w->out);
    return w->rank <= w->svd.count && w->svd.sigma[w->rank - 1] >= w->border;
}

/* Holds joints one after the other, each the one that keeps the scale from being larger. */
static void hold_one_by_one(Work *w, Candidate *best)
{
    memset(w->out, 0, w->n);
    memset(w->held, 0, w->n * sizeof(double));
    for (;;) {
        Candidate found = candidate(w);
        keep_better(w, found, best);
        int k = found.critical;
        if (found.scale == 1 || k < 0) {
            return;
        }
        w->out[k] = 1;
        w->held[k] = w->y[k] > w->hi[k] ? w->hi[k] : w->y[k] < w->lo[k] ? w->lo[k] : w->y[k];
        if (!can_do_without(w)) {
            return;
        }
    }
}

/* Holds the joints at the bounds that the least squares within all bounds have them at: one that was
 * held too early, where another should have been, is never let go in the way above. */
static void hold_as_in_box(Work *w, Candidate *best)
{
    damped box;
    if (!damped_new(&box, w->n, w->border, w->border)) {
        return;
    }
    damped_decompose(&box, w->J);
    damped_solve(&box, w->V);
    damped_box(&box, w->lo, w->hi);
    for (int k = 0; k < w->n; k++) {
        w->out[k] = box.at[k] != 0;
        w->held[k] = box.at[k] ? box.x[k] : 0;
    }
    damped_free(&box);
    if (can_do_without(w)) {
        keep_better(w, candidate(w), best);
    }
}

/* y: the task as far as it goes, other joints taking over from those that are at their bounds as long
 * as they can; then scaled. Returns the scale. Flacco, De Luca and Khatib 2012, algorithm 1. */
static double task_within(Work *w)
{
    Candidate best = {-2, -1};
    memset(w->b, 0, w->n * sizeof(double));
    hold_one_by_one(w, &best);
    if (best.scale < 1) {
        hold_as_in_box(w, &best);
    }
    double scale = best.scale;
    if (scale < 0) {
        scale = nearest_scale(w->best_a, w->lo, w->hi, w->n);
    }
    memcpy(w->out, w->best_out, w->n);
    memcpy(w->limited, w->best_out, w->n);
    if (best.critical >= 0) {
        w->limited[best.critical] = 1;
    }
    for (int k = 0; k < w->n; k++) {
        double y = scale * w->best_a[k] + w->best_b[k];
        w->y[k] = fmin(fmax(y, w->lo[k]), w->hi[k]);
        w->limited[k] |= w->y[k] != y;
    }
    return scale;
}

/* Adds what of z the task does not see, around the bounds. */
static void add_null_motion(Work *w)
{
    int n = w->n, free = 0;
    for (int k = 0; k < n; k++) {
        free += !w->out[k];
    }
    double rest = 1, asked = sqrt(rows_dot(w->z, w->z, n));
    for (; free > w->rank && rest > 0 && asked > 0; free--) {
        double *d = w->a, step = 1;
        int critical = -1;
        decompose(&w->svd, w->J, w->out);
        for (int k = 0; k < n; k++) {
            d[k] = w->out[k] ? 0 : rest * w->z[k];
        }
        for (int pass = 0; pass < 2; pass++) {
            for (int i = 0; i < w->rank; i++) {
                double along = rows_dot(w->svd.v + i * n, d, n);
                for (int k = 0; k < n; k++) {
                    d[k] -= along * w->svd.v[i * n + k];
                }
            }
        }
        if (sqrt(rows_dot(d, d, n)) <= NULL_MOTION * asked) {
            return;
        }
        for (int k = 0; k < n; k++) {
            double room = d[k] > 0 ? w->hi[k] - w->y[k] : w->y[k] - w->lo[k], size = fabs(d[k]);
            if (!w->out[k] && size > NULL_MOTION * asked && room < step * size) {
                step = fmax(room, 0) / size, critical = k;
            }
        }
        for (int k = 0; k < n; k++) {
            w->y[k] += step * d[k];
        }
        if (critical < 0) {
            return;
        }
        w->out[critical] = w->limited[critical] = 1;
        rest *= 1 - step;
    }
}

/* ------------------------------------------------------------------ generalized ufuncs */

static double get(const char *at)
{
    double value;
    memcpy(&value, at, sizeof value);
    return value;
}

static void put(char *at, double value)
{
    memcpy(at, &value, sizeof value);
}

static int read_vector(double *to, const char *from, int n, npy_intp step)
{
    int finite = 1;
    for (int k = 0; k < n; k++) {
        to[k] = get(from + k * step);
        finite &= isfinite(to[k]) != 0;
    }
    return finite;
}

/* J (6, n) in pure numbers. */
static int read_jacobian(Work *w, const char *from, npy_intp step_row, npy_intp step_column)
{
    int finite = 1;
    for (int a = 0; a < TWIST; a++) {
        for (int k = 0; k < w->n; k++) {
            double value = get(from + a * step_row + k * step_column);
            finite &= isfinite(value) != 0;
            w->J[a * w->n + k] = w->row[a] * value * w->unit[k];
        }
    }
    return finite;
}

static void fill(char *to, int n, npy_intp step, double value)
{
    for (int k = 0; k < n; k++) {
        put(to + k * step, value);
    }
}

/* One row; false if a number given is not finite. */
static int solve_row(Work *w, char **args, const npy_intp *core, double *scale)
{
    int n = w->n;
    int finite = read_vector(w->unit, args[5], n, core[6]);
    finite &= read_vector(w->row, args[6], TWIST, core[7]);
    finite &= read_jacobian(w, args[0], core[0], core[1]);
    finite &= read_vector(w->V, args[1], TWIST, core[2]);
    finite &= read_vector(w->z, args[4], n, core[5]);
    read_vector(w->exact_lo, args[2], n, core[3]);
    read_vector(w->exact_hi, args[3], n, core[4]);
    for (int k = 0; k < n; k++) {
        finite &= !isnan(w->exact_lo[k]) & !isnan(w->exact_hi[k]);
    }
    if (!finite) {
        return 0;
    }
    for (int k = 0; k < n; k++) {
        w->lo[k] = w->exact_lo[k] / w->unit[k];
        w->hi[k] = w->exact_hi[k] / w->unit[k];
        w->z[k] /= w->unit[k];
    }
    for (int i = 0; i < TWIST; i++) {
        w->V[i] *= w->row[i];
    }
    w->border = get(args[7]);
    npy_intp rank;
    memcpy(&rank, args[8], sizeof rank);
    w->rank = (int)rank;
    memset(w->out, 0, n);
    decompose(&w->svd, w->J, w->out);
    double sigma = w->svd.sigma[w->rank - 1], sign = 0, largest = 0;
    for (int i = 0; i < TWIST; i++) { /* the largest component is positive */
        double value = w->svd.u[w->rank - 1][i];
        if (fabs(value) > largest + 1e-9) {
            largest = fabs(value), sign = value < 0 ? -1 : 1;
        }
    }
    for (int i = 0; i < TWIST; i++) {
        double value = w->row[i] > 0 ? sign * w->svd.u[w->rank - 1][i] / w->row[i] : 0;
        put(args[13] + i * core[10], value);
    }
    put(args[11], damping_of(sigma, w->border));
    put(args[12], sigma);
    *scale = task_within(w);
    add_null_motion(w);
    return 1;
}

/* J, V, lower, upper, z, unit, row, border, rank
 * -> rates, twist, damping, smallest, direction, scale, limited */
static void solve_loop(char **arguments, const npy_intp *dimensions, const npy_intp *steps,
                       void *Py_UNUSED(data))
{
    enum { OPERANDS = 16 };
    Work w;
    int n = (int)dimensions[2];
    const npy_intp *core = steps + OPERANDS;
    char *args[OPERANDS];
    memcpy(args, arguments, sizeof args);
    if (work_new(&w, n) < 0) {
        NPY_ALLOW_C_API_DEF NPY_ALLOW_C_API;
        PyErr_NoMemory();
        NPY_DISABLE_C_API;
        return;
    }
    for (npy_intp row = 0; row < dimensions[0]; row++) {
        double scale;
        if (solve_row(&w, args, core, &scale)) {
            put(args[14], scale);
            for (int k = 0; k < n; k++) {
                double rate = w.y[k] * w.unit[k];
                w.y[k] = fmin(fmax(rate, w.exact_lo[k]), w.exact_hi[k]);
                put(args[9] + k * core[8], w.y[k]);
                args[15][k * core[11]] = w.limited[k];
            }
            for (int i = 0; i < TWIST; i++) {
                double sum = 0;
                for (int k = 0; k < n; k++) {
                    sum += get(args[0] + i * core[0] + k * core[1]) * w.y[k];
                }
                put(args[10] + i * core[9], sum);
            }
        } else {
            fill(args[9], n, core[8], NAN);
            fill(args[10], TWIST, core[9], NAN);
            fill(args[13], TWIST, core[10], NAN);
            for (int i = 11; i <= 14; i++) {
                i == 13 ? (void)0 : put(args[i], NAN);
            }
            for (int k = 0; k < n; k++) {
                args[15][k * core[11]] = 0;
            }
        }
        for (int i = 0; i < OPERANDS; i++) {
            args[i] += steps[i];
        }
    }
    free(w.memory);
    feclearexcept(FE_ALL_EXCEPT);
}

/* The fastest rate towards a limit that is `left` away. Braking by as much as allowed in each tick
 * after this one must stop before it: k ticks at v, v - a dt, ... take k v dt - k (k - 1) / 2 a dt^2.
 */
static double approach(double left, double acceleration, double dt)
{
    if (!(left > 0)) {
        return 0;
    }
    if (isnan(dt) || isinf(left)) {
        return INFINITY;
    }
    double unit = acceleration * dt * dt;
    if (!(left > unit)) {
        return left / dt;
    }
    double ticks = fmax(ceil((sqrt(1 + 8 * left / unit) - 1) / 2), 1);
    return left / (ticks * dt) + acceleration * dt * (ticks - 1) / 2;
}

static double within(double value, double lower, double upper)
{
    return fmin(fmax(value, lower), upper);
}

/* Rounding does not carry a joint over its limit. */
static double stops_before(double q, double rate, double dt, double limit, double sign)
{
    for (int i = 0; i < 8 && rate > 0 && isfinite(rate); i++) {
        volatile double way = rate * dt, there = q + sign * way;
        if (sign * (limit - there) >= 0) {
            return rate;
        }
        rate = nextafter(rate, 0);
    }
    return isfinite(rate) ? fmax(rate, 0) : rate;
}

/* q, lower, upper, rate limit, acceleration limit, previous rate, dt -> least and greatest rate */
static void bounds_loop(char **arguments, const npy_intp *dimensions, const npy_intp *steps,
                        void *Py_UNUSED(data))
{
    enum { OPERANDS = 9 };
    const npy_intp *core = steps + OPERANDS;
    char *args[OPERANDS];
    memcpy(args, arguments, sizeof args);
    for (npy_intp row = 0; row < dimensions[0]; row++) {
        double dt = get(args[6]);
        for (npy_intp k = 0; k < dimensions[1]; k++) {
            double x[6];
            for (int i = 0; i < 6; i++) {
                x[i] = get(args[i] + k * core[i]);
            }
            double q = x[0], rate = x[3], acceleration = x[4], change = acceleration * dt;
            double down = -approach(q - x[1], acceleration, dt);
            double up = approach(x[2] - q, acceleration, dt);
            if (!isnan(dt)) {
                down = -stops_before(q, -down, dt, x[1], -1);
                up = stops_before(q, up, dt, x[2], 1);
            }
            double least = -rate, greatest = rate;
            if (isfinite(change)) {
                least = within(least, x[5] - change, x[5] + change);
                greatest = within(greatest, x[5] - change, x[5] + change);
            }
            /* The way that is left is known to a rounding: by that much it may brake harder. */
            double rounding = isnan(dt) ? 0 : 8 * DBL_EPSILON * (fabs(q) / dt + fabs(x[5]));
            if (down > greatest && down <= greatest + rounding) {
                greatest = down;
            }
            if (up < least && up >= least - rounding) {
                least = up;
            }
            int sound = !isnan(q) && !isnan(x[5]);
            put(args[7] + k * core[6], sound ? within(down, least, greatest) : NAN);
            put(args[8] + k * core[7], sound ? within(up, least, greatest) : NAN);
        }
        for (int i = 0; i < OPERANDS; i++) {
            args[i] += steps[i];
        }
    }
    feclearexcept(FE_ALL_EXCEPT);
}

/* J, H, unit, row, rank -> w, the product of the singular values, and its gradient by q.
 *
 * d sigma = u^T dJ v, so dw = sum of (product of the other sigma) u^T dJ v: no division by zero. */
static void gradient_loop(char **arguments, const npy_intp *dimensions, const npy_intp *steps,
                          void *Py_UNUSED(data))
{
    enum { OPERANDS = 7 };
    Work w;
    int n = (int)dimensions[2];
    const npy_intp *core = steps + OPERANDS;
    char *args[OPERANDS];
    memcpy(args, arguments, sizeof args);
    if (work_new(&w, n) < 0) {
        NPY_ALLOW_C_API_DEF NPY_ALLOW_C_API;
        PyErr_NoMemory();
        NPY_DISABLE_C_API;
        return;
    }
    for (npy_intp row = 0; row < dimensions[0]; row++) {
        npy_intp rank;
        memcpy(&rank, args[4], sizeof rank);
        read_vector(w.unit, args[2], n, core[5]);
        read_vector(w.row, args[3], TWIST, core[6]);
        if (!read_jacobian(&w, args[0], core[0], core[1])) {
            put(args[5], NAN);
            fill(args[6], n, core[7], NAN);
        } else {
            decompose(&w.svd, w.J, w.out);
            memset(w.J, 0, TWIST * n * sizeof(double));
            double measure = 1;
            for (int i = 0; i < rank; i++) {
                double others = 1;
                measure *= w.svd.sigma[i];
                for (int j = 0; j < rank; j++) {
                    others *= j == i ? 1 : w.svd.sigma[j];
                }
                for (int a = 0; a < TWIST; a++) {
                    for (int k = 0; k < n; k++) {
                        w.J[a * n + k] += others * w.row[a] * w.unit[k] * w.svd.u[i][a] *
                                          w.svd.v[i * n + k];
                    }
                }
            }
            put(args[5], measure);
            memset(w.y, 0, n * sizeof(double));
            for (int a = 0; a < TWIST; a++) {
                for (int j = 0; j < n; j++) {
                    const char *H = args[1] + a * core[2] + j * core[3];
                    for (int k = 0; k < n; k++) {
                        w.y[k] += w.J[a * n + j] * get(H + k * core[4]);
                    }
                }
            }
            for (int k = 0; k < n; k++) {
                put(args[6] + k * core[7], w.y[k]);
            }
        }
        for (int i = 0; i < OPERANDS; i++) {
            args[i] += steps[i];
        }
    }
    free(w.memory);
    feclearexcept(FE_ALL_EXCEPT);
}

/* ------------------------------------------------------------------ module */

#define D NPY_DOUBLE
static const char solve_types[] = {D, D, D, D, D, D, D, D, NPY_INTP, D, D, D, D, D, D, NPY_BOOL};
static const char bounds_types[] = {D, D, D, D, D, D, D, D, D};
static const char gradient_types[] = {D, D, D, D, NPY_INTP, D, D};

static PyUFuncGenericFunction solve_loops[] = {solve_loop};
static PyUFuncGenericFunction bounds_loops[] = {bounds_loop};
static PyUFuncGenericFunction gradient_loops[] = {gradient_loop};
static void *const no_data[] = {NULL};

static int add(PyObject *module, PyUFuncGenericFunction *loops, const char *types, int inputs,
               int outputs, const char *name, const char *doc, const char *signature)
{
    PyObject *ufunc = PyUFunc_FromFuncAndDataAndSignature(
        loops, no_data, types, 1, inputs, outputs, PyUFunc_None, name, doc, 0, signature);
    int failed = ufunc ? PyModule_AddObjectRef(module, name, ufunc) : -1;
    Py_XDECREF(ufunc);
    return failed;
}

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "chasles.velocity._rates",
    .m_doc = "Joint rates of a twist within limits, as generalized ufuncs.",
    .m_size = -1,
};

PyMODINIT_FUNC PyInit__rates(void)
{
    import_array();
    import_umath();
    PyObject *module = PyModule_Create(&definition);
    if (!module ||
        add(module, solve_loops, solve_types, 9, 7, "solve",
            "Joint rates of a twist within bounds, by damped least squares.",
            "(6,n),(6),(n),(n),(n),(n),(6),(),()->(n),(6),(),(),(6),(),(n)") < 0 ||
        add(module, bounds_loops, bounds_types, 7, 2, "bounds",
            "The rates that joint, rate and acceleration limits leave.",
            "(n),(n),(n),(n),(n),(n),()->(n),(n)") < 0 ||
        add(module, gradient_loops, gradient_types, 5, 2, "gradient",
            "The product of the singular values and its gradient.",
            "(6,n),(6,n,n),(n),(6),()->(),(n)") < 0) {
        Py_XDECREF(module);
        return NULL;
    }
    return module;
}
