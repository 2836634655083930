/* Inverse kinematics of an arm of five joints of any geometry, solved as one of six whose last
 * joint turns the tool and stays at 0; part of chasles, the same for every such robot.
 */
#ifndef CHASLES_GENERAL_TOOL_H
#define CHASLES_GENERAL_TOOL_H

#include "chasles_general_solutions.h"

#define CHASLES_TOOL_STEPS 8

typedef chasles_general_arm chasles_general_tool_arm;

/* A step of Gauss and Newton of the five joints, from what J leaves of a pose. */
static void chasles_general_tool_step(const chasles_general_arm *arm, const double *J,
                                      const double *e, double *step)
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
        a[i][i] += CHASLES_DAMPING_NEAR * trace;
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
        chasles_general_tool_step(arm, J, e, step);
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

/* Every solution of a pose in sixteen slots, solutions first. */
static void chasles_general_tool_ik(const chasles_general_tool_arm *arm, const double *T, double *q,
                                    double *residual, double *margin)
{
    double all[5 * CHASLES_SLOTS], left[CHASLES_SLOTS], margins[CHASLES_SLOTS];
    chasles_general_slots(arm, NULL, T, all, left, margins);
    for (int k = 0; k < CHASLES_SLOTS; k++)
        left[k] = chasles_general_tool_polish(arm, T, all + 5 * k);
    int slot = 0;
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
