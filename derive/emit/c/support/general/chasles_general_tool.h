/* Inverse kinematics of an arm with general geometry and five unknown joints; all other joints are
 * fixed. This file is part of chasles and is the same for every robot. */
#ifndef CHASLES_GENERAL_TOOL_H
#define CHASLES_GENERAL_TOOL_H

#include "chasles_general.h"

#define CHASLES_TOOL_STEPS 8
/* Maximum number of damped steps from a start configuration far away from the pose. */
#define CHASLES_TOOL_FAR_STEPS 60

typedef chasles_general_arm chasles_general_tool_arm;

/* Computes the tool pose and the Jacobian columns of the five unknown joints. */
static void chasles_general_tool_forward(const chasles_general_six *six, const double *q, double *T,
                                         double *J)
{
    double all[CHASLES_CHAIN_MAX_JOINTS], whole[6 * CHASLES_CHAIN_MAX_JOINTS];
    chasles_general_all_joints(six, q, 1.0, all);
    six->arm->pose_jacobian(all, T, whole);
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < 5; k++)
            J[5 * i + k] = whole[six->arm->joints * i + six->own[k]];
    }
}

/* Computes a Levenberg-Marquardt step of the five unknown joints from the Jacobian J and the pose
 * error e. */
static void chasles_general_tool_step(double length, const double *J, const double *e,
                                      double damping, double *step)
{
    double a[6][7] = {{0.0}}, found[6] = {0.0}, trace = 0.0;
    for (int m = 0; m < 6; m++) {
        const double weight = m < 3 ? 1.0 / (length * length) : 1.0;
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

/* Refines the coordinates of five joints with which the tool nearly reaches a pose. Returns the
 * residual after refinement (meter or radian). */
static double chasles_general_tool_polish(const chasles_general_six *six, const double *T,
                                          double *q)
{
    double at[16], J[30], e[6], step[5], next[5];
    chasles_general_tool_forward(six, q, at, J);
    double left = chasles_general_error(T, at, e);
    for (int k = 0; k < CHASLES_TOOL_STEPS && left < CHASLES_NEAR && left > CHASLES_CLOSED; k++) {
        chasles_general_tool_step(six->arm->length, J, e, CHASLES_DAMPING_NEAR, step);
        for (int i = 0; i < 5; i++)
            next[i] = chasles_general_wrapped(six, i, q[i] + step[i]);
        chasles_general_tool_forward(six, next, at, J);
        const double then = chasles_general_error(T, at, e);
        if (!(then < left))
            break;
        memcpy(q, next, sizeof next);
        left = then;
    }
    return left;
}

/* Moves five joints from a distant start configuration by Levenberg-Marquardt steps, until the tool
 * nearly reaches the pose. */
static void chasles_general_tool_descend(const chasles_general_six *six, const double *T, double *q)
{
    double at[16], J[30], e[6], step[5], next[5], next_J[30], next_e[6], damping = 1e-3;
    chasles_general_tool_forward(six, q, at, J);
    double left = chasles_general_error(T, at, e);
    double cost = chasles_general_cost(e, six->arm->length);
    for (int k = 0; k < CHASLES_TOOL_FAR_STEPS && left > CHASLES_NEAR; k++) {
        chasles_general_tool_step(six->arm->length, J, e, damping, step);
        for (int i = 0; i < 5; i++)
            next[i] = q[i] + step[i];
        chasles_general_tool_forward(six, next, at, next_J);
        const double then = chasles_general_error(T, at, next_e);
        const double next_cost = chasles_general_cost(next_e, six->arm->length);
        const int is_better = next_cost < cost;
        damping *= is_better ? 0.1 : 10.0;
        if (!(damping < CHASLES_DAMPING_MAX))
            return;
        if (!is_better)
            continue;
        memcpy(q, next, sizeof next);
        memcpy(J, next_J, sizeof next_J);
        memcpy(e, next_e, sizeof next_e);
        left = then, cost = next_cost;
    }
}

/* Moves five joints towards a pose by Levenberg-Marquardt steps from quasi-random start values. The
 * quasi-random start values are multiples of square roots of small primes, modulo one turn. If a
 * prismatic joint moves in the plane of other joints, the arm with the added sixth joint has a
 * continuum of solutions, which the determinant's roots do not give. */
static void chasles_general_tool_restart(const chasles_general_six *six, const double *T, double *q)
{
    static const double roots[5] = {1.41421356, 1.73205081, 2.23606798, 2.64575131, 3.31662479};
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        for (int i = 0; i < 5; i++) {
            const double angle = chasles_circle_wrapped(CHASLES_TURN * k * roots[i]);
            q[5 * k + i] = six->slides[i] ? angle / CHASLES_TURN * six->arm->length : angle;
        }
        chasles_general_tool_descend(six, T, q + 5 * k);
    }
}

/* Returns whether one of the residuals is small enough for a valid solution. */
static int chasles_general_tool_is_solved(const double *left)
{
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        if (left[k] <= CHASLES_SOLVED)
            return 1;
    }
    return 0;
}

