/* Computes all joints by back-substitution from each real root of det M, the determinant of the
 * matrix M. This file is part of chasles and is the same for every robot. For a prismatic joint,
 * the variables c and s are the displacement and its square instead of cosine and sine. */
#ifndef CHASLES_GENERAL_BACK_H
#define CHASLES_GENERAL_BACK_H

#include <math.h>
#include <string.h>

#include "chasles_cos_sin.h"
#include "chasles_general_newton.h"
#include "chasles_general_roots.h"

/* Computes cosine and sine of the direction of the vector (x, y), or 1 and 0 for the zero vector.
 */
CHASLES_INLINE void chasles_general_unit(chasles_vector x, chasles_vector y, chasles_vector *c,
                                         chasles_vector *s)
{
    const chasles_vector zero = {0.0};
    const chasles_vector size = chasles_vector_square_roots(x * x + y * y);
    const chasles_vector_mask is_there = size > zero;
    *c = chasles_vector_chosen(is_there, x / size, zero + 1.0);
    *s = chasles_vector_chosen(is_there, y / size, zero);
}

/* Computes cosine and sine of the joints v and w, which follow the suppressed joint, from the null
 * vector of the matrix M. */
CHASLES_INLINE void chasles_general_two(const chasles_vector *n, int slides, chasles_vector *c,
                                        chasles_vector *s)
{
    const double c0 = cos(CHASLES_HALF_FROM), s0 = sin(CHASLES_HALF_FROM);
    const chasles_vector zero = {0.0};
    const chasles_vector high = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    const chasles_vector low = n[3] * n[3] + n[4] * n[4] + n[5] * n[5];
    const chasles_vector along = n[0] * n[3] + n[1] * n[4] + n[2] * n[5];
    const chasles_vector_mask row = low > high;
    chasles_vector r[3];
    for (int k = 0; k < 3; k++) {
        r[k] = chasles_vector_chosen(row, low * n[3 + k] + along * n[k],
                                     high * n[k] + along * n[3 + k]);
    }
    const chasles_vector y = n[0] * r[0] + n[1] * r[1] + n[2] * r[2];
    const chasles_vector x = n[3] * r[0] + n[4] * r[1] + n[5] * r[2];
    const chasles_vector over = 1.0 / (x * x + y * y + DBL_MIN);
    const chasles_vector cosine = (x * x - y * y) * over, sine = 2.0 * x * y * over;
    c[0] = c0 * cosine - s0 * sine;
    s[0] = c0 * sine + s0 * cosine;
    if (slides) {
        const chasles_vector_mask is_there = chasles_vector_sizes(r[0]) > zero;
        c[1] = chasles_vector_chosen(is_there, r[1] / r[0], zero);
        s[1] = c[1] * c[1];
        return;
    }
    const chasles_vector sign = chasles_vector_signed(zero + 1.0, r[0]);
    chasles_general_unit(sign * r[1], sign * r[2], c + 1, s + 1);
}

/* Computes c and s of a joint of the pair from x and y: cosine and sine of the direction (x, y) for
 * a revolute joint, x and x^2 for a prismatic joint. */
CHASLES_INLINE void chasles_general_of_pair(int slides, chasles_vector x, chasles_vector y,
                                            chasles_vector *c, chasles_vector *s)
{
    if (slides)
        *c = x, *s = x * x;
    else
        chasles_general_unit(x, y, c, s);
}

/* Computes cosine and sine of the first two joints in the elimination order from the cosines and
 * sines of the next three joints. Returns the sum of the absolute residuals of the equations whose
 * pivots are zero. If both joints of the pair are prismatic, three products of unknowns are absent
 * from the equations. */
CHASLES_INLINE chasles_vector chasles_general_pair(const chasles_general_system *system,
                                                   chasles_vector *c, chasles_vector *s)
{
    const chasles_vector zero = {0.0}, one = zero + 1.0;
    const chasles_vector of_v[3] = {one, c[3], s[3]}, of_w[3] = {one, c[4], s[4]};
    chasles_vector y[8], left = zero;
    for (int i = 7; i >= 0; i--) {
        y[i] = zero;
        CHASLES_UNROLL
        for (int k = 0; k < 9; k++) {
            y[i] += of_v[k / 3] * of_w[k % 3] *
                    (system->head[0][i][k] + c[2] * system->head[1][i][k] +
                     s[2] * system->head[2][i][k]);
        }
        for (int k = i + 1; k < 8; k++)
            y[i] -= system->factor[i][k] * y[k];
        left += system->factor[i][i] != 0.0 ? zero : chasles_vector_sizes(y[i]);
        y[i] *= system->factor[i][i] != 0.0 ? 1.0 / system->factor[i][i] : 0.0;
    }
    chasles_general_of_pair(system->slides[0], y[2], y[5], c, s);
    chasles_general_of_pair(system->slides[1], y[0], y[1], c + 1, s + 1);
    return left;
}

