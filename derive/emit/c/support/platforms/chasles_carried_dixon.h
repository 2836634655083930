/* Computes Dixon's resultant of three equations in three angles, or in two angles and a
 * displacement. The unknown joints are before the legs of a platform, or on the platform. This file
 * is part of chasles and is the same for every robot. */
#ifndef CHASLES_CARRIED_DIXON_H
#define CHASLES_CARRIED_DIXON_H

#include <math.h>

#include "chasles_carried_elimination.h"

/* Number of angles at which the Dixon determinant is sampled, and maximum number of steps of a root
 * search. */
#define CHASLES_ARM_CIRCLE 256
#define CHASLES_ARM_BISECTIONS 40
/* Number of samples of the slope of the Dixon determinant between two samples of the determinant
 * itself. */
#define CHASLES_ARM_PARTS 16
#define CHASLES_DIXON 8
/* Maximum degree of the Dixon determinant, which is a trigonometric polynomial. The degree of the
 * Dixon determinant is at most 16 if the unknown joints are all before the legs or all on the
 * platform. */
#define CHASLES_ARM_RESULTANT 24

/* Writes the Dixon matrix of three equations. The equations have degree 2 in x, the tangent of half
 * the inner angle, and degree 2 in y, the tangent of half the outer angle. */
static void chasles_arm_dixon(const chasles_arm_pair *pair, int is_slide,
                              double (*matrix)[CHASLES_DIXON])
{
    double g[3][3][3], N[3][5][5][3] = {{{{0.0}}}}, Q[2][5][4][3], R[2][4][4][2];
    for (int i = 0; i < 3; i++) {
        double half[3][3];
        for (int b = 0; b < 3; b++) {
            const double one = pair->at[i][0][b], first = pair->at[i][1][b];
            half[0][b] = is_slide ? one : one + first;
            half[1][b] = is_slide ? first : 2.0 * pair->at[i][2][b];
            half[2][b] = is_slide ? 0.0 : one - first;
        }
        for (int a = 0; a < 3; a++) {
            g[a][0][i] = half[a][0] + half[a][1];
            g[a][1][i] = 2.0 * half[a][2];
            g[a][2][i] = half[a][0] - half[a][1];
        }
    }
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            for (int c = 0; c < 3; c++)
                for (int d = 0; d < 3; d++) {
                    double normal[3];
                    if (a == c && b == d)
                        continue;
                    chasles_carried_cross(g[a][b], g[c][d], normal);
                    for (int e = 0; e < 3; e++)
                        for (int f = 0; f < 3; f++)
                            N[a][b + d][c + e][f] += chasles_carried_dot(normal, g[e][f]);
                }
    for (int y = 0; y < 5; y++)
        for (int u = 0; u < 4; u++)
            for (int v = 0; v < 3; v++) {
                Q[1][y][u][v] = N[2][y][u][v];
                Q[0][y][u][v] = N[1][y][u][v] + (u ? N[2][y][u - 1][v] : 0.0);
            }
    for (int x = 0; x < 2; x++)
        for (int y = 3; y >= 0; y--)
            for (int u = 0; u < 4; u++)
                for (int v = 0; v < 2; v++) {
                    R[x][y][u][v] = Q[x][y + 1][u][v];
                    if (y < 3 && v)
                        R[x][y][u][v] += R[x][y + 1][u][0];
                    matrix[4 * x + y][2 * u + v] = R[x][y][u][v];
                }
}

/* Returns the Dixon determinant at a value of the third angle. Writes the product of the Euclidean
 * norms of the matrix rows to `bound`. */
