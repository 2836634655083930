/* Tests whether the determinant has other real roots than the known roots. This file is part of
 * chasles and is the same for every robot.
 *
 * The number n of known roots must be even. The determinant, a trigonometric polynomial in s, is
 * divided by sin((s - r) / 2) for each known root r. With n known roots, the degree of the quotient
 * is n / 2 less than the degree of the determinant. */
#ifndef CHASLES_POLISH_DEFLATED_H
#define CHASLES_POLISH_DEFLATED_H

#include "chasles_cos_sin.h"
#include "chasles_general_roots.h"

/* Number of samples per full turn, and the minimum and maximum number of known roots for the test.
 */
#define CHASLES_FEW_SAMPLES 16
#define CHASLES_MIN_KNOWN 4
#define CHASLES_MAX_KNOWN 16
/* Minimum error [rad] of a known root that the test must detect. */
#define CHASLES_SHOWN 1e-4
/* Number of equal cells (angle intervals) into which a full turn is divided. */
#define CHASLES_WIDE_CELLS 48
/* Maximum number of successive bisections of a cell. A root whose imaginary part is below the width
 * of a bisected cell counts as real. */
#define CHASLES_WIDE_HALVINGS 9

/* Computes samples of the determinant at angles x, divided by sin((x - r) / 2) for every known root
 * r. Returns the largest absolute value of the determinant samples. */
static double chasles_polish_quotients(const chasles_general_system *system, const double *root,
                                       int count, double *quotient)
{
    const double *cosine = chasles_circle_cosine;
    const int apart = CHASLES_CELLS / CHASLES_FEW_SAMPLES;
    double half[CHASLES_MAX_KNOWN], of_cos[CHASLES_MAX_KNOWN], of_sin[CHASLES_MAX_KNOWN];
    double most = 0.0;
    for (int k = 0; k < count; k++)
        half[k] = 0.5 * root[k];
    chasles_cos_sin(count, half, of_cos, of_sin);
    for (int from = 0; from < CHASLES_FEW_SAMPLES; from += CHASLES_VECTOR_LANES) {
        chasles_vector R[6][6], c = {0}, s = {0}, half_c = {0}, half_s = {0}, determinant;
        for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
            const int at = apart * (from + l);
            CHASLES_LANE(c, l) = cosine[at], CHASLES_LANE(s, l) = cosine[(at + 72) % CHASLES_CELLS];
            CHASLES_LANE(half_c, l) = cosine[at / 2], CHASLES_LANE(half_s, l) = cosine[at / 2 + 72];
        }
        chasles_general_factored(system, &c, &s, R, &determinant);
        chasles_vector product = half_s * of_cos[0] - half_c * of_sin[0];
        for (int k = 1; k < count; k++)
            product *= half_s * of_cos[k] - half_c * of_sin[k];
        const chasles_vector value = determinant / product;
        for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
            most = fabs(CHASLES_LANE(determinant, l)) > most ? fabs(CHASLES_LANE(determinant, l))
                                                             : most;
            quotient[from + l] = CHASLES_LANE(value, l);
        }
    }
    return most;
}

/* Computes a trigonometric polynomial of the given degree from its samples. The coefficients above
 * the given degree serve as an estimate of the error. */
static void chasles_polish_interpolated(const double *value, int degree,
                                        chasles_circle_series *series)
{
    const int half = CHASLES_FEW_SAMPLES / 2, apart = CHASLES_CELLS / CHASLES_FEW_SAMPLES;
    const double part = 2.0 / CHASLES_FEW_SAMPLES;
    memset(series, 0, sizeof *series);
    for (int m = 0; m <= half; m++) {
        double a = 0.0, b = 0.0;
        for (int k = 0; k < CHASLES_FEW_SAMPLES; k++) {
            const int at = apart * k * m % CHASLES_CELLS;
            a += value[k] * chasles_circle_cosine[at];
            b += value[k] * chasles_circle_cosine[at + 72];
        }
        a *= part, b *= part;
        const double size = fabs(a) > fabs(b) ? fabs(a) : fabs(b);
        if (m > degree) {
            series->noise = size > series->noise ? size : series->noise;
        } else {
            series->a[m] = m == 0 ? 0.5 * a : a, series->b[m] = b;
            series->most = size > series->most ? size : series->most;
        }
    }
    series->noise += DBL_EPSILON * series->most;
}

/* Returns a bound for the truncation error of a polynomial's Taylor series within a radius. */
static double chasles_polish_left_out(const chasles_circle_series *series, int degree,
                                      double radius)
{
    double sum = 0.0;
    for (int m = 1; m <= degree; m++) {
        double term = fabs(series->a[m]) + fabs(series->b[m]);
        for (int k = 1; k <= CHASLES_TERMS; k++)
            term *= m * radius / k;
        sum += term;
    }
    return sum;
}

/* Result of a test with one elimination order: whether the known solutions are complete. */
typedef enum { CHASLES_UNCLEAR, CHASLES_COMPLETE, CHASLES_INCOMPLETE } chasles_polish_verdict;