/* Computes cosine and sine of the last joint in the elimination order. The product of all other
 * rotations maps the x axis to (cos q, -sin q, 0), where q is the angle of the last joint. */
CHASLES_INLINE void chasles_general_last(const chasles_general_system *system, chasles_vector *c,
                                         chasles_vector *s)
{
    const chasles_vector zero = {0.0};
    chasles_vector turned[3] = {zero + 1.0, zero, zero}, moved[3];
    for (int k = 4; k >= -1; k--) {
        const double *C = system->loop[k >= 0 ? k : 5];
        for (int i = 0; i < 3; i++)
            moved[i] = C[4 * i] * turned[0] + C[4 * i + 1] * turned[1] + C[4 * i + 2] * turned[2];
        const int turns = k >= 0 && !system->slides[k];
        turned[0] = turns ? c[k] * moved[0] - s[k] * moved[1] : moved[0];
        turned[1] = turns ? s[k] * moved[0] + c[k] * moved[1] : moved[1];
        turned[2] = moved[2];
    }
    c[5] = turned[0], s[5] = -turned[1];
}

/* Computes all joints of up to CHASLES_VECTOR_LANES start configurations from the null vectors of
 * their matrices. */
static void chasles_general_all(const chasles_general_six *six, const chasles_general_order *order,
                                const chasles_general_system *system, chasles_general_start *starts,
                                int count)
{
    double rows[8][CHASLES_VECTOR_LANES];
    chasles_vector given[8], c[6], s[6], two_c[2], two_s[2];
    for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
        const chasles_general_start *start = starts + (l < count ? l : 0);
        for (int k = 0; k < 6; k++)
            rows[k][l] = start->n[k];
        rows[6][l] = start->c, rows[7][l] = start->s;
    }
    memcpy(given, rows, sizeof given);
    const int half = order->halved;
    chasles_general_two(given, system->slides[half ? 3 : 4], two_c, two_s);
    c[2] = given[6], c[3] = two_c[half], c[4] = two_c[1 - half];
    s[2] = given[7], s[3] = two_s[half], s[4] = two_s[1 - half];
    const chasles_vector left = chasles_general_pair(system, c, s);
    chasles_general_last(system, c, s);
    for (int l = 0; l < count; l++)
        starts[l].left = CHASLES_LANE(left, l);
    for (int k = 0; k < 6; k++) {
        const int joint = order->joint[k];
        const double sign = order->sense * chasles_general_direction(six, joint);
        const chasles_vector value =
            sign * (system->slides[k] ? c[k] : chasles_general_angles(s[k], c[k]));
        for (int l = 0; l < count; l++)
            starts[l].q[joint] = CHASLES_LANE(value, l);
    }
}

/* Computes the singular vectors of the two smallest singular values of a triangular matrix, by
 * inverse iteration of both vectors. */
static void chasles_general_plane(const double (*R)[6], double (*n)[6])
{
    for (int k = 0; k < 6; k++)
        n[0][k] = 1.0, n[1][k] = k % 2 ? -1.0 : 1.0;
    for (int step = 0; step < 3; step++) {
        for (int v = 0; v < 2; v++) {
            double *x = n[v], along = 0.0, size = 0.0;
            for (int j = 0; j < 6; j++) {
                for (int i = 0; i < j; i++)
                    x[j] -= R[j][i] * x[i];
                x[j] /= R[j][j];
            }
            for (int j = 5; j >= 0; j--) {
                x[j] /= R[j][j];
                for (int i = 0; i < j; i++)
                    x[i] -= R[j][i] * x[j];
            }
            for (int pass = 0; pass < 2; pass++) {
                along = size = 0.0;
                for (int k = 0; k < 6; k++)
                    along += v * n[0][k] * x[k];
                for (int k = 0; k < 6; k++)
                    x[k] -= along * n[0][k] * v;
                for (int k = 0; k < 6; k++)
                    size += x[k] * x[k];
                size = sqrt(size);
                for (int k = 0; k < 6; k++)
                    x[k] /= size;
            }
        }
    }
}