static double chasles_arm_determinant(const chasles_arm_equations *equations, double angle,
                                      double *bound)
{
    const int slides = equations->arm->slides, size = slides ? CHASLES_DIXON / 2 : CHASLES_DIXON;
    double A[CHASLES_DIXON][CHASLES_DIXON], determinant = 1.0;
    chasles_arm_pair pair;
    chasles_arm_at(equations, angle, &pair);
    chasles_arm_dixon(&pair, slides, A);
    *bound = 1.0;
    for (int i = 0; i < size; i++) {
        double square = 0.0;
        for (int j = 0; j < size; j++)
            square += A[i][j] * A[i][j];
        *bound *= sqrt(square);
    }
    for (int j = 0; j < size; j++) {
        int pivot = j;
        for (int i = j + 1; i < size; i++)
            pivot = fabs(A[i][j]) > fabs(A[pivot][j]) ? i : pivot;
        if (!(fabs(A[pivot][j]) > 0.0))
            return 0.0;
        for (int k = j; pivot != j && k < size; k++) {
            const double value = A[j][k];
            A[j][k] = A[pivot][k];
            A[pivot][k] = value;
        }
        determinant *= pivot == j ? A[j][j] : -A[j][j];
        for (int i = j + 1; i < size; i++) {
            const double factor = A[i][j] / A[j][j];
            for (int k = j + 1; k < size; k++)
                A[i][k] -= factor * A[j][k];
        }
    }
    return determinant;
}

/* Returns a root of the determinant between the angles `low` and `high`, at which the determinant
 * has different signs. */
static double chasles_arm_root(const chasles_arm_equations *equations, double low, double at_low,
                               double high, double at_high)
{
    double bound;
    for (int k = 0; k < CHASLES_ARM_BISECTIONS && high - low > CHASLES_ROOT_FOUND; k++) {
        const double middle = (low * at_high - high * at_low) / (at_high - at_low);
        const double value = chasles_arm_determinant(equations, middle, &bound);
        if ((value < 0.0) == (at_low < 0.0)) {
            low = middle;
            at_low = value;
            at_high *= 0.5;
        } else {
            high = middle;
            at_high = value;
            at_low *= 0.5;
        }
    }
    return fabs(at_low) < fabs(at_high) ? low : high;
}

/* Solves for the first two unknown joints, given the value `angle` of the third unknown joint. */
static void chasles_arm_try(const chasles_arm_equations *equations, double angle,
                            chasles_arm_solutions *found)
{
    chasles_arm_pair pair;
    double x[CHASLES_ARM_UNKNOWN] = {0.0, 0.0, angle};
    chasles_arm_at(equations, angle, &pair);
    chasles_arm_pairs(equations, &pair, 0, x, found);
}

/* The derivative of the determinant, as a trigonometric polynomial. */
typedef struct {
    double a[CHASLES_ARM_RESULTANT + 1], b[CHASLES_ARM_RESULTANT + 1];
} chasles_arm_slopes;

/* Computes the derivative of the determinant as a trigonometric polynomial, from samples of the
 * determinant. */
static void chasles_arm_differentiate(const double *values, chasles_arm_slopes *slopes)
{
    double c[CHASLES_ARM_CIRCLE], s[CHASLES_ARM_CIRCLE];
    for (int k = 0; k < CHASLES_ARM_CIRCLE; k++) {
        c[k] = cos(k * (CHASLES_TURN / CHASLES_ARM_CIRCLE));
        s[k] = sin(k * (CHASLES_TURN / CHASLES_ARM_CIRCLE));
    }
    for (int m = 0; m <= CHASLES_ARM_RESULTANT; m++) {
        double even = 0.0, odd = 0.0;
        for (int k = 0; k < CHASLES_ARM_CIRCLE; k++) {
            even += values[k] * c[m * k % CHASLES_ARM_CIRCLE];
            odd += values[k] * s[m * k % CHASLES_ARM_CIRCLE];
        }
        slopes->a[m] = m * odd * (2.0 / CHASLES_ARM_CIRCLE);
        slopes->b[m] = -m * even * (2.0 / CHASLES_ARM_CIRCLE);
    }
}

