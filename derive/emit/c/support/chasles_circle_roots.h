/* Finds the real roots of a trigonometric polynomial of degree at most 8. This file is part of
 * chasles and is the same for every robot.
 *
 * The search divides the circle into 96 cells. A cell is halved until its Taylor terms show that
 * the polynomial has no root in the cell, is monotonic or is convex. */
#ifndef CHASLES_CIRCLE_ROOTS_H
#define CHASLES_CIRCLE_ROOTS_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_circle_tolerances.h"
#include "chasles_vectors.h"

/* Maximum number of Newton steps per root. */
#define CHASLES_ROOT_STEPS 20
#define CHASLES_CELLS 96
#define CHASLES_DEGREE 8
#define CHASLES_MAX_ROOTS 32
/* Number of terms in a Taylor series. The first omitted term is 1e-14 of the largest term. */
#define CHASLES_TERMS 11
/* Maximum number of intervals that the root search examines. */
#define CHASLES_MAX_PARTS 400
/* Maximum number of halvings of a cell. The narrowest interval is 2e-6 rad wide. Roots closer than
 * the width of the narrowest interval count as one root. */
#define CHASLES_HALVINGS 15
#define CHASLES_TURN 6.283185307179586476925286766559

/* Table of cos(2 pi k / 96), whose entry k + 72 is sin(2 pi k / 96). */
/* clang-format off */
static const double chasles_circle_cosine[CHASLES_CELLS + 72] = {
    1.0, 0.9978589232386035, 0.9914448613738104, 0.9807852804032304, 0.9659258262890683,
    0.9469301294951057, 0.9238795325112867, 0.8968727415326884, 0.8660254037844387,
    0.8314696123025452, 0.7933533402912352, 0.7518398074789774, 0.7071067811865476,
    0.6593458151000688, 0.6087614290087207, 0.5555702330196024, 0.5, 0.44228869021900125,
    0.38268343236508984, 0.3214394653031617, 0.25881904510252074, 0.19509032201612833,
    0.1305261922200517, 0.06540312923014327, 0.0, -0.06540312923014327, -0.1305261922200517,
    -0.19509032201612833, -0.25881904510252074, -0.3214394653031617, -0.38268343236508984,
    -0.44228869021900125, -0.5, -0.5555702330196024, -0.6087614290087207, -0.6593458151000688,
    -0.7071067811865476, -0.7518398074789774, -0.7933533402912352, -0.8314696123025452,
    -0.8660254037844387, -0.8968727415326884, -0.9238795325112867, -0.9469301294951057,
    -0.9659258262890683, -0.9807852804032304, -0.9914448613738104, -0.9978589232386035, -1.0,
    -0.9978589232386035, -0.9914448613738104, -0.9807852804032304, -0.9659258262890683,
    -0.9469301294951057, -0.9238795325112867, -0.8968727415326884, -0.8660254037844387,
    -0.8314696123025452, -0.7933533402912352, -0.7518398074789774, -0.7071067811865476,
    -0.6593458151000688, -0.6087614290087207, -0.5555702330196024, -0.5, -0.44228869021900125,
    -0.38268343236508984, -0.3214394653031617, -0.25881904510252074, -0.19509032201612833,
    -0.1305261922200517, -0.06540312923014327, 0.0, 0.06540312923014327, 0.1305261922200517,
    0.19509032201612833, 0.25881904510252074, 0.3214394653031617, 0.38268343236508984,
    0.44228869021900125, 0.5, 0.5555702330196024, 0.6087614290087207, 0.6593458151000688,
    0.7071067811865476, 0.7518398074789774, 0.7933533402912352, 0.8314696123025452,
    0.8660254037844387, 0.8968727415326884, 0.9238795325112867, 0.9469301294951057,
    0.9659258262890683, 0.9807852804032304, 0.9914448613738104, 0.9978589232386035, 1.0,
    0.9978589232386035, 0.9914448613738104, 0.9807852804032304, 0.9659258262890683,
    0.9469301294951057, 0.9238795325112867, 0.8968727415326884, 0.8660254037844387,
    0.8314696123025452, 0.7933533402912352, 0.7518398074789774, 0.7071067811865476,
    0.6593458151000688, 0.6087614290087207, 0.5555702330196024, 0.5, 0.44228869021900125,
    0.38268343236508984, 0.3214394653031617, 0.25881904510252074, 0.19509032201612833,
    0.1305261922200517, 0.06540312923014327, 0.0, -0.06540312923014327, -0.1305261922200517,
    -0.19509032201612833, -0.25881904510252074, -0.3214394653031617, -0.38268343236508984,
    -0.44228869021900125, -0.5, -0.5555702330196024, -0.6087614290087207, -0.6593458151000688,
    -0.7071067811865476, -0.7518398074789774, -0.7933533402912352, -0.8314696123025452,
    -0.8660254037844387, -0.8968727415326884, -0.9238795325112867, -0.9469301294951057,
    -0.9659258262890683, -0.9807852804032304, -0.9914448613738104, -0.9978589232386035, -1.0,
    -0.9978589232386035, -0.9914448613738104, -0.9807852804032304, -0.9659258262890683,
    -0.9469301294951057, -0.9238795325112867, -0.8968727415326884, -0.8660254037844387,
    -0.8314696123025452, -0.7933533402912352, -0.7518398074789774, -0.7071067811865476,
    -0.6593458151000688, -0.6087614290087207, -0.5555702330196024, -0.5, -0.44228869021900125,
    -0.38268343236508984, -0.3214394653031617, -0.25881904510252074, -0.19509032201612833,
    -0.1305261922200517, -0.06540312923014327
};
/* clang-format on */

