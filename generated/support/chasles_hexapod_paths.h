/* Follows the complex poses of a platform along paths while its rods change from the start rods to
 * the current rods. All complex poses of the platform with the start rods are known. This file is
 * part of chasles and is the same for every platform on six rods.
 *
 * Each SIMD lane follows one path with its own step size. When a path ends, the SIMD lane of this
 * path takes the next path.
 *
 * Source: Sommese and Wampler 2005, The Numerical Solution of Systems of Polynomials, ch. 2 and 7.
 */
#ifndef CHASLES_HEXAPOD_PATHS_H
#define CHASLES_HEXAPOD_PATHS_H

#include <math.h>
#include <string.h>

#include "chasles_hexapod_system.h"
#include "chasles_hexapod_tolerances.h"

#define CHASLES_MAX_PATHS 40
/* Maximum number of steps per path. A typical path needs about thirty steps. */
#define CHASLES_MAX_STEPS 1000

/* A pose in Study coordinates, and its path parameter t (0 at the start of the path, 1 at the end).
 */
typedef struct {
    chasles_hexapod_number x[CHASLES_SOMA];
    double t;
} chasles_hexapod_end;

/* Poses and progress of the paths that are tracked in parallel, one path per SIMD lane. */
typedef struct {
    chasles_hexapod_lanes x[CHASLES_SOMA];
    chasles_vector t, h;
    int path[CHASLES_VECTOR_LANES]; /* index of the path in each SIMD lane, or -1 for an empty lane
                                     */
    int steps[CHASLES_VECTOR_LANES];
} chasles_hexapod_group;

/* Normalizes the vector x in every SIMD lane. */
static void chasles_hexapod_normal(chasles_hexapod_lanes *x)
{
    chasles_vector sum = {0.0}, size;
    for (int k = 0; k < CHASLES_SOMA; k++) {
        chasles_hexapod_square(x + k, &size);
        sum += size;
    }
    size = chasles_vector_square_roots(sum);
    for (int k = 0; k < CHASLES_SOMA; k++)
        x[k].re /= size, x[k].im /= size;
}

/* Computes x + factor y in every SIMD lane. */
static inline void chasles_hexapod_sum(const chasles_hexapod_lanes *x, const chasles_vector *factor,
                                       const chasles_hexapod_lanes *y, chasles_hexapod_lanes *sum)
{
    for (int k = 0; k < CHASLES_SOMA; k++) {
        sum[k].re = x[k].re + *factor * y[k].re;
        sum[k].im = x[k].im + *factor * y[k].im;
    }
}

/* Computes the derivative of the pose x with respect to the path parameter. */
static void chasles_hexapod_tangent(const chasles_hexapod_path *path,
                                    const chasles_hexapod_place *place,
                                    const chasles_hexapod_lanes *x, const chasles_hexapod_lanes *of,
                                    chasles_hexapod_lanes *slope)
{
    chasles_hexapod_lanes a[CHASLES_SOMA][CHASLES_SOMA + 1];
    chasles_hexapod_newton(place, x, of, a);
    chasles_hexapod_along(path, x, a);
    chasles_hexapod_solve(a, slope);
}

/* Computes and takes a Newton step of the pose x, and computes the squared length of the step. */
static void chasles_hexapod_corrected(const chasles_hexapod_place *place,
                                      const chasles_hexapod_lanes *of, chasles_hexapod_lanes *x,
                                      chasles_vector *length)
{
    chasles_hexapod_lanes a[CHASLES_SOMA][CHASLES_SOMA + 1], step[CHASLES_SOMA];
    chasles_vector sum = {0.0}, square;
    chasles_hexapod_newton(place, x, of, a);
    chasles_hexapod_solve(a, step);
    for (int k = 0; k < CHASLES_SOMA; k++) {
        chasles_hexapod_square(step + k, &square);
        sum += square;
        x[k].re += step[k].re, x[k].im += step[k].im;
    }
    *length = sum;
}

/* Computes the next pose in every SIMD lane after a trial step, and the squared lengths of the two
 * Newton corrections. */
static void chasles_hexapod_tried(const chasles_hexapod_path *path, chasles_hexapod_place *place,
                                  const chasles_hexapod_group *group, chasles_hexapod_lanes *next,
                                  chasles_vector *corrections)
{
    const chasles_hexapod_lanes *x = group->x;
    chasles_hexapod_lanes slope[4][CHASLES_SOMA], at[CHASLES_SOMA];
    const chasles_vector half = 0.5 * group->h;
    const chasles_vector middle = group->t + half, end = group->t + group->h;
    chasles_hexapod_placed(path, &group->t, 0, place);
    chasles_hexapod_tangent(path, place, x, x, slope[0]);
    chasles_hexapod_placed(path, &middle, 0, place);
    chasles_hexapod_sum(x, &half, slope[0], at);
    chasles_hexapod_tangent(path, place, at, x, slope[1]);
    chasles_hexapod_sum(x, &half, slope[1], at);
    chasles_hexapod_tangent(path, place, at, x, slope[2]);
    chasles_hexapod_placed(path, &end, 0, place);
    chasles_hexapod_sum(x, &group->h, slope[2], at);
    chasles_hexapod_tangent(path, place, at, x, slope[3]);
    for (int k = 0; k < CHASLES_SOMA; k++) {
        next[k].re = x[k].re + group->h / 6.0 *
                                   (slope[0][k].re + 2.0 * (slope[1][k].re + slope[2][k].re) +
                                    slope[3][k].re);
        next[k].im = x[k].im + group->h / 6.0 *
                                   (slope[0][k].im + 2.0 * (slope[1][k].im + slope[2][k].im) +
                                    slope[3][k].im);
    }
    for (int k = 0; k < 2; k++)
        chasles_hexapod_corrected(place, x, next, corrections + k);
    chasles_hexapod_normal(next);
}

