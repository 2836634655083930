/* Inverse kinematics of an arm with general geometry and six unknown joints; all other joints are
 * fixed. This file is part of chasles and is the same for every robot.
 */
#ifndef CHASLES_GENERAL_H
#define CHASLES_GENERAL_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_general_back.h"

#define CHASLES_SLOTS 16
/* The solutions of a pose count as complete only if the solutions of this number of nearby poses
 * are complete. */
#define CHASLES_AGREED 4

/* The solutions found so far, without duplicates. */
typedef struct {
    int count;
    int open; /* number of iterations that ended near a solution without convergence */
    double q[CHASLES_SLOTS][6], residual[CHASLES_SLOTS], J[CHASLES_SLOTS][36];
} chasles_general_found;

/* Selects the stored solution that a new solution with the Jacobian J replaces: the one whose
 * Jacobian is nearest to a singular matrix. Returns the index of the stored solution, or -1 if J is
 * at least as near to a singular matrix as all stored Jacobians. */
static int chasles_general_room(const chasles_general_six *six, const chasles_general_found *found,
                                const double *J)
{
    double margin[CHASLES_SLOTS + 1], all[CHASLES_SLOTS + 1][36];
    memcpy(all, found->J, sizeof found->J);
    memcpy(all[CHASLES_SLOTS], J, sizeof *all);
    chasles_general_margins((const double(*)[36])all, CHASLES_SLOTS + 1, six->arm->length, margin);
    int own = 0;
    for (int k = 1; k < CHASLES_SLOTS; k++)
        own = margin[k] < margin[own] ? k : own;
    return margin[own] >= margin[CHASLES_SLOTS] ? -1 : own;
}

/* Returns the lowest index, not less than `from`, of a stored solution that equals q, or the number
 * of stored solutions if none equals q. */
static int chasles_general_same(const chasles_general_six *six, const chasles_general_found *found,
                                const double *q, int from)
{
    for (int own = from; own < found->count; own++) {
        double most = 0.0;
        for (int k = 0; k < 6; k++) {
            const double apart = fabs(chasles_general_wrapped(six, k, q[k] - found->q[own][k]));
            most = apart > most ? apart : most;
        }
        if (most < CHASLES_SAME)
            return own;
    }
    return found->count;
}

/* Stores a configuration if it is a solution. Returns the index of this solution among the stored
 * solutions, or -1 if the solution is not stored. */
static int chasles_general_keep(const chasles_general_six *six, chasles_general_found *found,
                                const chasles_general_iterate *iterate)
{
    if (!(iterate->left <= CHASLES_SOLVED))
        return -1;
    int own = chasles_general_same(six, found, iterate->q, 0);
    /* In a continuum of solutions, a refined solution may coincide with two stored solutions. */
    if (own < found->count &&
        (found->residual[own] <= iterate->left ||
         chasles_general_same(six, found, iterate->q, own + 1) < found->count))
        return own;
    if (own == CHASLES_SLOTS)
        own = chasles_general_room(six, found, iterate->J);
    if (own < 0)
        return -1;
    found->count += own == found->count;
    memcpy(found->q[own], iterate->q, sizeof iterate->q);
    memcpy(found->J[own], iterate->J, sizeof iterate->J);
    found->residual[own] = iterate->left;
    return own;
}

/* Computes, by one step of inverse iteration, the direction of joint motion that changes the pose
 * least according to the Jacobian J. */
static void chasles_general_least(const double *J, double length, double *direction)
{
    double a[6][7], norm = 0.0;
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < 6; k++) {
            a[i][k] = i == k ? CHASLES_SHIFT : 0.0;
            for (int m = 0; m < 6; m++) {
                a[i][k] += J[6 * m + i] * J[6 * m + k] * (m < 3 ? 1.0 / (length * length) : 1.0);
            }
        }
        a[i][6] = 1.0 + 0.1 * i;
        direction[i] = 0.0;
    }
    chasles_solve_six(a, direction);
    for (int k = 0; k < 6; k++)
        norm += direction[k] * direction[k];
    norm = norm > 0.0 ? sqrt(norm) : 1.0;
    for (int k = 0; k < 6; k++)
        direction[k] /= norm;
}