/* Pascal's triangle, with rows padded to full SIMD vectors. */
#define CHASLES_PADDED 16
static const double chasles_circle_pascal[CHASLES_TERMS][CHASLES_PADDED] = {
    {1.0},
    {1.0, 1.0},
    {1.0, 2.0, 1.0},
    {1.0, 3.0, 3.0, 1.0},
    {1.0, 4.0, 6.0, 4.0, 1.0},
    {1.0, 5.0, 10.0, 10.0, 5.0, 1.0},
    {1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0},
    {1.0, 7.0, 21.0, 35.0, 35.0, 21.0, 7.0, 1.0},
    {1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0},
    {1.0, 9.0, 36.0, 84.0, 126.0, 126.0, 84.0, 36.0, 9.0, 1.0},
    {1.0, 10.0, 45.0, 120.0, 210.0, 252.0, 210.0, 120.0, 45.0, 10.0, 1.0}};

/* Returns an angle reduced modulo 2 pi to the interval (-pi, pi]. */
static double chasles_circle_wrapped(double angle)
{
    const double wrapped = angle - CHASLES_TURN * floor(angle / CHASLES_TURN + 0.5);
    return wrapped <= -0.5 * CHASLES_TURN ? 0.5 * CHASLES_TURN : wrapped;
}

/* A trigonometric polynomial, the sum of a[k] cos(k x) + b[k] sin(k x), with its largest
 * coefficient and its error bound. */
typedef struct {
    double a[CHASLES_DEGREE + 1], b[CHASLES_DEGREE + 1];
    double most, noise;
} chasles_circle_series;

typedef struct {
    int count;
    int unresolved;                      /* whether the search may have missed or merged roots */
    int parts;                           /* number of examined intervals */
    double angle[CHASLES_MAX_ROOTS];     /* angle [rad] of each real root of the polynomial */
    double imaginary[CHASLES_MAX_ROOTS]; /* half of the distance between two close roots, or 0 */
} chasles_circle_roots;

/* Computes the Taylor series of a trigonometric polynomial about each of several angles x0. `c` and
 * `s` are the cosines and sines of the angles x0. The variable of each Taylor series is (x - x0) /
 * radius, where the radius is half the width of an interval. */
