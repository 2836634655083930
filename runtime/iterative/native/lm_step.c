#include "iterative/native/lm_step.h"

#include <math.h>
#include <string.h>

#include "iterative/native/evaluate.h"
#include "numerics/_linear_solve.h"
#include "numerics/_tolerances.h"

int find_free(const Problem *problem, const double *e)
{
    const Arm *arm = problem->arm;
    const Workspace *work = problem->work;
    int m = 0;
    for (int k = 0; k < arm->n; k++) {
        double slope = dot6(work->J + k * TWIST, e);
        int locked = problem->task->locked && problem->task->locked[k];
        int is_fixed = locked || (slope < 0 && work->q[k] <= arm->lower[k]) ||
                       (slope > 0 && work->q[k] >= arm->upper[k]);
        if (!is_fixed) {
            work->free[m++] = k;
        }
    }
    return m;
}

void normal_equations(const Workspace *work, const double *columns, const double *e, int m)
{
    for (int a = 0; a < m; a++) {
        const double *column = columns + work->free[a] * TWIST;
        work->gradient[a] = dot6(column, e);
        for (int b = 0; b <= a; b++) {
            work->normal[a * m + b] = dot6(column, columns + work->free[b] * TWIST);
        }
    }
}

/* Writes to `end` the configuration after a damped step from work->q, clipped to the limits.
 * Returns the largest displacement of a coordinate. */
static double damped_step(const Problem *problem, int m, double lambda, double *end)
{
    const Arm *arm = problem->arm;
    const Workspace *work = problem->work;
    double longest = 0, moved = 0;
    memcpy(work->A, work->normal, m * m * sizeof(double));
    memcpy(work->step, work->gradient, m * sizeof(double));
    for (int a = 0; a < m; a++) {
        work->A[a * m + a] += lambda;
    }
    solve_symmetric(work->A, m, m, work->step);
    for (int a = 0; a < m; a++) {
        longest = larger(longest, fabs(work->step[a]));
    }
    double part = longest > LM_LONGEST_STEP ? LM_LONGEST_STEP / longest : 1;
    memcpy(end, work->q, arm->n * sizeof(double));
    for (int a = 0; a < m; a++) {
        int k = work->free[a];
        double value = work->q[k] + part * work->step[a];
        end[k] = smaller(larger(value, arm->lower[k]), arm->upper[k]);
        moved = larger(moved, fabs(end[k] - work->q[k]));
    }
    return moved;
}

/* Writes the result of Halley's step, which uses J + H dq / 2 instead of J. */
static void halley_step(const Problem *problem, const Evaluation *now, int m, double lambda)
{
    const Workspace *work = problem->work;
    int n = problem->arm->n;
    double *H = work->scratch, *columns = H + TWIST * n * n;
    call_kernel(problem->arm->kernels[1], work->q, H, NULL);
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < TWIST; i++) {
            const double *row = H + (i * n + k) * n;
            double sum = 0;
            for (int j = 0; j < n; j++) {
                sum += row[j] * (work->trial[j] - work->q[j]);
            }
            columns[k * TWIST + i] = sum / 2;
        }
    }
    to_task_axes(problem->task, now->T, columns, n);
    apply_weights(problem->task, columns, n);
    for (int i = 0; i < TWIST * n; i++) {
        columns[i] += work->J[i];
    }
    normal_equations(work, columns, now->e, m);
    damped_step(problem, m, lambda, work->halley);
}

static void swap_pointers(double **a, double **b)
{
    double *kept = *a;
    *a = *b;
    *b = kept;
}

int lm_step(const Problem *problem, int m, double lambda, int *budget, Evaluation *now, int *better)
{
    Workspace *work = problem->work;
    Evaluation end, halley_end;
    if (lambda > LM_GREATEST_LAMBDA ||
        damped_step(problem, m, lambda, work->trial) <= LM_SHORTEST_STEP) {
        return 0;
    }
    double least = now->half_square;
    *budget -= 1;
    *better = evaluate(problem, work->trial, work->trial_J, &end) && end.half_square < least;
    least = *better ? end.half_square : least;
    if (problem->arm->link < 0 && *budget > 0 && now->residual < HALLEY_RESIDUAL &&
        least > HALLEY_REMAINDER * now->half_square) {
        halley_step(problem, now, m, lambda);
        *budget -= 1;
        if (evaluate(problem, work->halley, work->halley_J, &halley_end) &&
            halley_end.half_square < least) {
            swap_pointers(&work->trial, &work->halley);
            swap_pointers(&work->trial_J, &work->halley_J);
            end = halley_end;
            *better = 1;
        }
        normal_equations(work, work->J, now->e, m);
    }
    if (*better) {
        *now = end;
    }
    return 1;
}