/* Iterates a configuration to convergence by Newton's method and stores the solution. Returns a bit
 * mask in which the bit at the index of the solution is set, or 0 if the solution is not stored. */
static unsigned chasles_general_finish(const chasles_general_six *six, const double *T,
                                       chasles_general_iterate *iterate,
                                       chasles_general_found *found)
{
    chasles_general_polish(six, T, CHASLES_STEPS, iterate);
    /* Near a double solution, each Newton step only halves the error, so that many steps are
     * necessary to recognize duplicates. */
    if (iterate->left <= CHASLES_SOLVED && !iterate->is_over)
        chasles_general_polish(six, T, 2 * CHASLES_STEPS, iterate);
    const int own = chasles_general_keep(six, found, iterate);
    found->open += iterate->left > CHASLES_SOLVED && iterate->left < CHASLES_NEAR;
    return own < 0 ? 0 : 1u << own;
}

/* Starts Newton's iteration from two configurations, one on each side of a double root. */
static void chasles_general_sides(const chasles_general_six *six, const double *T,
                                  const chasles_general_start *start,
                                  chasles_general_iterate *iterates)
{
    double q[6], direction[6];
    chasles_general_begin(six, T, start->q, iterates);
    chasles_general_least(iterates->J, six->arm->length, direction);
    const double apart = sqrt(iterates->left) + start->imaginary;
    for (int side = 0; side < 2; side++) {
        for (int k = 0; k < 6; k++)
            q[k] = start->q[k] + (side ? apart : -apart) * direction[k];
        chasles_general_begin(six, T, q, iterates + side);
    }
}

static int chasles_general_bits(unsigned places)
{
    int count = 0;
    for (; places; places &= places - 1)
        count++;
    return count;
}

/* Returns whether solutions may be missing near a root of the determinant. */
static int chasles_general_is_short(const chasles_general_six *six,
                                    const chasles_general_order *order,
                                    const chasles_general_start *starts, int count,
                                    const chasles_general_found *found, int k)
{
    const int joint = order->joint[2];
    const double sign = order->sense * chasles_general_direction(six, joint);
    int roots = 0, near = 0;
    for (int i = 0; i < count; i++) {
        const double apart = chasles_circle_wrapped(starts[i].along - starts[k].along);
        roots += starts[i].imaginary == 0.0 && fabs(apart) < CHASLES_TWINS;
    }
    for (int i = 0; i < found->count; i++) {
        const double apart = chasles_circle_wrapped(sign * found->q[i][joint] - starts[k].along);
        near += fabs(apart) < CHASLES_TWINS;
    }
    return near < roots || (near - roots) % 2;
}

/* Finds the solutions at close roots of the determinant, by Newton's iteration from both null
 * vectors of the matrix. Returns the indices of the stored solutions as a bit mask. */
static unsigned chasles_general_by_twins(const chasles_general_six *six, const double *T,
                                         const chasles_general_order *order,
                                         const chasles_general_system *system,
                                         const chasles_general_start *starts, int count,
                                         chasles_general_found *found)
{
    chasles_general_start twins[2 * CHASLES_MAX_ROOTS];
    chasles_general_iterate iterates[2 * CHASLES_MAX_ROOTS];
    unsigned places = 0;
    const int all = chasles_general_twins(six, order, system, starts, count, twins);
    for (int k = 0; k < all; k++)
        chasles_general_begin(six, T, twins[k].q, iterates + k);
    chasles_general_together(six, T, iterates, all);
    for (int k = 0; k < all; k++)
        places |= chasles_general_finish(six, T, iterates + k, found);
    return places;
}

/* Finds the solutions that Newton's iteration reaches from the given start configurations. Returns
 * the indices of the found solutions as a bit mask. */