CHASLES_INLINE void chasles_circle_taylor(const chasles_circle_series *series, int degree,
                                          const double (*weight)[CHASLES_DEGREE + 1],
                                          const double *c, const double *s, chasles_vector *t)
{
    chasles_vector c1, s1, cosine, sine = {0.0};
    memcpy(&c1, c, sizeof c1);
    memcpy(&s1, s, sizeof s1);
    cosine = sine + 1.0;
    t[0] = sine + series->a[0];
    for (int k = 1; k < CHASLES_TERMS; k++)
        t[k] = sine;
    for (int m = 1; m <= degree; m++) {
        const chasles_vector next = cosine * c1 - sine * s1;
        sine = sine * c1 + cosine * s1;
        cosine = next;
        const chasles_vector even = series->a[m] * cosine + series->b[m] * sine;
        const chasles_vector odd = series->b[m] * cosine - series->a[m] * sine;
        CHASLES_UNROLL
        for (int k = 0; k < CHASLES_TERMS; k++)
            t[k] += weight[k][m] * (k % 2 ? odd : even);
    }
}

/* A Taylor series on the interval |z| <= 1. */
typedef struct {
    double from, radius; /* center and radius of the interval on the circle [rad] */
    double nearly;       /* largest imaginary part [rad] of a root that is tried as real */
    double noise;
    double t[CHASLES_TERMS];
} chasles_circle_part;

static void chasles_circle_add(chasles_circle_roots *roots, double angle, double imaginary)
{
    if (roots->count < CHASLES_MAX_ROOTS) {
        roots->angle[roots->count] = angle;
        roots->imaginary[roots->count++] = imaginary;
    } else {
        roots->unresolved = 1;
    }
}

/* Sets `unresolved` if the error [rad] of a computed root is too large to distinguish a single root
 * from several close roots. */
static void chasles_circle_doubt(chasles_circle_roots *roots, double error)
{
    roots->unresolved = roots->unresolved || !(error < CHASLES_DOUBT);
}

/* Computes the Taylor series on the lower half (`side` = -1) or the upper half (`side` = 1) of an
 * interval. The coefficients of the new series are half[i] = side^i sum_k binomial(k, i) (side /
 * 2)^k whole[k]. */
static void chasles_circle_half(const chasles_circle_part *whole, double side,
                                chasles_circle_part *half)
{
    double power = 1.0, terms[CHASLES_PADDED];
    chasles_vector sum[CHASLES_PADDED / CHASLES_VECTOR_LANES] = {CHASLES_ZERO}, row;
    for (int k = 0; k < CHASLES_TERMS; k++) {
        const double term = power * whole->t[k];
        CHASLES_UNROLL
        for (int b = 0; b < CHASLES_PADDED / CHASLES_VECTOR_LANES; b++) {
            memcpy(&row, chasles_circle_pascal[k] + CHASLES_VECTOR_LANES * b, sizeof row);
            sum[b] += term * row;
        }
        power *= 0.5 * side;
    }
    memcpy(terms, sum, sizeof terms);
    half->nearly = whole->nearly;
    half->noise = whole->noise;
    half->radius = 0.5 * whole->radius;
    half->from = whole->from + side * half->radius;
    for (int k = 0; k < CHASLES_TERMS; k++)
        half->t[k] = k % 2 ? side * terms[k] : terms[k];
}

/* Evaluates a Taylor series and its derivative at z. */
static double chasles_circle_at(const double *t, double z, double *slope)
{
    double value = t[CHASLES_TERMS - 1], rate = 0.0;
    for (int k = CHASLES_TERMS - 2; k >= 0; k--) {
        rate = rate * z + value;
        value = value * z + t[k];
    }
    *slope = rate;
    return value;
}

