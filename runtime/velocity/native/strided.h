/* Access to strided ufunc operands. */
#pragma once

#include <math.h>
#include <string.h>

#include <numpy/ndarraytypes.h>

#include "velocity/native/bounded_rates.h"

static inline double get(const char *at)
{
    double value;
    memcpy(&value, at, sizeof value);
    return value;
}

static inline void put(char *at, double value)
{
    memcpy(at, &value, sizeof value);
}

static inline int read_vector(double *to, const char *from, int n, npy_intp step)
{
    int finite = 1;
    for (int k = 0; k < n; k++) {
        to[k] = get(from + k * step);
        finite &= isfinite(to[k]) != 0;
    }
    return finite;
}

static inline void fill_vector(char *to, int n, npy_intp step, double value)
{
    for (int k = 0; k < n; k++) {
        put(to + k * step, value);
    }
}

/* Reads J (6, n), scaled by p->row and p->unit. Returns whether all entries are finite. */
static inline int read_jacobian(RateProblem *p, const char *from, npy_intp row_step,
                                npy_intp column_step)
{
    int finite = 1;
    for (int a = 0; a < TWIST; a++) {
        for (int k = 0; k < p->n; k++) {
            double value = get(from + a * row_step + k * column_step);
            finite &= isfinite(value) != 0;
            p->J[a * p->n + k] = p->row[a] * value * p->unit[k];
        }
    }
    return finite;
}

static inline void advance(char **args, const npy_intp *steps, int n_operands)
{
    for (int i = 0; i < n_operands; i++) {
        args[i] += steps[i];
    }
}