/* Finds two 2 x 3 matrices of rank 1 in the span of the matrices a and b, which are stored row by
 * row. The outer product of (sin, cos) of one angle and (1, cos, sin) of another angle has rank 1.
 * Returns 0 if no real linear combination of the matrices a and b has rank 1. */
static int chasles_general_products(const double (*n)[6], double (*product)[6])
{
    const double *a = n[0], *b = n[1];
    double cross[3][3], size[3] = {0.0}, of[3] = {0.0};
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        cross[0][k] = a[i] * a[3 + j] - a[j] * a[3 + i];
        cross[1][k] = a[i] * b[3 + j] - a[j] * b[3 + i] + b[i] * a[3 + j] - b[j] * a[3 + i];
        cross[2][k] = b[i] * b[3 + j] - b[j] * b[3 + i];
    }
    int most = 0;
    for (int v = 0; v < 3; v++) {
        for (int k = 0; k < 3; k++)
            size[v] += cross[v][k] * cross[v][k];
        most = size[v] > size[most] ? v : most;
    }
    for (int v = 0; v < 3; v++) {
        for (int k = 0; k < 3; k++)
            of[v] += cross[v][k] * cross[most][k];
    }
    const double square = of[1] * of[1] - 4.0 * of[0] * of[2];
    if (!(square >= 0.0))
        return 0;
    const double sum = -0.5 * (of[1] + copysign(sqrt(square), of[1]));
    const double x[2] = {sum, of[0]}, y[2] = {of[2], sum};
    for (int v = 0; v < 2; v++) {
        for (int k = 0; k < 6; k++)
            product[v][k] = y[v] * a[k] + x[v] * b[k];
    }
    return 1;
}

/* Computes one triangular matrix per SIMD lane. Each triangular matrix is singular, because it is
 * evaluated at a root of the determinant. */
static void chasles_general_triangles(const chasles_general_system *system,
                                      const chasles_general_start *const *starts, int count,
                                      chasles_vector (*R)[6])
{
    double cosine[CHASLES_VECTOR_LANES], sine[CHASLES_VECTOR_LANES];
    chasles_vector c, s, value;
    for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
        cosine[l] = starts[l < count ? l : 0]->c;
        sine[l] = starts[l < count ? l : 0]->s;
    }
    memcpy(&c, cosine, sizeof c);
    memcpy(&s, sine, sizeof s);
    chasles_general_factored(system, &c, &s, R, &value);
}

/* Returns whether the pivots of the matrix A are large enough to compute the pair of joints at the
 * given pose. Returns 1 if both joints of the pair are revolute. */
static int chasles_general_tells_pair(const chasles_general_system *system)
{
    double least = DBL_MAX, most = 0.0;
    if (!(system->slides[0] || system->slides[1]))
        return 1;
    for (int i = 0; i < 8; i++) {
        const double pivot = fabs(system->factor[i][i]);
        /* If both joints of the pair are prismatic, the equations contain no product of two sines,
         * and the pivot of this product is 0. */
        if (pivot == 0.0)
            continue;
        least = pivot < least ? pivot : least;
        most = pivot > most ? pivot : most;
    }
    return least > CHASLES_TELLS * most;
}

/* Isolates the real roots of the determinant. Returns whether it is certain that no root is hidden
 * by rounding. */
static int chasles_general_isolated(const chasles_general_system *system,
                                    chasles_circle_roots *roots)
{
    chasles_circle_series series;
    chasles_general_interpolated(system, &series);
    roots->count = 0;
    if (!(series.noise < CHASLES_NOISE * series.most))
        return 0;
    chasles_circle_real(chasles_general_sampled, system, &series, roots);
    const double rounding = CHASLES_CLEAN * series.most;
    return !roots->unresolved && chasles_general_tells_pair(system) &&
           (series.most > CHASLES_VANISHED || series.noise < rounding);
}

/* If both joints of the pair are prismatic, removes the start configurations (about half of them)
 * that do not solve all fourteen equations. Returns the number of start configurations that remain.
 */