/* Finds the zero of a Taylor series by Newton's method. */
static double chasles_circle_zero(const double *t, double low, double high)
{
    double slope;
    const int below = chasles_circle_at(t, low, &slope) < 0.0;
    double z = 0.5 * (low + high);
    for (int k = 0; k < CHASLES_ROOT_STEPS; k++) {
        const double value = chasles_circle_at(t, z, &slope);
        if ((value < 0.0) == below) {
            low = z;
        } else {
            high = z;
        }
        double next = z - value / slope;
        if (!(next >= low && next <= high))
            next = 0.5 * (low + high);
        if (fabs(next - z) < CHASLES_ROOT_FOUND)
            return next;
        z = next;
    }
    return z;
}

/* Finds the root, if any, in an interval where the Taylor series is monotonic. */
static void chasles_circle_monotonous(const chasles_circle_part *part, double low, double high,
                                      chasles_circle_roots *roots)
{
    double slope;
    const double at_low = chasles_circle_at(part->t, low, &slope);
    const double at_high = chasles_circle_at(part->t, high, &slope);
    if ((at_low < 0.0) != (at_high < 0.0)) {
        const double z = chasles_circle_zero(part->t, low, high);
        chasles_circle_at(part->t, z, &slope);
        chasles_circle_add(roots, part->from + part->radius * z, 0.0);
        chasles_circle_doubt(roots, part->radius * CHASLES_UNSURE * part->noise / fabs(slope));
    }
}

/* Finds the roots in an interval where the Taylor series has at most one extremum. */
static void chasles_circle_convex(const chasles_circle_part *part, chasles_circle_roots *roots)
{
    double t[CHASLES_TERMS] = {0.0}, slope, low, high;
    chasles_circle_at(part->t, -1.0, &low);
    chasles_circle_at(part->t, 1.0, &high);
    if ((low < 0.0) == (high < 0.0)) {
        chasles_circle_monotonous(part, -1.0, 1.0, roots);
        return;
    }
    for (int k = 1; k < CHASLES_TERMS; k++)
        t[k - 1] = k * part->t[k];
    const double z = chasles_circle_zero(t, -1.0, 1.0);
    const double value = chasles_circle_at(part->t, z, &slope);
    const double bend = chasles_circle_at(t, 1.0, &slope) - chasles_circle_at(t, -1.0, &slope);
    if (value * bend <= 0.0) {
        chasles_circle_monotonous(part, -1.0, z, roots);
        chasles_circle_monotonous(part, z, 1.0, roots);
        return;
    }
    const double over = 4.0 * part->radius * part->radius / (fabs(bend) + DBL_MIN);
    const double apart = sqrt(over * (fabs(value) + part->noise));
    const int unsure = fabs(value) < CHASLES_UNSURE * part->noise;
    if (unsure || apart < part->nearly)
        chasles_circle_add(roots, part->from + part->radius * z, apart);
    if (unsure)
        chasles_circle_doubt(roots, sqrt(over * part->noise));
}

/* Finds the roots of a Taylor series in an interval. */
static void chasles_circle_divided(const chasles_circle_part *part, int halvings,
                                   chasles_circle_roots *roots)
{
    /* The bounds `value`, `slope` and `bend` show whether the interval can contain roots, extrema
     * and inflection points. */
    const double wide = 1.0 + part->nearly / part->radius;
    double change = 0.0, value = 0.0, slope = part->noise, bend = part->noise, power = 1.0;
    for (int k = 1; k < CHASLES_TERMS; k++) {
        const double size = fabs(part->t[k]);
        change += size;
        power *= wide;
        value += size * power;
        slope += k > 1 ? k * size : 0.0;
        bend += k > 2 ? k * (k - 1) * size : 0.0;
    }
    if (fabs(part->t[0]) > value + part->noise)
        return;
    if (++roots->parts > CHASLES_MAX_PARTS) {
        roots->unresolved = 1;
        return;
    }
    if (change < part->noise || halvings == 0) {
        /* Roots that cannot be separated are stored as a single root. */
        const int last = roots->count - 1;
        if (last < 0 || !(fabs(roots->angle[last] - part->from) < CHASLES_TWINS))
            chasles_circle_add(roots, part->from, part->radius);
        roots->unresolved = 1;
    } else if (fabs(part->t[1]) > slope) {
        chasles_circle_monotonous(part, -1.0, 1.0, roots);
    } else if (2.0 * fabs(part->t[2]) > bend) {
        chasles_circle_convex(part, roots);
    } else {
        chasles_circle_part half;
        chasles_circle_half(part, -1.0, &half);
        chasles_circle_divided(&half, halvings - 1, roots);
        chasles_circle_half(part, 1.0, &half);
        chasles_circle_divided(&half, halvings - 1, roots);
    }
}

