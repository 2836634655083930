#include "velocity/native/bounded_rates.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "numerics/_tolerances.h"

#define BISECTIONS 40 /* number of bisections of the scale in [0, 1] */

int rate_problem_new(RateProblem *p, int n)
{
    int longer = n < TWIST ? TWIST : n;
    size_t doubles = (size_t)TWIST * (2 * n + longer) + 12 * (size_t)n;
    p->n = p->svd.n = n;
    p->memory = calloc(doubles * sizeof(double) + 4 * (size_t)n + 1, 1);
    if (!p->memory || !damped_box_new(&p->box, n)) {
        free(p->memory);
        return -1;
    }
    double *next = p->memory;
    p->J = next, next += TWIST * n;
    p->svd.v = next, next += TWIST * n;
    p->svd.work = next, next += TWIST * longer;
    double **vectors[] = {&p->lo,     &p->hi,         &p->z,        &p->unit,
                          &p->y,      &p->a,          &p->b,        &p->best_a,
                          &p->best_b, &p->fixed_rate, &p->exact_lo, &p->exact_hi};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++, next += n) {
        *vectors[i] = next;
    }
    p->fixed = (char *)next, p->best_fixed = p->fixed + n, p->limited = p->best_fixed + n;
    p->locked = p->limited + n;
    return 0;
}

void rate_problem_free(RateProblem *p)
{
    damped_box_free(&p->box);
    free(p->memory);
}

/* Writes y = J# V with the damped inverse J#. */
static void apply_damped_inverse(const RateProblem *p, const double *V, double *y)
{
    const Svd *svd = &p->svd;
    memset(y, 0, p->n * sizeof *y);
    for (int i = 0; i < p->rank && i < svd->count; i++) {
        double sigma = svd->sigma[i];
        double along = dot(svd->u[i], V, TWIST);
        double factor = sigma < p->border ? sigma / (p->border * p->border) : 1 / sigma;
        for (int k = 0; k < p->n; k++) {
            y[k] += factor * along * svd->v[i * p->n + k];
        }
    }
}

/* Returns the largest s in [0, 1] for which the rates s a + b respect all bounds. Returns -1 if no
 * such s exists. Writes the joint whose bound limits s, or -1, to *critical. */