static unsigned chasles_general_by_starts(const chasles_general_six *six, const double *T,
                                          const chasles_general_start *starts, int count,
                                          chasles_general_found *found)
{
    chasles_general_iterate iterates[2 * CHASLES_MAX_ROOTS];
    unsigned places = 0;
    int all = 0;
    for (int k = 0; k < count; k++) {
        if (starts[k].imaginary > 0.0) {
            chasles_general_sides(six, T, starts + k, iterates + all);
            all += 2;
        } else {
            chasles_general_begin(six, T, starts[k].q, iterates + all);
            all++;
        }
    }
    chasles_general_together(six, T, iterates, all);
    for (int k = 0; k < all; k++)
        places |= chasles_general_finish(six, T, iterates + k, found);
    return places;
}

/* Finds the solutions at the roots of the determinant, for one elimination order. Returns whether
 * it is certain that all solutions were found. */
static int chasles_general_by_roots(const chasles_general_six *six, const double *T,
                                    const chasles_general_order *order,
                                    const chasles_general_system *system,
                                    const chasles_circle_roots *roots, chasles_general_found *found)
{
    chasles_general_start starts[CHASLES_MAX_ROOTS];
    int meeting = 0, certain;
    const int count = chasles_general_starts(six, order, system, roots, starts, &certain);
    for (int k = 0; k < count; k++)
        meeting += starts[k].imaginary > 0.0;
    found->open = 0;
    unsigned places = chasles_general_by_starts(six, T, starts, count, found);
    if (meeting > 0 || chasles_general_bits(places) < count)
        places |= chasles_general_by_twins(six, T, order, system, starts, count, found);
    certain = certain && found->open == 0;
    for (int k = 0; k < count; k++)
        certain = certain && !chasles_general_is_short(six, order, starts, count, found, k);
    /* A pose has an even number of solutions. */
    const int own = chasles_general_bits(places);
    return certain && own == found->count && own % 2 == 0;
}

/* Finds the solutions by one elimination order of the joints. Returns 1 if the solutions are known
 * to be complete, otherwise 0. */
static int chasles_general_by_order(const chasles_general_six *six, const double *T,
                                    const chasles_general_order *order,
                                    chasles_general_found *found)
{
    chasles_general_system system;
    chasles_circle_roots roots;
    chasles_general_eliminate(six, order, T, &system);
    const int certain = chasles_general_isolated(&system, &roots);
    return chasles_general_by_roots(six, T, order, &system, &roots, found) && certain;
}

/* Sizes of the rotations [rad] and shifts (relative to the arm length) from a pose to nearby poses.
 */
#define CHASLES_NUDGES 6
static const double chasles_general_sizes[CHASLES_NUDGES] = {1e-3, 1e-3, 1e-2, 1e-2, 1e-4, 1e-4};

/* Computes a slightly rotated and shifted copy of the pose T. The argument `number` selects the
 * direction of the rotation and of the shift. For each offset, another `number` gives the opposite
 * offset, because the pose T may be at the boundary of the reachable set. */
static void chasles_general_nudged(const double *T, double length, double size, int number,
                                   double *near)
{
    static const double directions[][6] = {
        {0.6, -0.5, 0.4, 0.3, 0.7, -0.6},
        {-0.3, 0.8, 0.5, -0.7, 0.2, 0.5},
        {0.7, 0.2, -0.6, 0.5, -0.4, -0.8},
        {-0.5, -0.6, -0.2, -0.4, 0.6, 0.3},
    };
    const double *w = directions[number / 2 % 4];
    size = number % 2 ? -size : size;
    const double a = size * w[0], b = size * w[1], c = size * w[2];
    const double n = 1.0 / (1.0 + a * a + b * b + c * c);
    /* Cayley's formula ensures that the matrix R is a rotation. */
    const double R[3][3] = {
        {n * (1.0 + a * a - b * b - c * c), 2.0 * n * (a * b - c), 2.0 * n * (a * c + b)},
        {2.0 * n * (a * b + c), n * (1.0 - a * a + b * b - c * c), 2.0 * n * (b * c - a)},
        {2.0 * n * (a * c - b), 2.0 * n * (b * c + a), n * (1.0 - a * a - b * b + c * c)},
    };
    memcpy(near, T, 16 * sizeof *T);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            near[4 * i + k] = R[i][0] * T[k] + R[i][1] * T[4 + k] + R[i][2] * T[8 + k];
        }
        near[4 * i + 3] += size * length * w[3 + i];
    }
}