/* Computes the factor by which the step size of a path changes. The Newton correction grows with
 * the fifth power of the step size. The factor is computed with a fourth root instead of a fifth
 * root, so the step size changes slightly more than necessary. */
static double chasles_hexapod_growth(double correction, double near)
{
    const double ratio = 0.5 * near / (correction + 1e-30);
    const double factor = ratio > 0.0 ? sqrt(sqrt(ratio)) : 0.25;
    return factor < 0.25 ? 0.25 : factor > 2.0 ? 2.0 : factor;
}

/* Assigns the next path to a SIMD lane, or marks the lane as empty if no path remains. */
static void chasles_hexapod_next(chasles_hexapod_group *group, int lane,
                                 const chasles_hexapod_number (*starts)[CHASLES_SOMA],
                                 const int *which, int count, int *from)
{
    const int path = *from < count ? which[(*from)++] : -1;
    group->path[lane] = path;
    group->steps[lane] = 0;
    CHASLES_LANE(group->t, lane) = 0.0;
    CHASLES_LANE(group->h, lane) = path < 0 ? 0.0 : CHASLES_PATH_FIRST;
    for (int k = 0; k < CHASLES_SOMA; k++) {
        /* A SIMD lane without a path takes steps of length 0. */
        if (path >= 0) {
            CHASLES_LANE(group->x[k].re, lane) = starts[path][k].re;
            CHASLES_LANE(group->x[k].im, lane) = starts[path][k].im;
        }
    }
}

/* Follows the selected paths of a homotopy. The argument `which` contains the indices of these
 * paths. The tracking of each path either ends at a solution for the current rods, or fails. */
static void chasles_hexapod_follow(const chasles_hexapod_path *path,
                                   const chasles_hexapod_number (*starts)[CHASLES_SOMA],
                                   const int *which, int count, double near,
                                   chasles_hexapod_end *ends)
{
    chasles_hexapod_group group;
    chasles_hexapod_place place;
    chasles_hexapod_lanes next[CHASLES_SOMA];
    chasles_vector corrections[2];
    int from = 0, left = count;
    for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
        for (int k = 0; k < CHASLES_SOMA; k++) {
            CHASLES_LANE(group.x[k].re, l) = starts[which[0]][k].re;
            CHASLES_LANE(group.x[k].im, l) = starts[which[0]][k].im;
        }
        chasles_hexapod_next(&group, l, starts, which, count, &from);
    }
    chasles_hexapod_normal(group.x);
    chasles_hexapod_placed(path, &group.t, 1, &place);
    while (left > 0) {
        chasles_hexapod_tried(path, &place, &group, next, corrections);
        for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
            const int path = group.path[l];
            const double first = sqrt(CHASLES_LANE(corrections[0], l)),
                         second = sqrt(CHASLES_LANE(corrections[1], l));
            const double factor = chasles_hexapod_growth(first, near);
            if (path < 0)
                continue;
            if (first < near && second < CHASLES_PATH_ON) {
                CHASLES_LANE(group.t, l) += CHASLES_LANE(group.h, l);
                CHASLES_LANE(group.h, l) *= factor;
                for (int k = 0; k < CHASLES_SOMA; k++)
                    CHASLES_LANE(group.x[k].re, l) = CHASLES_LANE(next[k].re, l),
                                                CHASLES_LANE(group.x[k].im, l) =
                                                    CHASLES_LANE(next[k].im, l);
            } else {
                CHASLES_LANE(group.h, l) *= factor < 0.5 ? factor : 0.5;
            }
            const int lost = !(CHASLES_LANE(group.h, l) > CHASLES_PATH_SHORTEST) ||
                             ++group.steps[l] >= CHASLES_MAX_STEPS;
            if (CHASLES_LANE(group.h, l) > CHASLES_PATH_LONGEST)
                CHASLES_LANE(group.h, l) = CHASLES_PATH_LONGEST;
            if (CHASLES_LANE(group.h, l) > 1.0 - CHASLES_LANE(group.t, l))
                CHASLES_LANE(group.h, l) = 1.0 - CHASLES_LANE(group.t, l);
            if (CHASLES_LANE(group.t, l) == 1.0 || lost) {
                for (int k = 0; k < CHASLES_SOMA; k++) {
                    ends[path].x[k].re = CHASLES_LANE(group.x[k].re, l);
                    ends[path].x[k].im = CHASLES_LANE(group.x[k].im, l);
                }
                ends[path].t = CHASLES_LANE(group.t, l);
                left--;
                chasles_hexapod_next(&group, l, starts, which, count, &from);
            }
        }
    }
}

#endif
