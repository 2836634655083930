/* Finds every assembly mode of a planar platform on three rods. This file is part of chasles and is
 * the same for every robot.
 *
 * The platform angles are real roots of a trigonometric polynomial of degree 3. */
#ifndef CHASLES_TRIAD_H
#define CHASLES_TRIAD_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_circle_roots.h"
#include "chasles_triad_tolerances.h"

#define CHASLES_TRIAD_MODES 6
#define CHASLES_TRIAD_DEGREE 3
/* Maximum number of Newton steps, which is large because each step only halves the error at a
 * double root. */
#define CHASLES_TRIAD_STEPS 30

typedef struct {
    void (*polynomial)(const double *q, double *coefficients);
    void (*position)(const double *q, const double *phi, double *x);
    void (*mirror)(const double *q, const double *phi, double *x);
    void (*rods)(const double *x, const double *q, double *excess);
    void (*rods_D_chain)(const double *x, const double *q, double *J);
    double size; /* size of the platform (meter) */
} chasles_triad_platform;

/* Position (meter) and angle (rad) of the platform in an assembly mode, and the margin of the mode.
 */
typedef struct {
    double x[3], margin;
} chasles_triad_mode;

/* Computes the cross products of the rows of the matrix J, and returns the determinant of J. */
static double chasles_triad_cofactors(const double *J, double (*C)[3])
{
    for (int i = 0; i < 3; i++) {
        const double *a = J + 3 * ((i + 1) % 3), *b = J + 3 * ((i + 2) % 3);
        C[i][0] = a[1] * b[2] - a[2] * b[1];
        C[i][1] = a[2] * b[0] - a[0] * b[2];
        C[i][2] = a[0] * b[1] - a[1] * b[0];
    }
    return J[0] * C[0][0] + J[1] * C[0][1] + J[2] * C[0][2];
}

/* Returns the largest rod length error, or infinity if an error is not finite. */
static double chasles_triad_excess(const chasles_triad_platform *platform, const double *q,
                                   const double *x, double *excess)
{
    double most = 0.0;
    platform->rods(x, q, excess);
    for (int i = 0; i < 3; i++) {
        const double error = fabs(excess[i]);
        most = !(error <= DBL_MAX) ? HUGE_VAL : error > most ? error : most;
    }
    return most;
}

/* Solves the rod length equations by Newton's iteration. Returns 0 if the iteration does not
 * converge to an assembly mode. */
static int chasles_triad_polished(const chasles_triad_platform *platform, const double *q,
                                  chasles_triad_mode *mode)
{
    double excess[3], J[9], C[3][3];
    double error = chasles_triad_excess(platform, q, mode->x, excess);
    for (int k = 0; k < CHASLES_TRIAD_STEPS; k++) {
        double next[3], step[3], next_excess[3], turn;
        if (!(error > CHASLES_TRIAD_POLISHED * platform->size && error <= DBL_MAX))
            break;
        platform->rods_D_chain(mode->x, q, J);
        const double determinant = chasles_triad_cofactors(J, C);
        for (int i = 0; i < 3; i++) {
            step[i] = (C[0][i] * excess[0] + C[1][i] * excess[1] + C[2][i] * excess[2]);
            step[i] /= determinant;
        }
        turn = fabs(step[2]) > CHASLES_TRIAD_STEP ? CHASLES_TRIAD_STEP / fabs(step[2]) : 1.0;
        for (int i = 0; i < 3; i++)
            next[i] = mode->x[i] - turn * step[i];
        const double then = chasles_triad_excess(platform, q, next, next_excess);
        if (!(then < error) && error <= CHASLES_TRIAD_CLOSED * platform->size)
            break;
        error = then;
        memcpy(mode->x, next, sizeof next);
        memcpy(excess, next_excess, sizeof excess);
    }
    if (!(error <= CHASLES_TRIAD_CLOSED * platform->size))
        return 0;
    platform->rods_D_chain(mode->x, q, J);
    double rows = 1.0;
    for (int i = 0; i < 3; i++) {
        J[3 * i + 2] /= platform->size;
        const double *r = J + 3 * i;
        rows *= sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    }
    mode->margin = fabs(chasles_triad_cofactors(J, C)) / rows;
    mode->x[2] = chasles_circle_wrapped(mode->x[2]);
    return 1;
}

static int chasles_triad_same(const chasles_triad_platform *platform, const double *one,
                              const double *other)
{
    const double length = CHASLES_TRIAD_SAME * platform->size;
    return fabs(one[0] - other[0]) < length && fabs(one[1] - other[1]) < length &&
           fabs(chasles_circle_wrapped(one[2] - other[2])) < CHASLES_TRIAD_SAME;
}