/* Tries elimination orders until one order has certainly found all solutions. Returns 1 if an
 * elimination order has certainly found all solutions, otherwise 0. If two elimination orders find
 * no solution, the pose counts as unreachable. */
static int chasles_general_by_orders(const chasles_general_six *six, const double *T,
                                     chasles_general_found *found)
{
    found->count = 0;
    for (int k = 0; k < six->arm->orders; k++) {
        if (chasles_general_by_order(six, T, six->arm->order + k, found) &&
            (found->count > 0 || k > 0))
            return 1;
    }
    return 0;
}

/* Adds the solutions that Newton's iteration reaches from the solutions of nearby poses. Returns 1
 * if the solutions of enough nearby poses are known to be complete, otherwise 0. */
static int chasles_general_by_nearby(const chasles_general_six *six, const double *T,
                                     chasles_general_found *found)
{
    chasles_general_found nearby;
    chasles_general_iterate iterate;
    double near[16];
    int certain = 0;
    for (int k = 0; k < CHASLES_NUDGES && certain < CHASLES_AGREED; k++) {
        chasles_general_nudged(T, six->arm->length, chasles_general_sizes[k], k, near);
        certain += chasles_general_by_orders(six, near, &nearby);
        for (int i = 0; i < nearby.count; i++) {
            chasles_general_begin(six, T, nearby.q[i], &iterate);
            chasles_general_finish(six, T, &iterate, found);
        }
    }
    return certain >= CHASLES_AGREED;
}

/* Finds all solutions of a pose. If no elimination order certainly finds all solutions, Newton's
 * iteration also starts from the solutions of nearby poses. */
static void chasles_general_search_all(const chasles_general_six *six, const double *T,
                                       chasles_general_found *found)
{
    if (!chasles_general_by_orders(six, T, found))
        chasles_general_by_nearby(six, T, found);
}

/* Configurations that nearly reach the pose but are not solutions, and their residuals. */
typedef struct {
    double q[CHASLES_SLOTS][6], left[CHASLES_SLOTS];
} chasles_general_rest;

/* Finds the configurations with the smallest residuals from many starts, for a pose without a known
 * solution. A pose without a known solution is unreachable, or several of its solutions coincide
 * and convergence is slow. */
static void chasles_general_nearest(const chasles_general_six *six, const double *T,
                                    chasles_general_found *found, chasles_general_rest *rest)
{
    /* Displacements of prismatic joints start within (-pi, pi) times the arm length. */
    static const double roots[6] = {1.41421356, 1.73205081, 2.23606798,
                                    2.64575131, 3.31662479, 3.60555128};
    chasles_general_iterate iterate;
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        double q[6];
        for (int i = 0; i < 6; i++)
            q[i] = chasles_circle_wrapped(CHASLES_TURN * k * roots[i]);
        chasles_general_begin(six, T, q, &iterate);
        chasles_general_polish(six, T, 200, &iterate);
        if (iterate.left < CHASLES_NEAR) {
            chasles_general_begin(six, T, iterate.q, &iterate);
            chasles_general_polish(six, T, 1000, &iterate);
        }
        memcpy(rest->q[k], iterate.q, sizeof iterate.q);
        rest->left[k] = iterate.left;
        chasles_general_keep(six, found, &iterate);
    }
}

static double chasles_general_least_left(const chasles_general_rest *rest)
{
    double least = rest->left[0];
    for (int k = 1; k < CHASLES_SLOTS; k++)
        least = rest->left[k] < least ? rest->left[k] : least;
    return least;
}

/* Adds solutions that Newton's iteration reaches from points on the self-motion curve through a
 * configuration.
 */
static void chasles_general_by_curve(const chasles_general_six *six, const double *T,
                                     const double *q, chasles_general_found *found)
{
    chasles_general_walk_point start;
    chasles_general_iterate iterates[CHASLES_SLOTS];
    if (!chasles_general_walk_start(six, T, q, &start))
        return;
    for (int side = 0; side < 2; side++) {
        const double sense = side ? -1.0 : 1.0;
        const int count = chasles_general_walk(six, T, &start, sense, iterates, CHASLES_SLOTS);
        for (int k = 0; k < count; k++)
            chasles_general_finish(six, T, iterates + k, found);
    }
}