static double largest_scale(const RateProblem *p, int *critical)
{
    double least = 0, most = 1;
    *critical = -1;
    for (int k = 0; k < p->n; k++) {
        if (p->fixed[k]) {
            continue;
        }
        double a = p->a[k], from = p->lo[k] - p->b[k], to = p->hi[k] - p->b[k];
        if (a < 0) {
            double swap = from;
            a = -a, from = -to, to = -swap;
        }
        /* The division is executed only if the quotient is in [0, 1], because a may be 0. */
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

/* Finds by bisection the factor s in [0, 1] for which s*a is nearest to the box between the bounds.
 */
static double nearest_scale(const RateProblem *p, const double *a)
{
    double from = 0, to = 1;
    for (int i = 0; i < BISECTIONS; i++) {
        double s = (from + to) / 2, slope = 0;
        for (int k = 0; k < p->n; k++) {
            double y = s * a[k];
            slope += a[k] * (y - clamp(y, p->lo[k], p->hi[k]));
        }
        if (slope > 0) {
            to = s;
        } else {
            from = s;
        }
    }
    return from;
}

static int violates_bounds(const RateProblem *p)
{
    for (int k = 0; k < p->n; k++) {
        if (p->y[k] < p->lo[k] || p->y[k] > p->hi[k]) {
            return 1;
        }
    }
    return 0;
}

typedef struct {
    double scale; /* the largest s in [0, 1] for which the twist s V respects all bounds, or -1 */
    int critical; /* the joint that limits the scale, or -1 */
} Candidate;

/* Computes y = a + b. Vector a has the rates of the free joints that perform the task. */
static Candidate compute_candidate(RateProblem *p)
{
    int n = p->n;
    double compensation[TWIST];
    apply_damped_inverse(p, p->V, p->a);
    for (int i = 0; i < TWIST; i++) {
        compensation[i] = -dot(p->J + i * n, p->fixed_rate, n);
    }
    apply_damped_inverse(p, compensation, p->b);
    for (int k = 0; k < n; k++) {
        p->b[k] = p->fixed[k] ? p->fixed_rate[k] : p->b[k];
        p->a[k] = p->fixed[k] ? 0 : p->a[k];
        p->y[k] = p->a[k] + p->b[k];
    }
    Candidate found = {1, -1};
    if (violates_bounds(p)) {
        found.scale = largest_scale(p, &found.critical);
    }
    return found;
}

static void keep_better(RateProblem *p, Candidate found, Candidate *best)
{
    if (found.scale > best->scale) {
        *best = found;
        memcpy(p->best_a, p->a, p->n * sizeof(double));
        memcpy(p->best_b, p->b, p->n * sizeof(double));
        memcpy(p->best_fixed, p->fixed, p->n);
    }
}

/* Decomposes those columns of the Jacobian J that belong to free joints. Returns 1 if the free
 * joints need no damping. */
static int decompose_free(RateProblem *p)
{
    svd_decompose(&p->svd, p->J, p->fixed);
    return p->rank <= p->svd.count && p->svd.sigma[p->rank - 1] >= p->border;
}

static void hold_one_by_one(RateProblem *p, Candidate *best)
{
    memcpy(p->fixed, p->locked, p->n);
    memset(p->fixed_rate, 0, p->n * sizeof(double));
    for (;;) {
        Candidate found = compute_candidate(p);
        keep_better(p, found, best);
        int k = found.critical;
        if (found.scale == 1 || k < 0) {
            return;
        }
        p->fixed[k] = 1;
        p->fixed_rate[k] = p->y[k] > p->hi[k] ? p->hi[k] : p->y[k] < p->lo[k] ? p->lo[k] : p->y[k];
        if (!decompose_free(p)) {
            return;
        }
    }
}

/* Fixes the joints that are at their bounds in the bounded least-squares solution. */
static void hold_as_in_box(RateProblem *p, Candidate *best)
{
    DampedBox *box = &p->box;
    damped_box_start(box, p->border, p->border);
    damped_box_decompose(box, p->J);
    damped_box_solve(box, p->V);
    damped_box_bound(box, p->lo, p->hi);
    for (int k = 0; k < p->n; k++) {
        p->fixed[k] = p->locked[k] || box->at[k] != 0;
        p->fixed_rate[k] = box->at[k] ? box->x[k] : 0;
    }
    if (decompose_free(p)) {
        keep_better(p, compute_candidate(p), best);
    }
}

double solve_within_bounds(RateProblem *p)
{
    Candidate best = {-2, -1};
    memset(p->b, 0, p->n * sizeof(double));
    hold_one_by_one(p, &best);
    if (best.scale < 1) {
        hold_as_in_box(p, &best);
    }
    double scale = best.scale;
    if (scale < 0) {
        scale = nearest_scale(p, p->best_a);
    }
    memcpy(p->fixed, p->best_fixed, p->n);
    memcpy(p->limited, p->best_fixed, p->n);
    if (best.critical >= 0) {
        p->limited[best.critical] = 1;
    }
    for (int k = 0; k < p->n; k++) {
        double y = scale * p->best_a[k] + p->best_b[k];
        p->y[k] = clamp(y, p->lo[k], p->hi[k]);
        p->limited[k] |= p->y[k] != y;
    }
    return scale;
}

static void project_to_null_space(const RateProblem *p, double *d)
{
    int n = p->n;
    /* The second projection removes rounding errors. */
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < p->rank; i++) {
            double along = dot(p->svd.v + i * n, d, n);
            for (int k = 0; k < n; k++) {
                d[k] -= along * p->svd.v[i * n + k];
            }
        }
    }
}

/* Returns the largest s in [0, 1] for which y + s d is within the bounds. Writes to *critical the
 * index of the joint that limits s, or -1 if no joint limits s. Components of d up to `rounding`
 * count as 0. */
static double largest_part(const RateProblem *p, const double *d, double rounding, int *critical)
{
    double part = 1;
    *critical = -1;
    for (int k = 0; k < p->n; k++) {
        double room = d[k] > 0 ? p->hi[k] - p->y[k] : p->y[k] - p->lo[k], size = fabs(d[k]);
        if (!p->fixed[k] && size > rounding && room < part * size) {
            part = fmax(room, 0) / size, *critical = k;
        }
    }
    return part;
}

void add_null_motion(RateProblem *p)
{
    int n = p->n, free = 0;
    for (int k = 0; k < n; k++) {
        free += !p->fixed[k];
    }
    double rest = 1, asked = sqrt(dot(p->z, p->z, n)), *d = p->a;
    for (; free > p->rank && rest > 0 && asked > 0; free--) {
        int critical;
        svd_decompose(&p->svd, p->J, p->fixed);
        for (int k = 0; k < n; k++) {
            d[k] = p->fixed[k] ? 0 : rest * p->z[k];
        }
        project_to_null_space(p, d);
        if (sqrt(dot(d, d, n)) <= NULL_MOTION * asked) {
            return;
        }
        double part = largest_part(p, d, NULL_MOTION * asked, &critical);
        for (int k = 0; k < n; k++) {
            p->y[k] += part * d[k];
        }
        if (critical < 0) {
            return;
        }
        p->fixed[critical] = p->limited[critical] = 1;
        rest *= 1 - part;
    }
}
