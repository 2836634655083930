/* The real roots of det M, a trigonometric polynomial of degree 8 in the suppressed angle; part of
 * chasles, the same for every robot of six revolute joints.
 *
 * It is known from 24 samples; what is left of degrees above 8 tells its errors.
 */
#ifndef CHASLES_GENERAL_ROOTS_H
#define CHASLES_GENERAL_ROOTS_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_general_determinant.h"

#define CHASLES_SAMPLES 24
<<<<<<< HEAD
#define CHASLES_MOST_STARTS (3 * CHASLES_MOST_ROOTS)
=======
#define CHASLES_HALF (CHASLES_SAMPLES / 2)
#define CHASLES_CELLS 96
#define CHASLES_DEGREE 8
/* Samples of a cell, at Chebyshev's nodes. */
#define CHASLES_NODES 12
#define CHASLES_MOST_ROOTS 32
/* Terms of a Taylor series; the first left out is 1e-14 of the greatest. */
#define CHASLES_TERMS 11
/* Parts of the circle to look at; a pose takes some fifty, one at which all is rounding far more.
 */
#define CHASLES_MOST_PARTS 400
/* Halvings of a cell, to 1e-6 rad, after which roots are one. */
#define CHASLES_HALVINGS 15
#define CHASLES_TURN 6.283185307179586476925286766559

