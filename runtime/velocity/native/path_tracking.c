#include "velocity/native/path_tracking.h"

#include <math.h>
#include <stdlib.h>

#include "numerics/_logarithm.h"

#define HALVINGS 40 /* maximum number of times that a step is halved until the loops close */

int tracking_new(Tracking *t, double border, double damping)
{
    size_t n = (size_t)t->n;
    t->memory = malloc((2 * TWIST + 3) * n * sizeof(double));
    if (!t->memory || !damped_box_new(&t->box, t->n)) {
        free(t->memory);
        return 0;
    }
    damped_box_start(&t->box, border, damping);
    t->box.moving = 0;
    for (size_t j = 0; j < n; j++) {
        t->box.moving += t->rate[j] > 0;
    }
    t->J = t->memory;
    t->scaled = t->J + TWIST * n;
    t->low = t->scaled + TWIST * n;
    t->high = t->low + n;
    t->step = t->high + n;
    return 1;
}

void tracking_free(Tracking *t)
{
    damped_box_free(&t->box);
    free(t->memory);
}

/* Computes T and J at q. Returns 0 if T or J is not finite, which means that a loop is open. */
static int forward_kinematics(Tracking *t, const double *q)
{
    t->kernel->call(&q, (double *[]){t->T, t->J});
    double sum = 0;
    for (int i = 0; i < POSE; i++) {
        sum += t->T[i];
    }
    for (int i = 0; i < TWIST * t->n; i++) {
        sum += t->J[i];
    }
    return isfinite(sum);
}

/* Computes the displacement from the tool pose to pose k, and the size of this displacement. Then
 * adapts the damping, and decomposes the Jacobian. */
static void measure_error(Tracking *t, ptrdiff_t k)
{
    displacement_between(t->T, t->poses + POSE * k, t->missing);
    t->error[2 * k] = sqrt(dot(t->missing, t->missing, 3));
    t->error[2 * k + 1] = sqrt(dot(t->missing + 3, t->missing + 3, 3));
    for (int i = 0; i < TWIST; i++) {
        for (int j = 0; j < t->n; j++) {
            double scaled = t->J[i * t->n + j] * (i < 3 ? 1 : t->length) / t->unit[j];
            t->scaled[i * t->n + j] = t->rate[j] == 0 ? 0 : scaled;
        }
    }
    double distance = t->error[2 * k], rotated = t->length * t->error[2 * k + 1];
    if (k > 0) {
        double after = distance * distance + rotated * rotated;
        damped_box_adapt(&t->box, t->before, t->expected, after);
    }
    t->sigma[k] = damped_box_decompose(&t->box, t->scaled);
}

/* Returns coordinate j after a step. Despite rounding errors, the result exceeds neither the limits
 * of the coordinate nor its rate limit. */
static double step_coordinate(const Tracking *t, int j, double from, double step)
{
    if (t->rate[j] == 0) {
        return from;
    }
    double most = t->rate[j] * t->dt, change = clamp(step, -most, most);
    double to = clamp(from + change, t->lower[j], t->upper[j]);
    /* If rounding errors would let the rate exceed its limit, the step is shortened. */
    while (fabs(to - from) > most || fabs((to - from) / t->dt) > t->rate[j]) {
        change = nextafter(change, 0);
        to = clamp(from + change, t->lower[j], t->upper[j]);
    }
    return to;
}

static void compute_step(Tracking *t, ptrdiff_t k)
{
    double ahead[TWIST], asked[TWIST], all[TWIST];
    displacement_between(t->poses + POSE * k, t->poses + POSE * (k + 1), ahead);
    for (int i = 0; i < TWIST; i++) {
        asked[i] = (ahead[i] + t->gain * t->missing[i]) * (i < 3 ? 1 : t->length);
        all[i] = (ahead[i] + t->missing[i]) * (i < 3 ? 1 : t->length);
    }
    const double *q = t->q + k * t->n;
    for (int j = 0; j < t->n; j++) {
        double most = t->rate[j] * t->dt;
        t->low[j] = fmax(-most, t->lower[j] - q[j]) * t->unit[j];
        t->high[j] = fmin(most, t->upper[j] - q[j]) * t->unit[j];
    }
    damped_box_solve(&t->box, asked);
    damped_box_bound(&t->box, t->low, t->high);
    t->before = dot(all, all, TWIST);
    t->expected = damped_box_residual(&t->box, all);
    for (int j = 0; j < t->n; j++) {
        int at = t->box.at[j];
        double to_limit = at < 0 ? q[j] - t->lower[j] : t->upper[j] - q[j];
        t->touched[k * t->n + j] = at == 0                          ? 0
                                   : to_limit <= t->rate[j] * t->dt ? LIMIT_TOUCHED
                                                                    : RATE_TOUCHED;
        t->step[j] = t->box.x[j] / t->unit[j];
    }
}

/* Takes the step from row k of q, shortened until forward kinematics is finite. */
static void take_step(Tracking *t, ptrdiff_t k)
{
    int n = t->n;
    const double *q = t->q + k * n;
    double *next = t->q + (k + 1) * n, part = 1;
    for (int halvings = 0;; halvings++) {
        for (int j = 0; j < n; j++) {
            next[j] = step_coordinate(t, j, q[j], part * t->step[j]);
        }
        if (forward_kinematics(t, next) || part == 0) {
            break;
        }
        part = halvings < HALVINGS ? part / 2 : 0;
    }
    for (int j = 0; j < n; j++) {
        t->qd[k * n + j] = (next[j] - q[j]) / t->dt;
        t->touched[k * n + j] |= part < 1 ? SHORTENED : 0;
    }
}

int track_path(Tracking *t, ptrdiff_t first, ptrdiff_t last)
{
    if (first == 0) {
        if (!forward_kinematics(t, t->q)) {
            return 0;
        }
        measure_error(t, 0);
    }
    for (ptrdiff_t k = first; k < last && k + 1 < t->m; k++) {
        compute_step(t, k);
        take_step(t, k);
        measure_error(t, k + 1);
    }
    return 1;
}