/* Runs Newton's iteration from a start configuration. If the result is a new assembly mode, inserts
 * the mode into `modes`, which is sorted by the platform angle phi. Returns the number of assembly
 * modes. */
static int chasles_triad_added(const chasles_triad_platform *platform, const double *q,
                               const double *start, chasles_triad_mode *modes, int count)
{
    chasles_triad_mode mode;
    memcpy(mode.x, start, sizeof mode.x);
    if (count == CHASLES_TRIAD_MODES || !chasles_triad_polished(platform, q, &mode))
        return count;
    for (int k = 0; k < count; k++) {
        if (chasles_triad_same(platform, mode.x, modes[k].x))
            return count;
    }
    int at = count;
    for (; at > 0 && modes[at - 1].x[2] > mode.x[2]; at--)
        modes[at] = modes[at - 1];
    modes[at] = mode;
    return count + 1;
}

/* Computes the trigonometric polynomial in the platform angle. Returns 0 if a coefficient of the
 * polynomial is not finite. */
static int chasles_triad_series(const chasles_triad_platform *platform, const double *q,
                                chasles_circle_series *series)
{
    double coefficients[2 * CHASLES_TRIAD_DEGREE + 1];
    memset(series, 0, sizeof *series);
    platform->polynomial(q, coefficients);
    series->a[0] = coefficients[0];
    for (int k = 0; k < 2 * CHASLES_TRIAD_DEGREE + 1; k++) {
        const double size = fabs(coefficients[k]);
        if (k > 0)
            (k % 2 ? series->a : series->b)[(k + 1) / 2] = coefficients[k];
        series->most = !(size <= DBL_MAX) ? HUGE_VAL : size > series->most ? size : series->most;
    }
    series->noise = CHASLES_TRIAD_NOISE * (1.0 + series->most);
    return series->most <= DBL_MAX;
}

/* Searches for assembly modes near a root of the polynomial, because rounding may hide other roots
 * near this root. */
static int chasles_triad_near(const chasles_triad_platform *platform, const double *q, double angle,
                              double apart, chasles_triad_mode *modes, int count)
{
    for (int k = -1; k <= 1; k++) {
        const double phi = angle + k * apart;
        double start[3];
        platform->position(q, &phi, start);
        count = chasles_triad_added(platform, q, start, modes, count);
        platform->mirror(q, &phi, start);
        count = chasles_triad_added(platform, q, start, modes, count);
    }
    return count;
}

/* Writes all assembly modes, sorted by the platform angle phi, and NaN to the unused entries.
 * Writes the margin of each assembly mode, and whether an assembly mode may be missing. */
static void chasles_triad_modes(const chasles_triad_platform *platform, const double *q,
                                double *theta, double *margin, double *unsure)
{
    chasles_circle_series series;
    chasles_circle_roots roots;
    chasles_triad_mode modes[CHASLES_TRIAD_MODES];
    int count = 0;
    roots.count = roots.unresolved = 0;
    const int finite = chasles_triad_series(platform, q, &series);
    const int vanishes = !(series.most > CHASLES_TRIAD_VANISHED);
    if (finite && !vanishes)
        chasles_circle_real(0, 0, &series, &roots);
    for (int k = 0; k < roots.count; k++) {
        double start[3], near = roots.imaginary[k];
        int paired = near > 0.0;
        for (int i = 0; i < roots.count; i++) {
            const double apart = fabs(chasles_circle_wrapped(roots.angle[i] - roots.angle[k]));
            paired = paired || (i != k && apart < CHASLES_TWINS);
            near = i != k && apart < CHASLES_TWINS && apart > near ? apart : near;
        }
        if (paired) {
            count = chasles_triad_near(platform, q, roots.angle[k], near, modes, count);
        } else {
            platform->position(q, roots.angle + k, start);
            count = chasles_triad_added(platform, q, start, modes, count);
        }
    }
    /* Rounding may hide other roots of the polynomial near the computed roots. */
    for (int k = 0; k < roots.count && roots.unresolved; k++) {
        for (double apart = CHASLES_TWINS; apart < CHASLES_TRIAD_SEARCHED; apart *= 2.0)
            count = chasles_triad_near(platform, q, roots.angle[k], apart, modes, count);
    }
    *unsure = !finite ? NAN : vanishes || roots.unresolved ? 1.0 : 0.0;
    for (int k = 0; k < CHASLES_TRIAD_MODES; k++) {
        margin[k] = k < count ? modes[k].margin : NAN;
        for (int i = 0; i < 3; i++)
            theta[3 * k + i] = k < count ? modes[k].x[i] : NAN;
    }
}

#endif
