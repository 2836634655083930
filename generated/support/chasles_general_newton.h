/* Damped Newton iteration that moves a six-joint arm to a target pose. This file is part of chasles
 * and is the same for every robot. */
#ifndef CHASLES_GENERAL_NEWTON_H
#define CHASLES_GENERAL_NEWTON_H

#include <math.h>
#include <string.h>

#include "chasles_general_equations.h"
#include "chasles_general_roots.h"
#include "chasles_solve_six.h"

typedef struct {
    double q[6];
    double n[6];      /* the null vector of M */
    double along;     /* the suppressed angle */
    double c, s;      /* cos and sin of the suppressed angle */
    double imaginary; /* imaginary part of `along`, or 0 for a real root */
    int has_twin;     /* whether another root is close to this root */
    double left;      /* residual of the eight equations that are not part of M */
} chasles_general_start;

/* The state of Newton's iteration towards a pose. */
typedef struct {
    double q[6], J[36];
    double e[6];    /* remaining twist */
    double left;    /* larger of the remaining distance (m) and the remaining angle (rad) */
    double cost;    /* sum of squared pose errors, which every accepted step decreases */
    double damping; /* damping of the next step, or 0 for an undamped Newton step */
    int steps;      /* number of Newton steps so far */
    int is_over;    /* whether the iteration has ended */
} chasles_general_iterate;

/* Computes the coordinates (rad, m) of all joints from the coordinates of the unknown joints. The
 * argument `q` contains the unknown prismatic coordinates divided by `length` (m). */
static void chasles_general_all_joints(const chasles_general_six *six, const double *q,
                                       double length, double *all)
{
    for (int k = 0, from = 0, given = 0; k < six->arm->joints; k++) {
        if (!chasles_general_is_solved(six->arm, k)) {
            all[k] = six->value[given++];
        } else {
            all[k] = six->slides[from] ? length * q[from] : q[from];
            from++;
        }
    }
}

/* Computes the coordinates of all joints of the robot (rad, m) from the coordinates of the six
 * unknown joints. */
static void chasles_general_joints(const chasles_general_six *six, const double *q, double *all)
{
    chasles_general_all_joints(six, q, six->arm->length, all);
}

/* Computes the tool pose and the Jacobian columns of five joints and of an added sixth joint, which
 * rotates the tool about a tool axis. */
static void chasles_general_turned_tool(const chasles_general_six *six, const double *q, double *T,
                                        double *J)
{
    double all[CHASLES_CHAIN_MAX_JOINTS], own[6 * CHASLES_CHAIN_MAX_JOINTS];
    double from[3], axis[12], at[12], turned[12];
    const int n = six->arm->joints;
    const double *back = six->arm->placed[n + 1], c = cos(q[5]), s = sin(q[5]);
    const double turn[12] = {c, -s, 0.0, 0.0, s, c, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    chasles_general_joints(six, q, all);
    six->arm->pose_jacobian(all, T, own);
    for (int i = 0; i < 3; i++)
        from[i] = T[4 * i + 3];
    chasles_general_inverse(back, axis);
    chasles_general_product(T, axis, at);
    chasles_general_product(at, turn, turned);
    chasles_general_product(turned, back, T);
    for (int k = 0; k < 6; k++) {
        double w[3], v[3], lever[3];
        for (int i = 0; i < 3; i++) {
            w[i] = k < 5 ? own[n * (3 + i) + six->own[k]] : at[4 * i + 2];
            v[i] = k < 5 ? own[n * i + six->own[k]] : 0.0;
            lever[i] = T[4 * i + 3] - (k < 5 ? from[i] : at[4 * i + 3]);
        }
        for (int i = 0; i < 3; i++) {
            const int a = (i + 1) % 3, b = (i + 2) % 3;
            J[6 * i + k] = v[i] + w[a] * lever[b] - w[b] * lever[a];
            J[6 * (3 + i) + k] = w[i];
        }
    }
}

/* Computes the forward kinematics of the robot and the Jacobian columns of its six unknown joints.
 */
static void chasles_general_forward(const chasles_general_six *six, const double *q, double *T,
                                    double *J)
{
    const int n = six->arm->joints;
    if (six->has_tool_joint) {
        chasles_general_turned_tool(six, q, T, J);
    } else if (n == 6 && !six->has_slides) {
        six->arm->pose_jacobian(q, T, J);
        return;
    } else {
        double all[CHASLES_CHAIN_MAX_JOINTS], whole[6 * CHASLES_CHAIN_MAX_JOINTS];
        chasles_general_joints(six, q, all);
        six->arm->pose_jacobian(all, T, whole);
        for (int i = 0; i < 6; i++) {
            for (int k = 0; k < 6; k++)
                J[6 * i + k] = whole[n * i + six->own[k]];
        }
    }
    for (int k = 0; k < 6; k++) {
        for (int i = 0; i < 3 && six->slides[k]; i++)
            J[6 * i + k] *= six->arm->length;
    }
}

/* Computes the tool twist (meter, radian) from the pose `at` to the pose T. Returns the larger of
 * the distance (meter) and the angle (radian) between the two poses. The returned angle depends on
 * all matrix entries, so it is large if a matrix is not a rotation. */
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
    const double factor = turned < CHASLES_SMALL_TURN ? 1.0 + sine * sine / 6.0
                          : sine > 0.0                ? atan2(sine, 0.5 * (trace - 1.0)) / sine
                                                      : 1.0;
    for (int k = 0; k < 3; k++)
        e[3 + k] = factor * w[k];
    return sqrt(position > turned ? position : turned);
}