/* Solves the inverse kinematics for poses near T, and searches a self-motion curve near each of
 * these solutions for solutions of T. The search ends as soon as a solution of T is found. */
static void chasles_general_by_self_motion(const chasles_general_six *six, const double *T,
                                           chasles_general_found *found)
{
    chasles_general_found nearby;
    double near[16];
    for (int k = 0; k < CHASLES_NUDGES && found->count == 0; k++) {
        chasles_general_nudged(T, six->arm->length, chasles_general_sizes[k], k, near);
        chasles_general_by_orders(six, near, &nearby);
        for (int i = 0; i < nearby.count && found->count == 0; i++)
            chasles_general_by_curve(six, T, nearby.q[i], found);
    }
}

/* Fills all solution slots with a configuration that is not a solution. */
static void chasles_general_none(const chasles_general_six *six, const double *T,
                                 chasles_general_rest *rest)
{
    double q[6] = {0.0};
    chasles_general_iterate iterate;
    chasles_general_begin(six, T, q, &iterate);
    for (int k = 0; k < 6 && iterate.left <= CHASLES_SOLVED; k++) {
        q[k] = 1.0;
        chasles_general_begin(six, T, q, &iterate);
    }
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        memcpy(rest->q[k], q, sizeof q);
        rest->left[k] = iterate.left;
    }
}

/* Writes the solutions of a pose to sixteen solution slots. If the pose has no solution, the slots
 * contain the configurations with the smallest residuals. If the pose has a solution, each unused
 * slot contains a configuration that is not a solution. */
static inline void chasles_general_slots(const chasles_general_arm *arm, const double *value,
                                         const double *T, double *q, double *residual,
                                         double *margin)
{
    chasles_general_six six;
    chasles_general_found found;
    chasles_general_rest rest;
    double margins[CHASLES_SLOTS];
    int order[CHASLES_SLOTS], finite = 1;
    const int n = arm->joints, key = arm->order[0].joint[2];
    for (int k = 0; k < 16; k++)
        finite = finite && T[k] - T[k] == 0.0;
    for (int k = 0; k < chasles_general_given(arm); k++)
        finite = finite && value[k] - value[k] == 0.0;
    if (!finite) {
        for (int k = 0; k < CHASLES_SLOTS; k++) {
            for (int i = 0; i < n; i++)
                q[n * k + i] = NAN;
            residual[k] = margin[k] = NAN;
        }
        return;
    }
    chasles_general_set(arm, value, &six);
    chasles_general_search_all(&six, T, &found);
    if (found.count == 0)
        chasles_general_nearest(&six, T, &found, &rest);
    if (found.count == 0 && chasles_general_least_left(&rest) < CHASLES_NEAR)
        chasles_general_by_self_motion(&six, T, &found);
    if (found.count > 0)
        chasles_general_none(&six, T, &rest);
    chasles_general_margins((const double(*)[36])found.J, found.count, arm->length, margins);
    for (int i = 0; i < found.count; i++) {
        int k = i;
        for (; k > 0 && found.q[order[k - 1]][key] > found.q[i][key]; k--)
            order[k] = order[k - 1];
        order[k] = i;
    }
    for (int k = 0; k < CHASLES_SLOTS; k++) {
        const int there = k < found.count;
        chasles_general_joints(&six, there ? found.q[order[k]] : rest.q[k], q + n * k);
        residual[k] = there ? found.residual[order[k]] : rest.left[k];
        margin[k] = there ? margins[order[k]] : -rest.left[k];
    }
}

/* Writes the solutions of a pose to sixteen solution slots. All joints except the six unknown
 * joints are fixed at `value` (rad or m). If no joint is fixed, `value` is NULL. */
static inline void chasles_general_ik(const chasles_general_arm *arm, const double *T,
                                      const double *value, double *q, double *residual,
                                      double *margin)
{
    chasles_general_slots(arm, value, T, q, residual, margin);
}

#endif
