/* Inverse kinematics of an arm of five joints of any geometry, solved as one of six whose last
 * joint turns the tool and stays at 0; part of chasles, the same for every such robot.
 */
#ifndef CHASLES_GENERAL_TOOL_H
#define CHASLES_GENERAL_TOOL_H

#include "chasles_general_solutions.h"

#define CHASLES_TOOL_STEPS 8
/* Damped steps from far away at most. */
#define CHASLES_TOOL_FAR_STEPS 60

typedef chasles_general_arm chasles_general_tool_arm;

/* A step of Levenberg and Marquardt of the five joints, from what J leaves of a pose. */
static void chasles_general_tool_step(const chasles_general_arm *arm, const double *J,
                                      const double *e, double damping, double *step)
{
    double a[6][7] = {{0.0}}, found[6] = {0.0}, trace = 0.0;
    for (int m = 0; m < 6; m++) {
        const double weight = m < 3 ? 1.0 / (arm->length * arm->length) : 1.0;
        for (int i = 0; i < 5; i++) {
            for (int k = 0; k < 5; k++)
                a[i][k] += weight * J[5 * m + i] * J[5 * m + k];
            a[i][6] += weight * J[5 * m + i] * e[m];
        }
    }
    for (int i = 0; i < 5; i++)
        trace += a[i][i];
    for (int i = 0; i < 5; i++)
        a[i][i] += damping * trace;
    a[5][5] = 1.0;
    chasles_solve_six(a, found);
    memcpy(step, found, 5 * sizeof *step);
}

/* Leads five joints that nearly reach a pose onto it; returns what is left (metre or radian). */
static double chasles_general_tool_polish(const chasles_general_arm *arm, const double *T,
                                          double *q)
{
    double at[16], J[30], e[6], step[5], next[5];
    arm->pose_jacobian(q, at, J);
    double left = chasles_general_error(T, at, e);
    for (int k = 0; k < CHASLES_TOOL_STEPS && left < CHASLES_NEAR && left > CHASLES_CLOSED; k++) {
        chasles_general_tool_step(arm, J, e, CHASLES_DAMPING_NEAR, step);
        for (int i = 0; i < 5; i++)
            next[i] = chasles_general_slides(arm, i) ? q[i] + step[i]
                                                     : chasles_circle_wrapped(q[i] + step[i]);
        arm->pose_jacobian(next, at, J);
        const double then = chasles_general_error(T, at, e);
        if (!(then < left))
            break;
        memcpy(q, next, sizeof next);
        left = then;
    }
    return left;
}

/* Damped steps of five joints that are far from a pose, until they nearly reach it. */
static void chasles_general_tool_descend(const chasles_general_arm *arm, const double *T, double *q)
{
    double at[16], J[30], e[6], step[5], next[5], next_J[30], next_e[6], damping = 1e-3;
    arm->pose_jacobian(q, at, J);
    double left = chasles_general_error(T, at, e);
    double cost = chasles_general_cost(e, arm->length);
    for (int k = 0; k < CHASLES_TOOL_FAR_STEPS && left > CHASLES_NEAR; k++) {
        chasles_general_tool_step(arm, J, e, damping, step);
        for (int i = 0; i < 5; i++)
            next[i] = q[i] + step[i];
        arm->pose_jacobian(next, at, next_J);
        const double then = chasles_general_error(T, at, next_e);
        const double next_cost = chasles_general_cost(next_e, arm->length);
        const int is_better = next_cost < cost;
        damping *= is_better ? 0.1 : 10.0;
        if (!(damping < CHASLES_DAMPING_MOST))
            return;
        if (!is_better)
            continue;
        memcpy(q, next, sizeof next);
        memcpy(J, next_J, sizeof next_J);
        memcpy(e, next_e, sizeof next_e);
        left = then, cost = next_cost;
    }
}

/* Starts without a pattern, multiples of square roots, led towards a pose. Where a slide moves
 * along the plane of other joints, solutions are infinitely many, and the determinant has roots
 * beside them alone. */
static void chasles_general_tool_restart(const chasles_general_arm *arm, const double *T, double *q)
{
    static const double roots[5] = {1.41421356, 1.73205081, 2.23606798, 2.64575131, 3.31662479};
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        for (int i = 0; i < 5; i++) {
            const double angle = chasles_circle_wrapped(CHASLES_TURN * k * roots[i]);
            q[5 * k + i] =
                chasles_general_slides(arm, i) ? angle / CHASLES_TURN * arm->length : angle;
        }
        chasles_general_tool_descend(arm, T, q + 5 * k);
    }
}

/* Whether some residual is a solution's. */
static int chasles_general_tool_is_solved(const double *left)
{
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        if (left[k] <= CHASLES_SOLVED)
            return 1;
    }
    return 0;
}

/* Whether two configurations of five joints are one. */
static int chasles_general_tool_is_same(const chasles_general_arm *arm, const double *a,
                                        const double *b)
{
    for (int i = 0; i < 5; i++) {
        const double apart = chasles_general_slides(arm, i) ? (a[i] - b[i]) / arm->length
                                                            : chasles_circle_wrapped(a[i] - b[i]);
        if (!(fabs(apart) < CHASLES_SAME))
            return 0;
    }
    return 1;
}

/* Replaces answers of which none is a solution by what restarts reach, if this is one. */
static void chasles_general_tool_search(const chasles_general_arm *arm, const double *T,
                                        double *all, double *left, double *margins)
{
    double q[5 * CHASLES_SLOTS];
    int slot = 0;
    chasles_general_tool_restart(arm, T, q);
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        const double found = chasles_general_tool_polish(arm, T, q + 5 * k);
        int is_known = 0;
        for (int m = 0; m < slot; m++)
            is_known = is_known || chasles_general_tool_is_same(arm, q + 5 * k, all + 5 * m);
        if (is_known || !(found <= CHASLES_SOLVED))
            continue;
        memcpy(all + 5 * slot, q + 5 * k, 5 * sizeof *q);
        left[slot] = found;
        margins[slot++] = 0.0;
    }
}

/* Every solution of a pose in sixteen slots, solutions first. */
static void chasles_general_tool_ik(const chasles_general_tool_arm *arm, const double *T, double *q,
                                    double *residual, double *margin)
{
    double all[5 * CHASLES_SLOTS], left[CHASLES_SLOTS], margins[CHASLES_SLOTS];
    chasles_general_slots(arm, NULL, T, all, left, margins);
    for (int k = 0; k < CHASLES_SLOTS; k++)
        left[k] = chasles_general_tool_polish(arm, T, all + 5 * k);
    int slot = 0, slides = 0;
    for (int i = 0; i < 5; i++)
        slides = slides || chasles_general_slides(arm, i);
    if (slides && isfinite(left[0]) && !chasles_general_tool_is_solved(left))
        chasles_general_tool_search(arm, T, all, left, margins);
    for (int others = 0; others < 2; others++) {
        for (int k = 0; k < CHASLES_SLOTS; k++) {
            if ((left[k] <= CHASLES_SOLVED) == others)
                continue;
            memcpy(q + 5 * slot, all + 5 * k, 5 * sizeof *q);
            residual[slot] = left[k];
            margin[slot] = others ? -left[k] : margins[k];
            slot++;
        }
    }
}

#endif