/* Computes a Levenberg-Marquardt step towards the pose. */
static void chasles_general_damped(const chasles_general_iterate *iterate, double length,
                                   double *step)
{
    double a[6][7], b[6][7];
    for (int i = 0; i < 6; i++) {
        const double weight = i < 3 ? 1.0 / length : 1.0;
        for (int k = 0; k < 6; k++)
            a[i][k] = weight * iterate->J[6 * i + k];
        a[i][6] = weight * iterate->e[i];
    }
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < 7; k++) {
            b[i][k] = i == k ? iterate->damping : 0.0;
            for (int m = 0; m < 6; m++)
                b[i][k] += a[m][i] * a[m][k];
        }
    }
    memset(step, 0, 6 * sizeof *step);
    chasles_solve_six(b, step);
}

/* Returns the sum of the squared pose errors, which every accepted step decreases. */
static double chasles_general_cost(const double *e, double length)
{
    double meters = 0.0, radians = 0.0;
    for (int k = 0; k < 3; k++)
        meters += e[k] * e[k], radians += e[3 + k] * e[3 + k];
    return meters / (length * length) + radians;
}

static void chasles_general_begin(const chasles_general_six *six, const double *T, const double *q,
                                  chasles_general_iterate *iterate)
{
    double at[16];
    memcpy(iterate->q, q, sizeof iterate->q);
    chasles_general_forward(six, q, at, iterate->J);
    iterate->left = chasles_general_error(T, at, iterate->e);
    iterate->cost = chasles_general_cost(iterate->e, six->arm->length);
    iterate->damping = 0.0;
    iterate->steps = 0;
    iterate->is_over = iterate->left <= CHASLES_CLOSED;
}

/* Takes a step of at most half a radian or half the arm length if the step decreases the error;
 * otherwise, increases the damping of the next step. */
static void chasles_general_advance(const chasles_general_six *six, const double *T,
                                    const double *step, chasles_general_iterate *iterate)
{
    double q[6], at[16], J[36], e[6], most = 0.0, sum = 0.0;
    for (int k = 0; k < 6; k++) {
        most = fabs(step[k]) > most ? fabs(step[k]) : most;
        sum += fabs(step[k]);
    }
    const double part = !(sum < DBL_MAX) ? 0.0 : most > 0.5 ? 0.5 / most : 1.0;
    for (int k = 0; k < 6; k++)
        q[k] = iterate->q[k] + (part > 0.0 ? part * step[k] : 0.0);
    chasles_general_forward(six, q, at, J);
    const double left = chasles_general_error(T, at, e);
    const double cost = chasles_general_cost(e, six->arm->length);
    iterate->steps++;
    if (cost < iterate->cost) {
        const int is_slow = cost > 0.999999 * iterate->cost && iterate->left > CHASLES_NEAR;
        /* After a large improvement, the next step may be an undamped Newton step. */
        iterate->damping = cost < 0.25 * iterate->cost || iterate->damping < CHASLES_DAMPING_DROPPED
                               ? 0.0
                               : 0.03 * iterate->damping;
        iterate->left = left, iterate->cost = cost;
        memcpy(iterate->q, q, sizeof q);
        memcpy(iterate->J, J, sizeof J);
        memcpy(iterate->e, e, sizeof e);
        iterate->is_over = is_slow || left <= CHASLES_CLOSED;
    } else if (iterate->left < CHASLES_NEARLY_CLOSED || iterate->damping > CHASLES_DAMPING_MAX) {
        iterate->is_over = 1;
    } else {
        iterate->damping = iterate->damping > 0.0         ? 30.0 * iterate->damping
                           : iterate->left > CHASLES_NEAR ? CHASLES_DAMPING_FAR
                                                          : CHASLES_DAMPING_NEAR;
    }
}

/* Computes and tries the next undamped Newton steps of at most CHASLES_VECTOR_LANES configurations.
 */
