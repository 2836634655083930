/* The weighted error between two poses, and its Jacobian.
 *
 * If all six weights are positive, the error is the logarithm of the relative pose, a twist. If a
 * weight is 0, the error consists of a translation vector and a rotation vector. The error is
 * measured at the tip and expressed in the task axes: base axes or tip axes. */
#pragma once

#include <string.h>

#include "iterative/native/arm.h"
#include "numerics/_logarithm.h"

typedef struct {
    double T[POSE];     /* the pose of the tip */
    double e[TWIST];    /* weighted error */
    double half_square; /* |e|^2 / 2 */
    double residual; /* maximum of distance error [unit] and angle error [rad], over components with
                        positive weight */
} Evaluation;

/* Transforms n twists or Jacobian columns (n, 6) from base axes to task axes. */
static inline void to_task_axes(const Task *task, const double *T, double *columns, int n)
{
    for (int i = 0; i < TWIST * n && task->in_tool_axes; i += 3) {
        double local[3];
        rotate_back(T, columns + i, local);
        memcpy(columns + i, local, sizeof local);
    }
}

static inline void apply_weights(const Task *task, double *columns, int n)
{
    for (int i = 0; i < TWIST; i++) {
        for (int k = 0; k < n && task->weights[i] != 1; k++) {
            columns[k * TWIST + i] *= task->weights[i];
        }
    }
}

/* Writes the unweighted error (6,) and the vector p from tip to target, in task axes. */
static inline void pose_error(const Task *task, const double *T, const double *target, double *e,
                              double *p)
{
    for (int i = 0; i < 3; i++) {
        p[i] = target[4 * i + 3] - T[4 * i + 3];
    }
    if (task->whole) {
        twist_between(T, target, e);
    } else {
        displacement_between(T, target, e);
    }
    to_task_axes(task, T, e, 1);
    if (task->in_tool_axes) {
        double local[3];
        rotate_back(T, p, local);
        memcpy(p, local, sizeof local);
    }
}

/* Replaces the tip twists (n, 6), in task axes, by the negative derivatives of a displacement. The
 * displacement (p, w) leads from the tip to the target. */
static inline void differentiate_displacement(const Task *task, const double *p, const double *w,
                                              double *columns, int n)
{
    double angle = sqrt(dot3(w, w));
    double k = logarithm_coefficient(angle, angle / (2 * tan(angle / 2)));
    double half = task->in_tool_axes ? -0.5 : 0.5;
    for (double *column = columns; column < columns + TWIST * n; column += TWIST) {
        double *omega = column + 3, by_p[3], by_w[3], twice[3];
        cross(omega, p, by_p);
        cross(w, omega, by_w);
        cross(w, by_w, twice);
        for (int i = 0; i < 3; i++) {
            column[i] += task->in_tool_axes ? by_p[i] : 0;
            omega[i] += half * by_w[i] + k * twice[i];
        }
    }
}

/* Applies the weights to the error e (6,) and computes its norms. */
static inline void measure_error(const Task *task, const double *p, Evaluation *out)
{
    double *e = out->e, distance = 0, angle = 0, sum = 0;
    for (int i = 0; i < TWIST; i++) {
        double w = task->weights[i];
        if (w > 0) {
            distance += i < 3 ? p[i] * p[i] : 0;
            angle += i < 3 ? 0 : e[i] * e[i];
        }
        e[i] *= w;
        sum += e[i] * e[i];
    }
    out->half_square = sum / 2;
    distance /= task->unit * task->unit;
    /* Adding 0 * (distance + angle) propagates NaN, which the comparison could drop. */
    out->residual = (distance + angle) * 0 + sqrt(distance > angle ? distance : angle);
}