static int chasles_general_kept(const chasles_general_system *system, chasles_general_start *starts,
                                int count)
{
    int kept = 0;
    if (!(system->slides[0] && system->slides[1]))
        return count;
    for (int k = 0; k < count; k++) {
        if (starts[k].has_twin || starts[k].left < CHASLES_SOLVES_ALL)
            starts[kept++] = starts[k];
    }
    return kept;
}

/* Computes start configurations for Newton's iteration, one per real root and one per nearly double
 * root. Returns the number of start configurations. The flag `certain` becomes 1 if no three roots
 * of the determinant are near each other, otherwise 0. */
static int chasles_general_starts(const chasles_general_six *six,
                                  const chasles_general_order *order,
                                  const chasles_general_system *system,
                                  const chasles_circle_roots *roots, chasles_general_start *starts,
                                  int *certain)
{
    double along[CHASLES_MAX_ROOTS], c[CHASLES_MAX_ROOTS], s[CHASLES_MAX_ROOTS];
    int count = 0;
    *certain = 1;
    for (int k = 0; k < roots->count; k++) {
        int near = 0, before = 0;
        for (int i = 0; i < roots->count; i++) {
            const double apart = fabs(chasles_circle_wrapped(roots->angle[i] - roots->angle[k]));
            near += i != k && apart < CHASLES_TWINS;
            before += i < k && apart < CHASLES_TWINS;
        }
        *certain = *certain && near < 2;
        if (near > 1 && before > 0)
            continue;
        along[count] = starts[count].along = roots->angle[k];
        starts[count].imaginary = roots->imaginary[k];
        starts[count++].has_twin = near > 0 || roots->imaginary[k] > 0.0;
    }
    chasles_cos_sin(count, along, c, s);
    for (int k = 0; k < count; k++)
        starts[k].c = c[k], starts[k].s = s[k];
    for (int k = 0; k < count; k += CHASLES_VECTOR_LANES) {
        const chasles_general_start *some[CHASLES_VECTOR_LANES];
        chasles_vector R[6][6], n[6];
        const int all = count - k < CHASLES_VECTOR_LANES ? count - k : CHASLES_VECTOR_LANES;
        for (int l = 0; l < all; l++)
            some[l] = starts + k + l;
        chasles_general_triangles(system, some, all, R);
        chasles_general_null(R, n);
        for (int i = 0; i < 6; i++) {
            for (int l = 0; l < all; l++)
                starts[k + l].n[i] = CHASLES_LANE(n[i], l);
        }
        chasles_general_all(six, order, system, starts + k, all);
    }
    return chasles_general_kept(system, starts, count);
}

/* For each root near another root, computes two start configurations, one from each null vector.
 * Returns the number of computed configurations. */
static int chasles_general_twins(const chasles_general_six *six, const chasles_general_order *order,
                                 const chasles_general_system *system,
                                 const chasles_general_start *starts, int count,
                                 chasles_general_start *twins)
{
    const chasles_general_start *some[CHASLES_VECTOR_LANES];
    chasles_vector R[6][6];
    int added = 0;
    for (int k = 0, all = 0; k < count; k++) {
        if (starts[k].has_twin)
            some[all++] = starts + k;
        if (all == 0 || (all < CHASLES_VECTOR_LANES && k < count - 1))
            continue;
        chasles_general_triangles(system, some, all, R);
        for (int l = 0; l < all; l++) {
            double triangle[6][6], plane[2][6], product[2][6];
            for (int j = 0; j < 6; j++) {
                for (int i = 0; i < 6; i++)
                    triangle[j][i] = CHASLES_LANE(R[j][i], l);
                triangle[j][j] += copysign(CHASLES_PIVOT_FLOOR, triangle[j][j]);
            }
            chasles_general_plane((const double(*)[6])triangle, plane);
            if (!chasles_general_products((const double(*)[6])plane, product))
                continue;
            for (int v = 0; v < 2; v++) {
                twins[added] = *some[l];
                twins[added].imaginary = 0.0;
                memcpy(twins[added++].n, product[v], sizeof product[v]);
            }
        }
        all = 0;
    }
    for (int k = 0; k < added; k += CHASLES_VECTOR_LANES) {
        const int all = added - k < CHASLES_VECTOR_LANES ? added - k : CHASLES_VECTOR_LANES;
        chasles_general_all(six, order, system, twins + k, all);
    }
    return added;
}

#endif