static void chasles_general_newton(const chasles_general_six *six, const double *T,
                                   chasles_general_iterate *const *iterates, int count)
{
    double rows[7][6][CHASLES_VECTOR_LANES];
    chasles_vector a[7][6], determinant = {0.0};
    for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
        const chasles_general_iterate *iterate = iterates[l < count ? l : 0];
        for (int i = 0; i < 6; i++) {
            const double weight = i < 3 ? 1.0 / six->arm->length : 1.0;
            for (int k = 0; k < 6; k++)
                rows[k][i][l] = weight * iterate->J[6 * i + k];
            rows[6][i][l] = weight * iterate->e[i];
        }
    }
    memcpy(a, rows, sizeof a);
    chasles_general_triangle(a, 7, &determinant);
    chasles_general_upper(a, a[6]);
    for (int l = 0; l < count; l++) {
        double step[6];
        for (int k = 0; k < 6; k++)
            step[k] = CHASLES_LANE(a[6][k], l);
        chasles_general_advance(six, T, step, iterates[l]);
    }
}

/* Computes and tries a damped Newton step towards the target pose. */
static void chasles_general_step_damped(const chasles_general_six *six, const double *T,
                                        chasles_general_iterate *iterate)
{
    double step[6];
    chasles_general_damped(iterate, six->arm->length, step);
    chasles_general_advance(six, T, step, iterate);
}

/* Runs Newton's iteration towards the pose from many configurations, with damped steps where
 * needed. */
static void chasles_general_together(const chasles_general_six *six, const double *T,
                                     chasles_general_iterate *iterates, int count)
{
    chasles_general_iterate *going[CHASLES_VECTOR_LANES];
    for (int moved = 1, step = 0; moved && step < CHASLES_STEPS; step++) {
        int some = 0;
        moved = 0;
        for (int k = 0; k < count; k++) {
            if (!iterates[k].is_over && iterates[k].damping > 0.0) {
                chasles_general_step_damped(six, T, iterates + k);
                moved = 1;
            } else if (!iterates[k].is_over) {
                going[some++] = iterates + k;
            }
            if (some == CHASLES_VECTOR_LANES || (some > 0 && k == count - 1)) {
                chasles_general_newton(six, T, going, some);
                some = 0, moved = 1;
            }
        }
    }
}

/* Moves one configuration towards the target pose by Newton's iteration, with damped steps where
 * needed. */
static void chasles_general_polish(const chasles_general_six *six, const double *T, int most,
                                   chasles_general_iterate *iterate)
{
    while (!iterate->is_over && iterate->steps < most) {
        if (iterate->damping > 0.0) {
            chasles_general_step_damped(six, T, iterate);
        } else {
            chasles_general_newton(six, T, &iterate, 1);
        }
    }
    for (int i = 0; i < 6; i++)
        iterate->q[i] = chasles_general_wrapped(six, i, iterate->q[i]);
}

/* Computes the margins of many matrices J. A margin is the ratio of |det J| to the product of the
 * column norms, from 0 (singular) to 1. */
static void chasles_general_margins(const double (*J)[36], int count, double length, double *margin)
{
    double rows[6][6][CHASLES_VECTOR_LANES];
    for (int from = 0; from < count; from += CHASLES_VECTOR_LANES) {
        for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
            const double *own = J[from + l < count ? from + l : from];
            for (int i = 0; i < 6; i++) {
                for (int k = 0; k < 6; k++)
                    rows[k][i][l] = i < 3 ? own[6 * i + k] / length : own[6 * i + k];
            }
        }
        const chasles_vector zero = {0.0};
        chasles_vector a[6][6], determinant = zero + 1.0, squares = zero + 1.0;
        memcpy(a, rows, sizeof a);
        for (int k = 0; k < 6; k++) {
            chasles_vector sum = a[k][0] * a[k][0];
            for (int i = 1; i < 6; i++)
                sum += a[k][i] * a[k][i];
            squares *= sum;
        }
        chasles_general_triangle(a, 6, &determinant);
        const chasles_vector found =
            chasles_vector_sizes(determinant) / chasles_vector_square_roots(squares);
        for (int l = 0; l < CHASLES_VECTOR_LANES && from + l < count; l++)
            margin[from + l] = CHASLES_LANE(found, l);
    }
}

/* Distance (rad, or relative to the arm length) between successive points on a self-motion curve.
 */
#define CHASLES_WALK_STEP 0.1
/* Maximum number of points on a self-motion curve in one direction, which cover about one
 * revolution of two joints. */
#define CHASLES_WALK_POINTS 100
/* Maximum number of corrector steps from a point onto the self-motion curve. */
#define CHASLES_WALK_CORRECTIONS 8

/* A point on a self-motion curve. */
typedef struct {
    chasles_general_iterate iterate;
    double v[6], u[6];
    double left; /* u . e, the component of the pose error e along u, which no joint motion can
                    remove */
} chasles_general_walk_point;