/* Returns whether two configurations of the five joints are equal. */
static int chasles_general_tool_is_same(const chasles_general_six *six, const double *a,
                                        const double *b)
{
    for (int i = 0; i < 5; i++) {
        const double apart =
            six->slides[i] ? (a[i] - b[i]) / six->arm->length : chasles_circle_wrapped(a[i] - b[i]);
        if (!(fabs(apart) < CHASLES_SAME))
            return 0;
    }
    return 1;
}

/* Searches for solutions from quasi-random start values, because none of the given configurations
 * is a solution. The solutions found replace these configurations. */
static void chasles_general_tool_search(const chasles_general_six *six, const double *T,
                                        double *all, double *left, double *margins)
{
    double q[5 * CHASLES_SLOTS];
    int slot = 0;
    chasles_general_tool_restart(six, T, q);
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        const double found = chasles_general_tool_polish(six, T, q + 5 * k);
        int is_known = 0;
        for (int m = 0; m < slot; m++)
            is_known = is_known || chasles_general_tool_is_same(six, q + 5 * k, all + 5 * m);
        if (is_known || !(found <= CHASLES_SOLVED))
            continue;
        memcpy(all + 5 * slot, q + 5 * k, 5 * sizeof *q);
        left[slot] = found;
        margins[slot++] = 0.0;
    }
}

/* Writes the solutions of a pose to sixteen solution slots, valid solutions first. The argument
 * `value` contains the values of the fixed joints (rad or m), or is NULL if no joint is fixed. */
static void chasles_general_tool_ik(const chasles_general_tool_arm *arm, const double *T,
                                    const double *value, double *q, double *residual,
                                    double *margin)
{
    const int n = arm->joints;
    double all[5 * CHASLES_SLOTS], left[CHASLES_SLOTS], margins[CHASLES_SLOTS];
    chasles_general_six six;
    chasles_general_slots(arm, value, T, q, left, margins);
    if (!isfinite(left[0])) {
        memcpy(residual, left, sizeof left);
        memcpy(margin, margins, sizeof margins);
        return;
    }
    chasles_general_set(arm, value, &six);
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        for (int i = 0; i < 5; i++)
            all[5 * k + i] = q[n * k + six.own[i]];
        left[k] = chasles_general_tool_polish(&six, T, all + 5 * k);
    }
    if (six.has_slides && !chasles_general_tool_is_solved(left))
        chasles_general_tool_search(&six, T, all, left, margins);
    /* If several solution slots converge to the same solution, only the first of these slots keeps
     * the solution. */
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        for (int i = 0; i < k && left[k] <= CHASLES_SOLVED; i++) {
            if (left[i] <= CHASLES_SOLVED &&
                chasles_general_tool_is_same(&six, all + 5 * k, all + 5 * i)) {
                for (int j = 0; j < 5; j++)
                    all[5 * k + j] = NAN;
                left[k] = NAN;
            }
        }
    }
    int slot = 0;
    for (int others = 0; others < 2; others++) {
        for (int k = 0; k < CHASLES_SLOTS; k++) {
            if ((left[k] <= CHASLES_SOLVED) == others)
                continue;
            chasles_general_all_joints(&six, all + 5 * k, 1.0, q + n * slot);
            residual[slot] = left[k];
            margin[slot] = others ? -left[k] : margins[k];
            slot++;
        }
    }
}

#endif
