/* The other joints at each root of the suppressed one; part of chasles, the same for every robot of
 * six revolute joints.
 */
#ifndef CHASLES_GENERAL_BACK_H
#define CHASLES_GENERAL_BACK_H

#include <math.h>
#include <string.h>

#include "chasles_general_newton.h"
#include "chasles_general_roots.h"

/* Angles of the two joints behind the suppressed one, from the vector that M takes to zero. */
static void chasles_general_two(const double *n, const chasles_general_split *split, double *angle)
{
    /* n is a product (sin, cos) x (1, cos, sin): its directions, from the larger row. */
    double size[2] = {0.0}, along = 0.0, r[3];
    for (int k = 0; k < 3; k++) {
        size[0] += n[k] * n[k];
        size[1] += n[3 + k] * n[3 + k];
        along += n[k] * n[3 + k];
    }
    const int row = size[1] > size[0];
    for (int k = 0; k < 3; k++)
        r[k] = row ? size[1] * n[3 + k] + along * n[k] : size[0] * n[k] + along * n[3 + k];
    const double s = n[0] * r[0] + n[1] * r[1] + n[2] * r[2];
    const double c = n[3] * r[0] + n[4] * r[1] + n[5] * r[2];
    const double sign = copysign(1.0, r[0]);
    angle[split->halved] = 2.0 * atan2(s, c) + CHASLES_HALF_FROM;
    angle[1 - split->halved] = atan2(sign * r[2], sign * r[1]);
}

/* cos and sin of the direction of (x, y); of the angle 0 where it has none. */
static void chasles_general_unit(double x, double y, double *c, double *s)
{
    const double size = sqrt(x * x + y * y);
    *c = size > 0.0 ? x / size : 1.0;
    *s = size > 0.0 ? y / size : 0.0;
}

/* All joints from those of one side of the equations. */
static void chasles_general_all(const chasles_general_six *six, const chasles_general_split *split,
                                const chasles_general_system *system, const double *local,
                                double *q)
{
    double c[5], s[5], x[9], y[8], angle[6];
    for (int k = 2; k < 5; k++) {
        angle[k] = local[k - 2];
        c[k] = cos(angle[k]), s[k] = sin(angle[k]);
    }
    const double of_v[3] = {1.0, c[3], s[3]}, of_w[3] = {1.0, c[4], s[4]};
    for (int k = 0; k < 9; k++)
        x[k] = of_v[k / 3] * of_w[k % 3];
    for (int i = 7; i >= 0; i--) {
        double sum = 0.0;
        for (int k = 0; k < 9; k++) {
            sum += x[k] * (system->head[0][i][k] + c[2] * system->head[1][i][k] +
                           s[2] * system->head[2][i][k]);
        }
        for (int k = i + 1; k < 8; k++)
            sum -= system->factor[i][k] * y[k];
        y[i] = system->factor[i][i] != 0.0 ? sum / system->factor[i][i] : 0.0;
    }
    chasles_general_unit(y[2], y[5], c, s);
    chasles_general_unit(y[0], y[1], c + 1, s + 1);
    angle[0] = atan2(s[0], c[0]), angle[1] = atan2(s[1], c[1]);
    /* The rest of the loop turns x by the last angle, backwards. */
    double turned[3] = {1.0, 0.0, 0.0};
    for (int k = 4; k >= -1; k--) {
        const double *C = system->loop[k >= 0 ? k : 5];
        double moved[3];
        for (int i = 0; i < 3; i++)
            moved[i] = C[4 * i] * turned[0] + C[4 * i + 1] * turned[1] + C[4 * i + 2] * turned[2];
        turned[0] = k >= 0 ? c[k] * moved[0] - s[k] * moved[1] : moved[0];
        turned[1] = k >= 0 ? s[k] * moved[0] + c[k] * moved[1] : moved[1];
        turned[2] = moved[2];
    }
    angle[5] = atan2(-turned[1], turned[0]);
    for (int k = 0; k < 6; k++) {
        const int joint = split->joint[k];
        q[joint] = chasles_circle_wrapped(split->sense * angle[k] *
                                          chasles_general_direction(six->arm, joint));
    }
}

/* Two vectors that a triangle takes nearest to zero, by inverse iteration on both. */
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

