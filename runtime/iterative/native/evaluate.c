#include "iterative/native/evaluate.h"

#include <math.h>
#include <string.h>

#include "numerics/_linear_solve.h"
#include "numerics/_tolerances.h"

#define CORRECTIONS 12 /* Newton steps of a platform's chain onto the values of its actuators */

int scratch_size(const Arm *arm)
{
    int n = arm->n;
    int for_link = POSE * arm->n_links + arm->n_joints * n, for_platform = 2 * n * n + n;
    return for_link + for_platform + TWIST * n * n + 2 * TWIST * n;
}

void call_kernel(const chasles_kernel *kernel, const double *x, double *first, double *second)
{
    const double *const inputs[] = {x};
    double *const outputs[] = {first, second};
    kernel->call(inputs, outputs);
}

/* Expresses a screw in base axes: the linear and angular velocity at the origin of its frame, and
 * the vector from there to the point. */
static void screw_in_base(const Screw *screw, const double *poses, const double *point, double *v,
                          double *w, double *lever)
{
    memcpy(lever, point, 3 * sizeof *lever);
    if (screw->frame < 0) {
        memcpy(v, screw->axis, 3 * sizeof *v);
        memcpy(w, screw->axis + 3, 3 * sizeof *w);
        return;
    }
    const double *frame = poses + POSE * screw->frame;
    rotate(frame, screw->axis, v);
    rotate(frame, screw->axis + 3, w);
    for (int i = 0; i < 3; i++) {
        lever[i] -= frame[4 * i + 3];
    }
}

/* Writes the pose T of the link and the mixed Jacobian J (6, n) of its origin: each screw between
 * the base and the link moves the origin by v + w x lever. */
static void evaluate_link(const Arm *arm, const double *q, double *T, double *J, double *scratch)
{
    double *poses = scratch, *rates = poses + POSE * arm->n_links;
    int n = arm->n, has_loops = arm->n_kernels > 1;
    call_kernel(arm->kernels[0], q, poses, NULL);
    memcpy(T, poses + POSE * arm->link, POSE * sizeof(double));
    if (has_loops) {
        call_kernel(arm->kernels[1], q, rates, NULL);
    }
    memset(J, 0, TWIST * n * sizeof(double));
    const double origin[] = {T[3], T[7], T[11]};
    for (int s = 0; s < arm->n_screws; s++) {
        const Screw *screw = &arm->screws[s];
        double v[3], w[3], lever[3], by_rotation[3];
        screw_in_base(screw, poses, origin, v, w, lever);
        cross(w, lever, by_rotation);
        for (int k = 0; k < n; k++) {
            double rate = has_loops ? rates[screw->joint * n + k] : screw->joint == k;
            for (int i = 0; i < 3; i++) {
                J[i * n + k] += rate * (v[i] + by_rotation[i]);
                J[(i + 3) * n + k] += rate * w[i];
            }
        }
    }
}

/* Writes the pose T and the mixed Jacobian J (6, n) by the actuators, NaN at a singularity where
 * the actuators do not determine the chain. */
static void evaluate_platform(const Arm *arm, const double *x, double *T, double *J,
                              double *scratch)
{
    int n = arm->n;
    double *rates = scratch, *transposed = rates + n * n;
    const double *theta = x + n;
    call_kernel(arm->kernels[0], theta, T, NULL);
    call_kernel(arm->kernels[1], theta, J, NULL);
    call_kernel(arm->kernels[3], theta, transposed, NULL);
    /* With B the rates of the actuators by the chain's joints, J_q = J_theta B^-1, which is solved
     * as B^T J_q^T = J_theta^T. */
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            rates[i * n + j] = transposed[j * n + i];
        }
    }
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < TWIST; i++) {
            transposed[k * TWIST + i] = J[i * n + k];
        }
    }
    int solved = solve_pivoted(rates, n, transposed, TWIST);
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < TWIST; i++) {
            J[i * n + k] = solved ? transposed[k * TWIST + i] : NAN;
        }
    }
}

/* Moves the joints of a platform's chain to where its actuators have their values, by Newton's
 * iteration. Returns 0 where it does not converge. */
static int follow_actuators(const Arm *arm, double *x, double *scratch)
{
    int n = arm->n;
    double *rates = scratch, *error = rates + n * n, before = INFINITY;
    double *theta = x + n;
    for (int k = 0; k < CORRECTIONS; k++) {
        double largest = 0;
        call_kernel(arm->kernels[2], theta, error, NULL);
        for (int i = 0; i < n; i++) {
            error[i] = x[i] - error[i];
            largest = larger(largest, fabs(error[i]));
            if (isnan(error[i])) {
                return 0;
            }
        }
        if (largest <= ACTUATORS_CLOSED || (largest < ACTUATORS_AT_ROUNDING && largest >= before)) {
            return 1;
        }
        if (largest > ACTUATORS_DIVERGE * before) {
            return 0;
        }
        before = largest;
        call_kernel(arm->kernels[3], theta, rates, NULL);
        if (!solve_pivoted(rates, n, error, 1)) {
            return 0;
        }
        for (int i = 0; i < n; i++) {
            theta[i] += error[i];
        }
    }
    return 0;
}

/* Writes the Jacobian of the weighted error, (n, 6), from the mixed Jacobian J (6, n). */
static void error_jacobian(const Problem *problem, const double *T, const double *J,
                           const double *p, const double *w, double *columns)
{
    int n = problem->arm->n;
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < TWIST; i++) {
            columns[k * TWIST + i] = J[i * n + k];
        }
    }
    to_task_axes(problem->task, T, columns, n);
    if (!problem->task->whole) {
        differentiate_displacement(problem->task, p, w, columns, n);
    }
    apply_weights(problem->task, columns, n);
}

int evaluate(const Problem *problem, double *x, double *columns, Evaluation *out)
{
    const Arm *arm = problem->arm;
    double *J = problem->work->scratch, *scratch = J + TWIST * arm->n, p[3];
    if (arm->kind == TIP_TOOL) {
        call_kernel(arm->kernels[0], x, out->T, J);
    } else if (arm->kind == TIP_LINK) {
        evaluate_link(arm, x, out->T, J, scratch);
    } else {
        if (!follow_actuators(arm, x, problem->work->scratch)) {
            return 0;
        }
        evaluate_platform(arm, x, out->T, J, scratch);
    }
    pose_error(problem->task, out->T, problem->target, out->e, p);
    error_jacobian(problem, out->T, J, p, out->e + 3, columns);
    measure_error(problem->task, p, out);
    return isfinite(out->residual);
}
