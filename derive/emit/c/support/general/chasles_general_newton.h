/* Newton's steps of an arm of six revolute joints onto a pose, damped where they do not help; part
 * of chasles, the same for every such robot.
 */
#ifndef CHASLES_GENERAL_NEWTON_H
#define CHASLES_GENERAL_NEWTON_H

#include <math.h>
#include <string.h>

#include "chasles_general_equations.h"
#include "chasles_general_tolerances.h"
#include "chasles_solve_six.h"

typedef struct {
    double q[6];
    double imaginary; /* of the suppressed angle; 0 for a real root */
    double along;     /* the suppressed angle */
    int twin;         /* 1 where another root is near, 2 for the vectors of both */
} chasles_general_start;

/* All joints of the robot, from the six that are solved for. */
static void chasles_general_joints(const chasles_general_six *six, const double *q, double *all)
{
    const int given = six->arm->given;
    for (int k = 0, from = 0; k < six->arm->joints; k++)
        all[k] = k == given ? six->value : q[from++];
}

/* The robot's own forward kinematics, and the six columns of its Jacobian. */
static void chasles_general_forward(const chasles_general_six *six, const double *q, double *T,
                                    double *J)
{
    const int given = six->arm->given;
    if (given < 0) {
        six->arm->pose_jacobian(q, T, J);
        return;
    }
    double all[CHASLES_MOST_JOINTS], whole[6 * CHASLES_MOST_JOINTS];
    chasles_general_joints(six, q, all);
    six->arm->pose_jacobian(all, T, whole);
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < 6; k++)
            J[6 * i + k] = whole[CHASLES_MOST_JOINTS * i + (k < given ? k : k + 1)];
    }
}

/* Difference of two poses (metre, radian) as a twist from the one to the other, at the tool.
 * Returns the larger of the distance and the angle: by all entries, so that what is no rotation is
 * seen. */
static double chasles_general_error(const double *T, const double *at, double *e)
{
    double w[3] = {0.0}, trace = 0.0, position = 0.0, turned = 0.0;
    for (int k = 0; k < 3; k++) {
        const double a[3] = {at[k], at[4 + k], at[8 + k]}, b[3] = {T[k], T[4 + k], T[8 + k]};
        w[0] += 0.5 * (a[1] * b[2] - a[2] * b[1]);
        w[1] += 0.5 * (a[2] * b[0] - a[0] * b[2]);
        w[2] += 0.5 * (a[0] * b[1] - a[1] * b[0]);
        for (int i = 0; i < 3; i++) {
            trace += a[i] * b[i];
            turned += 0.5 * (a[i] - b[i]) * (a[i] - b[i]);
        }
        e[k] = T[4 * k + 3] - at[4 * k + 3];
        position += e[k] * e[k];
    }
    const double sine = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    /* The angle over its sine; where it is small, to 1e-13 without an arc tangent. */
    const double factor = turned < CHASLES_SMALL_TURN ? 1.0 + sine * sine / 6.0
                          : sine > 0.0                ? atan2(sine, 0.5 * (trace - 1.0)) / sine
                                                      : 1.0;
    for (int k = 0; k < 3; k++)
        e[3 + k] = factor * w[k];
    return sqrt(position > turned ? position : turned);
}

/* One step towards the pose: Newton's where damping is 0, else Levenberg and Marquardt's. */
static void chasles_general_step(const double *J, const double *e, double length, double damping,
                                 double *step)
{
    double a[6][7], b[6][7];
    for (int i = 0; i < 6; i++) {
        const double weight = i < 3 ? 1.0 / length : 1.0;
        for (int k = 0; k < 6; k++)
            a[i][k] = weight * J[6 * i + k];
        a[i][6] = weight * e[i];
    }
    if (damping > 0.0) {
        for (int i = 0; i < 6; i++) {
            for (int k = 0; k < 7; k++) {
                b[i][k] = i == k ? damping : 0.0;
                for (int m = 0; m < 6; m++)
                    b[i][k] += a[m][i] * a[m][k];
            }
        }
        memcpy(a, b, sizeof a);
    }
    memset(step, 0, 6 * sizeof *step);
    chasles_solve_six(a, step);
    double most = 0.0;
    for (int k = 0; k < 6; k++)
        most = fabs(step[k]) > most ? fabs(step[k]) : most;
    if (!(most <= 0.5)) {
        for (int k = 0; k < 6; k++)
            step[k] = most < DBL_MAX ? step[k] * 0.5 / most : 0.0;
    }
}

/* What is left of a pose as the sum of squares that steps make smaller. */
static double chasles_general_cost(const double *e, double length)
{
    double metres = 0.0, radians = 0.0;
    for (int k = 0; k < 3; k++)
        metres += e[k] * e[k], radians += e[3 + k] * e[3 + k];
    return metres / (length * length) + radians;
}

/* Steps q towards the pose; returns what is left (metre or radian, the larger). */
static double chasles_general_polish(const chasles_general_six *six, const double *T, int most,
                                     double *q, double *J)
{
    double at[16], e[6], step[6], next[6], next_J[36], damping = 0.0;
    chasles_general_forward(six, q, at, J);
    double left = chasles_general_error(T, at, e);
    double cost = chasles_general_cost(e, six->arm->length);
    for (int k = 0; k < most && left > CHASLES_CLOSED; k++) {
        double next_e[6];
        chasles_general_step(J, e, six->arm->length, damping, step);
        for (int i = 0; i < 6; i++)
            next[i] = q[i] + step[i];
        chasles_general_forward(six, next, at, next_J);
        const double then = chasles_general_error(T, at, next_e);
        const double cost_then = chasles_general_cost(next_e, six->arm->length);
        if (cost_then < cost) {
            const int slow = cost_then > 0.999999 * cost && left > CHASLES_NEAR;
            /* Where a step did much, the next may be Newton's. */
            damping =
                cost_then < 0.25 * cost || damping < CHASLES_DAMPING_DROPPED ? 0.0 : 0.03 * damping;
            left = then, cost = cost_then;
            memcpy(q, next, sizeof next);
            memcpy(J, next_J, sizeof next_J);
            memcpy(e, next_e, sizeof e);
            if (slow)
                break;
        } else if (left < CHASLES_NEARLY_CLOSED || damping > CHASLES_DAMPING_MOST) {
            break;
        } else {
            damping = damping > 0.0         ? 30.0 * damping
                      : left > CHASLES_NEAR ? CHASLES_DAMPING_FAR
                                            : CHASLES_DAMPING_NEAR;
        }
    }
    for (int i = 0; i < 6; i++)
        q[i] = chasles_circle_wrapped(q[i]);
    return left;
}

/* |det J| over the product of its columns' lengths: 1 at best, 0 where J is singular. */
static double chasles_general_margin(const double *J, double length)
{
    double a[6][7], x[6], lengths = 1.0;
    for (int k = 0; k < 6; k++) {
        double sum = 0.0;
        for (int i = 0; i < 6; i++) {
            a[i][k] = i < 3 ? J[6 * i + k] / length : J[6 * i + k];
            sum += a[i][k] * a[i][k];
            a[i][6] = 0.0;
        }
        lengths *= sqrt(sum);
    }
    return fabs(chasles_solve_six(a, x)) / lengths;
}

#endif