static double chasles_arm_slope(const chasles_arm_slopes *slopes, double angle)
{
    const double c = cos(angle), s = sin(angle);
    double cosine = 1.0, sine = 0.0, sum = slopes->a[0];
    for (int m = 1; m <= CHASLES_ARM_RESULTANT; m++) {
        const double next = cosine * c - sine * s;
        sine = sine * c + cosine * s;
        cosine = next;
        sum += slopes->a[m] * cosine + slopes->b[m] * sine;
    }
    return sum;
}

/* Returns the angle between `low` and `high` at which the determinant has an extremum. The slopes
 * of the determinant at `low` and `high` must have different signs. */
static double chasles_arm_extremum(const chasles_arm_slopes *slopes, double low, double high)
{
    const int falls = chasles_arm_slope(slopes, low) < 0.0;
    for (int k = 0; k < CHASLES_ARM_BISECTIONS; k++) {
        const double middle = 0.5 * (low + high);
        if ((chasles_arm_slope(slopes, middle) < 0.0) == falls)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Tries the vertex and the two roots of a parabola that approximates the determinant near an
 * extremum. Two nearly equal real roots may exist there, although the computed determinant has no
 * root. */
static void chasles_arm_touch(const chasles_arm_equations *equations,
                              const chasles_arm_slopes *slopes, double vertex, double value,
                              double step, chasles_arm_solutions *found)
{
    const double h = 0.01 * step;
    const double bend =
        (chasles_arm_slope(slopes, vertex + h) - chasles_arm_slope(slopes, vertex - h)) / (2.0 * h);
    const double apart = bend != 0.0 ? sqrt(fabs(2.0 * value / bend)) : 0.0;
    for (int side = -1; side <= 1 && apart < step; side++)
        chasles_arm_try(equations, vertex + side * apart, found);
}

/* If the determinant has a zero in an interval of angles, solves for the other two unknown joints
 * at this zero. The determinant must be monotonic in the interval. */
static void chasles_arm_between(const chasles_arm_equations *equations, double low, double at_low,
                                double high, double at_high, chasles_arm_solutions *found)
{
    if ((at_low < 0.0) != (at_high < 0.0))
        chasles_arm_try(equations, chasles_arm_root(equations, low, at_low, high, at_high), found);
}

/* Finds all solutions if three angles, or one displacement and two angles, are unknown. */
static void chasles_arm_three(const chasles_arm_equations *equations, chasles_arm_solutions *found)
{
    double values[CHASLES_ARM_CIRCLE], most = 0.0, bounds = 0.0, bound;
    const double step = CHASLES_TURN / CHASLES_ARM_CIRCLE;
    chasles_arm_slopes slopes;
    for (int k = 0; k < CHASLES_ARM_CIRCLE; k++) {
        values[k] = chasles_arm_determinant(equations, k * step, &bound);
        most = fmax(most, fabs(values[k]));
        bounds = fmax(bounds, bound);
    }
    if (!(most > CHASLES_ARM_VANISHED * bounds)) {
        chasles_arm_try(equations, 0.0, found);
        return;
    }
    chasles_arm_differentiate(values, &slopes);
    double before = chasles_arm_slope(&slopes, 0.0);
    for (int k = 0; k < CHASLES_ARM_CIRCLE; k++) {
        double from = k * step, at_from = values[k];
        for (int part = 1; part <= CHASLES_ARM_PARTS; part++) {
            const double high = (k + (double)part / CHASLES_ARM_PARTS) * step;
            const double after = chasles_arm_slope(&slopes, high);
            if ((before < 0.0) != (after < 0.0)) {
                const double vertex =
                    chasles_arm_extremum(&slopes, high - step / CHASLES_ARM_PARTS, high);
                const double own = chasles_arm_determinant(equations, vertex, &bound);
                chasles_arm_between(equations, from, at_from, vertex, own, found);
                chasles_arm_touch(equations, &slopes, vertex, own, step, found);
                from = vertex;
                at_from = own;
            }
            before = after;
        }
        chasles_arm_between(equations, from, at_from, (k + 1) * step,
                            values[(k + 1) % CHASLES_ARM_CIRCLE], found);
    }
}

#endif