/* The two products (sin, cos) x (1, cos, sin) in a plane of vectors: of a + z b, rows are parallel.
 * Returns 0 where there are none. */
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
    /* z = x / y: the roots of of[2] z^2 + of[1] z + of[0]. */
    const double sum = -0.5 * (of[1] + copysign(sqrt(square), of[1]));
    const double x[2] = {sum, of[0]}, y[2] = {of[2], sum};
    for (int v = 0; v < 2; v++) {
        for (int k = 0; k < 6; k++)
            product[v][k] = y[v] * a[k] + x[v] * b[k];
    }
    return 1;
}

/* All joints at up to eight roots; returns how many starts were added behind the last, where two
 * roots are so near that both of their vectors are needed. */
static int chasles_general_eight(const chasles_general_six *six, const chasles_general_split *split,
                                 const chasles_general_system *system,
                                 chasles_general_start *starts, int count,
                                 chasles_general_start *last, int room)
{
    chasles_general_lanes R[6][6], n[6], c, s, value;
    int added = 0;
    for (int l = 0; l < CHASLES_LANES; l++) {
        const double angle = starts[l < count ? l : 0].along;
        c[l] = cos(angle), s[l] = sin(angle);
    }
    chasles_general_factored(system, &c, &s, R, &value);
    chasles_general_null(R, n);
    for (int l = 0; l < count; l++) {
        const double own[6] = {n[0][l], n[1][l], n[2][l], n[3][l], n[4][l], n[5][l]};
        double local[3];
        local[0] = starts[l].along;
        chasles_general_two(own, split, local + 1);
        chasles_general_all(six, split, system, local, starts[l].q);
        if (starts[l].twin && added + 2 <= room) {
            double triangle[6][6], plane[2][6], product[2][6];
            for (int j = 0; j < 6; j++) {
                for (int i = 0; i < 6; i++)
                    triangle[j][i] = R[j][i][l];
            }
            chasles_general_plane((const double(*)[6])triangle, plane);
            if (!chasles_general_products((const double(*)[6])plane, product))
                continue;
            for (int v = 0; v < 2; v++) {
                chasles_general_start *twin = last + added++;
                twin->along = local[0], twin->imaginary = 0.0, twin->twin = 2;
                chasles_general_two(product[v], split, local + 1);
                chasles_general_all(six, split, system, local, twin->q);
            }
        }
    }
    return added;
}

/* Starts for Newton's steps, one a real root, and one where two are about to meet; how many. Two
 * more for each of them that another one is near. Also whether no more of them may be hidden. */
static int chasles_general_starts(const chasles_general_six *six,
                                  const chasles_general_split *split, const double *T,
                                  chasles_general_start *starts, int *sure)
{
    chasles_general_system system;
    chasles_circle_series series;
    chasles_circle_roots roots;
    chasles_general_eliminate(six, split, T, &system);
    chasles_general_interpolated(&system, &series);
    *sure = 0;
    if (!(series.noise < CHASLES_NOISE * series.most))
        return 0;
    chasles_circle_real(chasles_general_sampled, &system, &series, &roots);
    *sure = !roots.unresolved && series.most > CHASLES_VANISHED;
    int real = 0;
    for (int k = 0; k < roots.count; k++) {
        int near = 0, before = 0;
        for (int i = 0; i < roots.count; i++) {
            const double apart = fabs(chasles_circle_wrapped(roots.angle[i] - roots.angle[k]));
            near += i != k && apart < CHASLES_TWINS;
            before += i < k && apart < CHASLES_TWINS;
        }
        *sure = *sure && near < 2;
        /* Where many are near each other, they are found from poses nearby. */
        if (near > 1 && before > 0)
            continue;
        starts[real].along = roots.angle[k];
        starts[real].imaginary = roots.imaginary[k];
        starts[real++].twin = near > 0 || roots.imaginary[k] > 0.0;
    }
    int count = real;
    for (int k = 0; k < real; k += CHASLES_LANES) {
        const int some = real - k < CHASLES_LANES ? real - k : CHASLES_LANES;
        count += chasles_general_eight(six, split, &system, starts + k, some, starts + count,
                                       CHASLES_MOST_STARTS - count);
    }
    return count;
}

#endif