/* Judges whether all solutions are known. All solutions are known if the quotient has no real or
 * nearly real root. */
static chasles_polish_verdict chasles_polish_judged(const chasles_circle_series *series, int degree)
{
    const double radius = 0.5 * CHASLES_TURN / CHASLES_WIDE_CELLS;
    const double wide = 1.0 + CHASLES_DOUBT / radius;
    const double noise =
        CHASLES_UNSURE * series->noise + chasles_polish_left_out(series, degree, radius);
    double weight[CHASLES_TERMS][CHASLES_DEGREE + 1], c[CHASLES_VECTOR_LANES],
        s[CHASLES_VECTOR_LANES];
    chasles_vector t[CHASLES_TERMS];
    CHASLES_UNROLL
    for (int m = 0; m <= CHASLES_DEGREE; m++) {
        weight[0][m] = 1.0;
        CHASLES_UNROLL
        for (int k = 1; k < CHASLES_TERMS; k++)
            weight[k][m] = weight[k - 1][m] * (k % 2 ? m : -m) * radius / k;
    }
    for (int from = 0; from < CHASLES_WIDE_CELLS; from += CHASLES_VECTOR_LANES) {
        for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
            c[l] = chasles_circle_cosine[2 * (from + l)];
            s[l] = chasles_circle_cosine[(2 * (from + l) + 72) % CHASLES_CELLS];
        }
        chasles_circle_taylor(series, degree, (const double(*)[CHASLES_DEGREE + 1]) weight, c, s,
                              t);
        chasles_vector most = t[0] - t[0];
        CHASLES_UNROLL
        for (int k = CHASLES_TERMS - 1; k > 0; k--)
            most = wide * (most + chasles_vector_sizes(t[k]));
        const chasles_vector over = chasles_vector_sizes(t[0]) - most - noise;
        for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
            chasles_circle_part part;
            chasles_circle_roots roots;
            if (CHASLES_LANE(over, l) > 0.0)
                continue;
            roots.count = roots.unresolved = roots.parts = 0;
            part.from = 2.0 * radius * (from + l), part.radius = radius, part.noise = noise;
            part.nearly = CHASLES_DOUBT;
            for (int k = 0; k < CHASLES_TERMS; k++)
                part.t[k] = CHASLES_LANE(t[k], l);
            chasles_circle_divided(&part, CHASLES_WIDE_HALVINGS, &roots);
            for (int k = 0; k < roots.count; k++) {
                if (!(roots.imaginary[k] > 0.0))
                    return CHASLES_INCOMPLETE;
            }
            if (roots.unresolved || roots.count > 0 || !(CHASLES_LANE(most, l) < DBL_MAX))
                return CHASLES_UNCLEAR;
        }
    }
    return CHASLES_COMPLETE;
}

/* Returns whether the completeness test applies to the known roots. */
static int chasles_polish_may_be_all(const double *root, int count)
{
    if (count % 2 || count < CHASLES_MIN_KNOWN || count > CHASLES_MAX_KNOWN)
        return 0;
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < i; k++) {
            if (fabs(chasles_circle_wrapped(root[k] - root[i])) < CHASLES_TWINS)
                return 0;
        }
    }
    return 1;
}

/* Returns whether the error estimate shows that the known roots are exact roots of the determinant.
 */
static int chasles_polish_shows_roots(const chasles_circle_series *series, int degree,
                                      const double *root, int count)
{
    double of_cos[CHASLES_MAX_KNOWN], of_sin[CHASLES_MAX_KNOWN];
    chasles_cos_sin(count, root, of_cos, of_sin);
    for (int k = 0; k < count; k++) {
        double c = 1.0, s = 0.0, value = series->a[0];
        for (int m = 1; m <= degree; m++) {
            const double next = c * of_cos[k] - s * of_sin[k];
            s = s * of_cos[k] + c * of_sin[k];
            c = next;
            value += series->a[m] * c + series->b[m] * s;
        }
        if (!(series->noise < CHASLES_SHOWN * fabs(value)))
            return 0;
    }
    return 1;
}

/* Tests whether the angles `root` are all the real roots of the determinant. Returns
 * CHASLES_UNCLEAR if the test is inconclusive. */
static chasles_polish_verdict chasles_polish_are_all(const chasles_general_system *system,
                                                     const double *root, int count)
{
    chasles_circle_series series;
    double quotient[CHASLES_FEW_SAMPLES];
    const int degree = CHASLES_DEGREE - count / 2;
    const double most = chasles_polish_quotients(system, root, count, quotient);
    chasles_polish_interpolated(quotient, degree, &series);
    if (!(series.noise < CHASLES_NOISE * series.most))
        return CHASLES_UNCLEAR;
    if (!(most > CHASLES_VANISHED || series.noise < CHASLES_CLEAN * series.most))
        return CHASLES_UNCLEAR;
    const chasles_polish_verdict verdict = chasles_polish_judged(&series, degree);
    if (verdict != CHASLES_COMPLETE || chasles_polish_shows_roots(&series, degree, root, count))
        return verdict;
    return CHASLES_UNCLEAR;
}

#endif
