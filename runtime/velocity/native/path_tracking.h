/* Path tracking by joint rates: one damped step within all limits for each pose. */
#pragma once

#include <stddef.h>

#include "library/_kernel.h"
#include "velocity/native/damped_box.h"

/* Bits of Tracking.touched: the limits of a coordinate that are active in a step, and whether the
 * step is shortened. */
enum { RATE_TOUCHED = 1, LIMIT_TOUCHED = 2, SHORTENED = 4 };

typedef struct {
    const chasles_kernel *kernel; /* q -> T (4, 4), mixed Jacobian (6, n) */
    int n;
    ptrdiff_t m;
    const double *poses;                /* (m, 4, 4) */
    const double *lower, *upper, *rate; /* (n,) limits of q [rad or m] and of the rates */
    const double *unit;                 /* (n,) tool motion [m] per unit of q */
    double length, dt;                  /* m, s */
    double gain;                        /* fraction of the error that a step corrects */
    double *q, *qd, *error, *sigma;     /* (m, n), (m - 1, n), (m, 2), (m,): the results */
    unsigned char *touched;             /* (m - 1, n) bits that mark the active limits */
    DampedBox box;
    double *memory;
    double *J, *scaled;             /* (6, n) */
    double *low, *high, *step;      /* (n,) bounds of the scaled step; the step in coordinates */
    double T[POSE], missing[TWIST]; /* the pose, and the displacement to the path */
    double before,
        expected; /* squared error before a step, and the predicted squared error after the step */
} Tracking;

/* Allocates memory. Returns 0 on failure. */
int tracking_new(Tracking *t, double border, double damping);

void tracking_free(Tracking *t);

/* Takes the steps that start at the poses `first` to `last` - 1. All earlier steps must have been
 * taken. Returns 0 if a loop is open at the first row of q. */
int track_path(Tracking *t, ptrdiff_t first, ptrdiff_t last);