/* cos(2 pi k / 96); the sine of an angle is the cosine of 72 more. */
/* clang-format off */
static const double chasles_general_cosine[CHASLES_CELLS + 72] = {
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

/* a[k] cos(k x) + b[k] sin(k x), its greatest coefficient, and the size of errors in it. */
typedef struct {
    double a[CHASLES_DEGREE + 1], b[CHASLES_DEGREE + 1];
    double most, noise;
} chasles_general_series;

typedef struct {
    int count;
    int unresolved;                   /* whether more roots may be there */
    int parts;                        /* looked at so far */
    double angle[CHASLES_MOST_ROOTS]; /* of the suppressed joint */
    double
        imaginary[CHASLES_MOST_ROOTS]; /* 0 for a root, else half the way between two that meet */
} chasles_general_roots;
>>>>>>> any-special

/* The polynomial from the determinant's samples. */
static void chasles_general_interpolated(const chasles_general_system *system,
                                         chasles_circle_series *series)
{
    const double *cosine = chasles_circle_cosine;
    double values[CHASLES_SAMPLES];
    chasles_general_lanes R[6][6], c, s, determinant;
    for (int from = 0; from < CHASLES_SAMPLES; from += CHASLES_LANES) {
        for (int l = 0; l < CHASLES_LANES; l++) {
            c[l] = cosine[4 * (from + l)];
            s[l] = cosine[4 * (from + l) + 72];
        }
        chasles_general_factored(system, &c, &s, R, &determinant);
        memcpy(values + from, &determinant, sizeof determinant);
    }
    series->most = series->noise = 0.0;
    double even[CHASLES_HALF + 1], odd[CHASLES_HALF + 1];
    for (int k = 0; k <= CHASLES_HALF; k++) {
        const double other = k % CHASLES_HALF ? values[CHASLES_SAMPLES - k] : 0.0;
        even[k] = values[k] + other;
        odd[k] = values[k] - other;
    }
    CHASLES_UNROLL
    for (int m = 0; m <= CHASLES_HALF; m++) {
        double a = 0.0, b = 0.0;
        CHASLES_UNROLL
        for (int k = 0; k <= CHASLES_HALF; k++) {
            a += even[k] * cosine[4 * k * m % CHASLES_CELLS];
            b += odd[k] * cosine[4 * k * m % CHASLES_CELLS + 72];
        }
        a *= 2.0 / CHASLES_SAMPLES, b *= 2.0 / CHASLES_SAMPLES;
        const double size = fabs(a) > fabs(b) ? fabs(a) : fabs(b);
        if (m > CHASLES_DEGREE) {
            series->noise = size > series->noise ? size : series->noise;
        } else {
            series->a[m] = m == 0 ? 0.5 * a : a, series->b[m] = b;
            series->most = size > series->most ? size : series->most;
        }
    }
    series->noise += DBL_EPSILON * series->most;
}

<<<<<<< HEAD
=======
/* The Taylor series of a polynomial at the angles of these cosines and sines, in parts of a
 * radius: weight[k][m] is (m radius)^k / k! with the sign of the derivative. */
CHASLES_INLINE void chasles_general_taylor(const chasles_general_series *series,
                                           const double (*weight)[CHASLES_DEGREE + 1],
                                           const double *c, const double *s,
                                           chasles_general_lanes *t)
{
    chasles_general_lanes c1, s1, cosine, sine = {0.0};
    memcpy(&c1, c, sizeof c1);
    memcpy(&s1, s, sizeof s1);
    cosine = sine + 1.0;
    t[0] = sine + series->a[0];
    for (int k = 1; k < CHASLES_TERMS; k++)
        t[k] = sine;
    for (int m = 1; m <= CHASLES_DEGREE; m++) {
        const chasles_general_lanes next = cosine * c1 - sine * s1;
        sine = sine * c1 + cosine * s1;
        cosine = next;
        const chasles_general_lanes even = series->a[m] * cosine + series->b[m] * sine;
        const chasles_general_lanes odd = series->b[m] * cosine - series->a[m] * sine;
        CHASLES_UNROLL
        for (int k = 0; k < CHASLES_TERMS; k++)
            t[k] += weight[k][m] * (k % 2 ? odd : even);
    }
}

/* A Taylor series of which a part |z| <= 1 is looked at. */
typedef struct {
    double from, radius; /* rad: of the part, on the circle */
    double noise;
    double t[CHASLES_TERMS];
} chasles_general_part;

static void chasles_general_add(chasles_general_roots *roots, double angle, double imaginary)
{
    if (roots->count < CHASLES_MOST_ROOTS) {
        roots->angle[roots->count] = angle;
        roots->imaginary[roots->count++] = imaginary;
    } else {
        roots->unresolved = 1;
    }
}

/* A root that is known no better than this (rad) may be several. */
static void chasles_general_doubt(chasles_general_roots *roots, double error)
{
    roots->unresolved = roots->unresolved || !(error < CHASLES_DOUBT);
}

/* Half of a part: side is -1 or 1. */
static void chasles_general_half(const chasles_general_part *whole, double side,
                                 chasles_general_part *half)
{
    double power = 1.0;
    *half = *whole;
    half->radius = 0.5 * whole->radius;
    half->from = whole->from + side * half->radius;
    for (int i = 0; i < CHASLES_TERMS; i++) {
        for (int k = CHASLES_TERMS - 2; k >= i; k--)
            half->t[k] += 0.5 * side * half->t[k + 1];
    }
    for (int k = 0; k < CHASLES_TERMS; k++) {
        half->t[k] *= power;
        power *= 0.5;
    }
}

/* The series and its derivative at z. */
static double chasles_general_at(const double *t, double z, double *slope)
{
    double value = t[CHASLES_TERMS - 1], rate = 0.0;
    for (int k = CHASLES_TERMS - 2; k >= 0; k--) {
        rate = rate * z + value;
        value = value * z + t[k];
    }
    *slope = rate;
    return value;
}

/* The zero of a series between two places at which its signs differ, by Newton's steps. */
static double chasles_general_zero(const double *t, double low, double high)
{
    double slope;
    const int below = chasles_general_at(t, low, &slope) < 0.0;
    double z = 0.5 * (low + high);
    for (int k = 0; k < CHASLES_STEPS; k++) {
        const double value = chasles_general_at(t, z, &slope);
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

/* The root of a part in which the series is monotonous, if there is one. */
static void chasles_general_monotonous(const chasles_general_part *part, double low, double high,
                                       chasles_general_roots *roots)
{
    double slope;
    const double at_low = chasles_general_at(part->t, low, &slope);
    const double at_high = chasles_general_at(part->t, high, &slope);
    if ((at_low < 0.0) != (at_high < 0.0)) {
        const double z = chasles_general_zero(part->t, low, high);
        chasles_general_at(part->t, z, &slope);
        chasles_general_add(roots, part->from + part->radius * z, 0.0);
        chasles_general_doubt(roots, part->radius * CHASLES_UNSURE * part->noise / fabs(slope));
    }
}

/* The roots of a part in which the series has one extremum at most. */
static void chasles_general_convex(const chasles_general_part *part, chasles_general_roots *roots)
{
    double t[CHASLES_TERMS] = {0.0}, slope, low, high;
    chasles_general_at(part->t, -1.0, &low);
    chasles_general_at(part->t, 1.0, &high);
    if ((low < 0.0) == (high < 0.0)) {
        chasles_general_monotonous(part, -1.0, 1.0, roots);
        return;
    }
    for (int k = 1; k < CHASLES_TERMS; k++)
        t[k - 1] = k * part->t[k];
    const double z = chasles_general_zero(t, -1.0, 1.0);
    const double value = chasles_general_at(part->t, z, &slope);
    const double bend = chasles_general_at(t, 1.0, &slope) - chasles_general_at(t, -1.0, &slope);
    if (value * bend <= 0.0) {
        chasles_general_monotonous(part, -1.0, z, roots);
        chasles_general_monotonous(part, z, 1.0, roots);
        return;
    }
    const double over = 4.0 * part->radius * part->radius / (fabs(bend) + DBL_MIN);
    const double apart = sqrt(over * (fabs(value) + part->noise));
    const int unsure = fabs(value) < CHASLES_UNSURE * part->noise;
    if (unsure || apart < CHASLES_NEARLY_REAL)
        chasles_general_add(roots, part->from + part->radius * z, apart);
    if (unsure)
        chasles_general_doubt(roots, sqrt(over * part->noise));
}

/* The roots of a part. */
static void chasles_general_divided(const chasles_general_part *part, int halvings,
                                    chasles_general_roots *roots)
{
    /* No root, not even a complex one that is nearly real; no extremum; no change of curvature. */
    const double wide = 1.0 + CHASLES_NEARLY_REAL / part->radius;
    double value = 0.0, slope = part->noise, bend = part->noise, power = 1.0;
    for (int k = 1; k < CHASLES_TERMS; k++) {
        const double size = fabs(part->t[k]);
        power *= wide;
        value += size * power;
        slope += k > 1 ? k * size : 0.0;
        bend += k > 2 ? k * (k - 1) * size : 0.0;
    }
    if (fabs(part->t[0]) > value + part->noise)
        return;
    if (++roots->parts > CHASLES_MOST_PARTS) {
        roots->unresolved = 1;
        return;
    }
    if (value < part->noise || halvings == 0) {
        /* One of many places stands for all. */
        const int last = roots->count - 1;
        if (last < 0 || !(fabs(roots->angle[last] - part->from) < CHASLES_TWINS))
            chasles_general_add(roots, part->from, part->radius);
        roots->unresolved = 1;
    } else if (fabs(part->t[1]) > slope) {
        chasles_general_monotonous(part, -1.0, 1.0, roots);
    } else if (2.0 * fabs(part->t[2]) > bend) {
        chasles_general_convex(part, roots);
    } else {
        chasles_general_part half;
        chasles_general_half(part, -1.0, &half);
        chasles_general_divided(&half, halvings - 1, roots);
        chasles_general_half(part, 1.0, &half);
        chasles_general_divided(&half, halvings - 1, roots);
    }
}

>>>>>>> any-special
/* The same part from samples of the determinant in it: where it is small on a whole cell, several
 * roots being near, it is known there to more digits than from all around the circle. */
static void chasles_general_sampled(const void *source, chasles_circle_part *part)
{
<<<<<<< HEAD
    const chasles_general_system *system = (const chasles_general_system *)source;
    double values[2 * CHASLES_LANES], terms[CHASLES_TERMS][CHASLES_TERMS] = {{0.0}};
=======
    double values[CHASLES_NODES + CHASLES_LANES], terms[CHASLES_TERMS][CHASLES_TERMS] = {{0.0}};
>>>>>>> any-special
    chasles_general_lanes R[6][6], c, s, determinant;
    for (int from = 0; from < CHASLES_NODES; from += CHASLES_LANES) {
        for (int l = 0; l < CHASLES_LANES; l++) {
<<<<<<< HEAD
            const double z =
                chasles_circle_cosine[(4 * (CHASLES_LANES * from + l) + 2) % CHASLES_CELLS];
=======
            const double z = chasles_general_cosine[(4 * (from + l) + 2) % CHASLES_CELLS];
>>>>>>> any-special
            c[l] = cos(part->from + part->radius * z);
            s[l] = sin(part->from + part->radius * z);
        }
        chasles_general_factored(system, &c, &s, R, &determinant);
        memcpy(values + from, &determinant, sizeof determinant);
    }
    /* Chebyshev's polynomials; then powers of z. */
    memset(part->t, 0, sizeof part->t);
    terms[0][0] = terms[1][1] = 1.0;
    part->noise = 0.0;
    for (int k = 0; k < CHASLES_NODES; k++) {
        double sum = 0.0;
<<<<<<< HEAD
        for (int i = 0; i < 12; i++)
            sum += values[i] * chasles_circle_cosine[k * (4 * i + 2) % CHASLES_CELLS] /
=======
        for (int i = 0; i < CHASLES_NODES; i++)
            sum += values[i] * chasles_general_cosine[k * (4 * i + 2) % CHASLES_CELLS] /
>>>>>>> any-special
                   (k > 0 ? 6.0 : 12.0);
        if (k > CHASLES_TERMS - 3)
            part->noise += fabs(sum);
        for (int i = 0; k < CHASLES_TERMS && i <= k; i++) {
            if (k > 1)
                terms[k][i] = (i > 0 ? 2.0 * terms[k - 1][i - 1] : 0.0) - terms[k - 2][i];
            part->t[i] += sum * terms[k][i];
        }
    }
}

<<<<<<< HEAD
=======
/* The roots of a cell. */
static void chasles_general_cell(const chasles_general_system *system, double noise,
                                 chasles_general_part *part, chasles_general_roots *roots)
{
    double most = 0.0, slope;
    part->noise = noise;
    for (int k = 0; k < CHASLES_TERMS; k++)
        most += fabs(part->t[k]);
    if (most < CHASLES_BLURRED * noise)
        chasles_general_sampled(system, part);
    chasles_general_divided(part, CHASLES_HALVINGS, roots);
    /* Rounding may hide two roots on both sides of the end of a cell. */
    if (fabs(chasles_general_at(part->t, 1.0, &slope)) < CHASLES_UNSURE * part->noise)
        chasles_general_add(roots, part->from + part->radius, CHASLES_EDGE);
}

/* The real roots, and where two are about to meet. */
static void chasles_general_real(const chasles_general_system *system,
                                 const chasles_general_series *series, chasles_general_roots *roots)
{
    const double radius = 0.5 * CHASLES_TURN / CHASLES_CELLS;
    const double wide = 1.0 + CHASLES_NEARLY_REAL / radius;
    double weight[CHASLES_TERMS][CHASLES_DEGREE + 1];
    chasles_general_lanes t[CHASLES_TERMS];
    chasles_general_part part;
    CHASLES_UNROLL
    for (int m = 0; m <= CHASLES_DEGREE; m++) {
        weight[0][m] = 1.0;
        CHASLES_UNROLL
        for (int k = 1; k < CHASLES_TERMS; k++)
            weight[k][m] = weight[k - 1][m] * (k % 2 ? m : -m) * radius / k;
    }
    roots->count = roots->unresolved = roots->parts = 0;
    for (int from = 0; from < CHASLES_CELLS; from += CHASLES_LANES) {
        chasles_general_taylor(series, (const double(*)[CHASLES_DEGREE + 1]) weight,
                               chasles_general_cosine + from, chasles_general_cosine + from + 72,
                               t);
        chasles_general_lanes most = t[0] - t[0];
        CHASLES_UNROLL
        for (int k = CHASLES_TERMS - 1; k > 0; k--)
            most = wide * (most + chasles_general_sizes(t[k]));
        const chasles_general_lanes over =
            chasles_general_sizes(t[0]) - most - CHASLES_UNSURE * series->noise;
        for (int l = 0; l < CHASLES_LANES; l++) {
            if (over[l] > 0.0)
                continue;
            part.from = 2.0 * radius * (from + l);
            part.radius = radius;
            for (int k = 0; k < CHASLES_TERMS; k++)
                part.t[k] = t[k][l];
            chasles_general_cell(system, series->noise, &part, roots);
        }
    }
}

>>>>>>> any-special
#endif
