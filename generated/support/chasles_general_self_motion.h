/* Walks along a self-motion that errors of the geometry have spoiled; part of chasles, the same for
 * every such robot.
 *
 * Where the nominal arm moves without its tool, J of the true arm is nearly singular along a curve,
 * and one component of the pose error is left on it: of order 1e-7 for errors of 0.2 mm. This
 * component vanishes at the solutions alone, and Newton's steps across the curve do not find them.
 * With the unit vectors v and u of the least singular value of J (rows of lengths over the arm's
 * length), J + u v^T is regular. It gives the steps that remove all other components of the error,
 * and v and u of the next point.
 */
#ifndef CHASLES_GENERAL_SELF_MOTION_H
#define CHASLES_GENERAL_SELF_MOTION_H

#include <math.h>
#include <string.h>

#include "chasles_general_newton.h"

/* rad, or parts of the length: distance of two points of a walk. */
#define CHASLES_WALK_STEP 0.1
/* Points of a walk in one sense: about one turn of two joints. */
#define CHASLES_WALK_POINTS 100
/* Steps onto the curve. */
#define CHASLES_WALK_CORRECTIONS 8

/* A point of a walk. */
typedef struct {
    chasles_general_way way;
    double v[6], u[6];
    double left; /* u . e: what no joint removes */
} chasles_general_walk_point;

/* Solves (J + u v^T) x = b, or with its transpose. Returns whether x is finite. */
static int chasles_general_bordered(const chasles_general_walk_point *point, double length,
                                    int transposed, const double *b, double *x)
{
    double a[6][7], sum = 0.0;
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < 6; k++) {
            const int row = transposed ? k : i, column = transposed ? i : k;
            const double weight = row < 3 ? 1.0 / length : 1.0;
            a[i][k] = weight * point->way.J[6 * row + column] + point->u[row] * point->v[column];
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

/* Moves a point onto the curve: u is left of its error alone. Returns whether it is there. */
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
            e[i] = i < 3 ? point->way.e[i] / length : point->way.e[i];
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
            x[i] += point->way.q[i];
        chasles_general_begin(six, T, x, &point->way);
    }
    return 0;
}

/* The point of the curve near a configuration. Returns whether there is one. */
static int chasles_general_walk_start(const chasles_general_six *six, const double *T,
                                      const double *q, chasles_general_walk_point *point)
{
    static const double some[6] = {0.41, -0.37, 0.45, 0.33, -0.48, 0.39};
    memcpy(point->v, some, sizeof some);
    memcpy(point->u, some, sizeof some);
    chasles_general_begin(six, T, q, &point->way);
    return chasles_general_onto_curve(six, T, point);
}

/* Configurations of a walk in one sense from which Newton's steps may end at a solution: where the
 * error that is left changes its sign or is least. Returns their number. */
static int chasles_general_walk(const chasles_general_six *six, const double *T,
                                const chasles_general_walk_point *start, double sense,
                                chasles_general_way *ways, int most)
{
    chasles_general_walk_point before = *start, point = *start, next;
    int count = 0;
    for (int k = 0; k < CHASLES_WALK_POINTS && count < most; k++) {
        double q[6];
        next = point;
        for (int i = 0; i < 6; i++)
            q[i] = point.way.q[i] + sense * CHASLES_WALK_STEP * point.v[i];
        chasles_general_begin(six, T, q, &next.way);
        if (!chasles_general_onto_curve(six, T, &next) || fabs(next.left) > CHASLES_NEAR)
            break;
        const double own = fabs(point.left), after = fabs(next.left);
        if (point.left * next.left < 0.0) {
            const double part = own / (own + after);
            for (int i = 0; i < 6; i++)
                q[i] = point.way.q[i] + part * (next.way.q[i] - point.way.q[i]);
            chasles_general_begin(six, T, q, ways + count++);
        } else if (own <= after && own <= fabs(before.left)) {
            ways[count++] = point.way;
            ways[count - 1].steps = 0;
        }
        before = point;
        point = next;
    }
    return count;
}

#endif