/* Solves (J + u v^T) x = b, or the same equations with the transposed matrix. Returns whether the
 * solution x is finite and not zero. */
static int chasles_general_bordered(const chasles_general_walk_point *point, double length,
                                    int transposed, const double *b, double *x)
{
    double a[6][7], sum = 0.0;
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < 6; k++) {
            const int row = transposed ? k : i, column = transposed ? i : k;
            const double weight = row < 3 ? 1.0 / length : 1.0;
            a[i][k] =
                weight * point->iterate.J[6 * row + column] + point->u[row] * point->v[column];
        }
        a[i][6] = b[i];
        x[i] = 0.0;
    }
    chasles_solve_six(a, x);
    for (int k = 0; k < 6; k++)
        sum += fabs(x[k]);
    return sum > 0.0 && sum < DBL_MAX;
}

static void chasles_general_normalise(double *x)
{
    double squares = 0.0;
    for (int k = 0; k < 6; k++)
        squares += x[k] * x[k];
    for (int k = 0; k < 6; k++)
        x[k] /= sqrt(squares);
}

/* Moves a point onto the self-motion curve. At each point of the self-motion curve, the pose error
 * is parallel to the vector u of this point. Returns whether the correction onto the curve
 * converged. */
static int chasles_general_onto_curve(const chasles_general_six *six, const double *T,
                                      chasles_general_walk_point *point)
{
    const double length = six->arm->length;
    for (int step = 0; step < CHASLES_WALK_CORRECTIONS; step++) {
        double x[6], e[6], rest = 0.0;
        if (!chasles_general_bordered(point, length, 0, point->u, x))
            return 0;
        memcpy(point->v, x, sizeof x);
        chasles_general_normalise(point->v);
        if (!chasles_general_bordered(point, length, 1, point->v, x))
            return 0;
        memcpy(point->u, x, sizeof x);
        chasles_general_normalise(point->u);
        point->left = 0.0;
        for (int i = 0; i < 6; i++) {
            e[i] = i < 3 ? point->iterate.e[i] / length : point->iterate.e[i];
            point->left += point->u[i] * e[i];
        }
        for (int i = 0; i < 6; i++) {
            e[i] -= point->left * point->u[i];
            rest += fabs(e[i]);
        }
        if (rest < CHASLES_NEARLY_CLOSED || rest < 1e-3 * fabs(point->left))
            return 1;
        if (!chasles_general_bordered(point, length, 0, e, x))
            return 0;
        for (int i = 0; i < 6; i++)
            x[i] += point->iterate.q[i];
        chasles_general_begin(six, T, x, &point->iterate);
    }
    return 0;
}

/* Finds a point of the self-motion curve near a configuration. Returns whether the search found a
 * point.
 */
static int chasles_general_walk_start(const chasles_general_six *six, const double *T,
                                      const double *q, chasles_general_walk_point *point)
{
    static const double some[6] = {0.41, -0.37, 0.45, 0.33, -0.48, 0.39};
    memcpy(point->v, some, sizeof some);
    memcpy(point->u, some, sizeof some);
    chasles_general_begin(six, T, q, &point->iterate);
    return chasles_general_onto_curve(six, T, point);
}

/* Follows the self-motion curve in one direction. Stores start configurations for Newton's
 * iteration in `iterates`: the curve points where the remaining pose error changes its sign or has
 * a minimum. Returns the number of start configurations. */
static int chasles_general_walk(const chasles_general_six *six, const double *T,
                                const chasles_general_walk_point *start, double sense,
                                chasles_general_iterate *iterates, int most)
{
    chasles_general_walk_point before = *start, point = *start, next;
    int count = 0;
    for (int k = 0; k < CHASLES_WALK_POINTS && count < most; k++) {
        double q[6];
        next = point;
        for (int i = 0; i < 6; i++)
            q[i] = point.iterate.q[i] + sense * CHASLES_WALK_STEP * point.v[i];
        chasles_general_begin(six, T, q, &next.iterate);
        if (!chasles_general_onto_curve(six, T, &next) || fabs(next.left) > CHASLES_NEAR)
            break;
        const double own = fabs(point.left), after = fabs(next.left);
        if (point.left * next.left < 0.0) {
            const double part = own / (own + after);
            for (int i = 0; i < 6; i++)
                q[i] = point.iterate.q[i] + part * (next.iterate.q[i] - point.iterate.q[i]);
            chasles_general_begin(six, T, q, iterates + count++);
        } else if (own <= after && own <= fabs(before.left)) {
            iterates[count++] = point.iterate;
            iterates[count - 1].steps = 0;
        }
        before = point;
        point = next;
    }
    return count;
}

#endif