/* Recomputes the Taylor series of an interval from new samples. */
typedef void (*chasles_circle_sampler)(const void *source, chasles_circle_part *part);

/* Finds the roots of the polynomial in one cell. */
static void chasles_circle_cell(chasles_circle_sampler sampler, const void *source, double noise,
                                chasles_circle_part *part, chasles_circle_roots *roots)
{
    double most = 0.0, slope;
    part->noise = noise;
    for (int k = 0; k < CHASLES_TERMS; k++)
        most += fabs(part->t[k]);
    if (sampler && most < CHASLES_BLURRED * noise)
        sampler(source, part);
    chasles_circle_divided(part, CHASLES_HALVINGS, roots);
    if (fabs(chasles_circle_at(part->t, 1.0, &slope)) < CHASLES_UNSURE * part->noise)
        chasles_circle_add(roots, part->from + part->radius, CHASLES_EDGE);
}

/* Finds the real roots of a trigonometric polynomial, and the angles where two roots nearly
 * coincide. If the function pointer `sampler` is NULL, no new samples of the polynomial are
 * computed. */
static void chasles_circle_real(chasles_circle_sampler sampler, const void *source,
                                const chasles_circle_series *series, chasles_circle_roots *roots)
{
    const double radius = 0.5 * CHASLES_TURN / CHASLES_CELLS;
    const double wide = 1.0 + CHASLES_NEARLY_REAL / radius;
    double weight[CHASLES_TERMS][CHASLES_DEGREE + 1];
    chasles_vector t[CHASLES_TERMS];
    chasles_circle_part part;
    CHASLES_UNROLL
    for (int m = 0; m <= CHASLES_DEGREE; m++) {
        weight[0][m] = 1.0;
        CHASLES_UNROLL
        for (int k = 1; k < CHASLES_TERMS; k++)
            weight[k][m] = weight[k - 1][m] * (k % 2 ? m : -m) * radius / k;
    }
    roots->count = roots->unresolved = roots->parts = 0;
    for (int from = 0; from < CHASLES_CELLS; from += CHASLES_VECTOR_LANES) {
        chasles_circle_taylor(series, CHASLES_DEGREE, (const double(*)[CHASLES_DEGREE + 1]) weight,
                              chasles_circle_cosine + from, chasles_circle_cosine + from + 72, t);
        chasles_vector most = t[0] - t[0];
        CHASLES_UNROLL
        for (int k = CHASLES_TERMS - 1; k > 0; k--)
            most = wide * (most + chasles_vector_sizes(t[k]));
        const chasles_vector over =
            chasles_vector_sizes(t[0]) - most - CHASLES_UNSURE * series->noise;
        for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
            if (CHASLES_LANE(over, l) > 0.0)
                continue;
            part.from = 2.0 * radius * (from + l);
            part.radius = radius;
            part.nearly = CHASLES_NEARLY_REAL;
            for (int k = 0; k < CHASLES_TERMS; k++)
                part.t[k] = CHASLES_LANE(t[k], l);
            chasles_circle_cell(sampler, source, series->noise, &part, roots);
        }
    }
}

#endif
