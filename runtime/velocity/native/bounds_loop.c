#include <fenv.h>
#include <math.h>

#include "numerics/_tolerances.h"
#include "velocity/native/rate_loops.h"
#include "velocity/native/strided.h"

#define ULPS                                                                                    \
    8 /* a rate is reduced by up to this number of units in the last place until it satisfies a \
         limit */

enum { Q, LOWER, UPPER, RATE, ACCELERATION, PREVIOUS, DT, MIN, GREATEST, N_OPERANDS };
enum { N_JOINT_INPUTS = DT, MIN_STEP = 6, GREATEST_STEP = 7 };

/* Returns the maximum rate from which a joint can brake before a limit at the distance `left`, with
 * the acceleration limit a. In k steps at v, v - a dt, v - 2 a dt ..., the joint covers k v dt - k
 * (k - 1) / 2 a dt^2. */
static double approach_rate(double left, double acceleration, double dt)
{
    if (!(left > 0)) {
        return 0;
    }
    if (isnan(dt) || isinf(left)) {
        return INFINITY;
    }
    double unit = acceleration * dt * dt;
    if (!(left > unit)) {
        return left / dt;
    }
    double ticks = fmax(ceil((sqrt(1 + 8 * left / unit) - 1) / 2), 1);
    return left / (ticks * dt) + acceleration * dt * (ticks - 1) / 2;
}

/* Lowers the rate with nextafter until the rounded q + sign * rate * dt is within the limit. */
static double round_before_limit(double q, double rate, double dt, double limit, double sign)
{
    for (int i = 0; i < ULPS && rate > 0 && isfinite(rate); i++) {
        volatile double distance = rate * dt, next = q + sign * distance;
        if (sign * (limit - next) >= 0) {
            return rate;
        }
        rate = nextafter(rate, 0);
    }
    return isfinite(rate) ? fmax(rate, 0) : rate;
}

/* Writes the minimum and maximum rate of one joint. If limits conflict, the acceleration limit has
 * priority over the rate limit, and the rate limit over the joint limit. A rate limit of 0 locks
 * the joint. */
static void bound_rate(const double *x, double dt, double *least, double *greatest)
{
    double q = x[Q], acceleration = x[ACCELERATION], previous = x[PREVIOUS];
    double change = acceleration * dt;
    double down = -approach_rate(q - x[LOWER], acceleration, dt);
    double up = approach_rate(x[UPPER] - q, acceleration, dt);
    if (!isnan(dt)) {
        down = -round_before_limit(q, -down, dt, x[LOWER], -1);
        up = round_before_limit(q, up, dt, x[UPPER], 1);
    }
    *least = -x[RATE];
    *greatest = x[RATE];
    if (isfinite(change)) {
        *least = clamp(*least, previous - change, previous + change);
        *greatest = clamp(*greatest, previous - change, previous + change);
    }
    double rounding = isnan(dt) ? 0 : BRAKING_ROUNDING * (fabs(q) / dt + fabs(previous));
    if (down > *greatest && down <= *greatest + rounding) {
        *greatest = down;
    }
    if (up < *least && up >= *least - rounding) {
        *least = up;
    }
    double from = *least, to = *greatest;
    int defined = !isnan(q) && !isnan(previous);
    if (x[RATE] == 0) {
        *least = *greatest = defined ? 0 : NAN;
        return;
    }
    *least = defined ? clamp(down, from, to) : NAN;
    *greatest = defined ? clamp(up, from, to) : NAN;
}

void bounds_loop(char **arguments, const npy_intp *dimensions, const npy_intp *steps,
                 void *Py_UNUSED(data))
{
    const npy_intp *core = steps + N_OPERANDS;
    char *args[N_OPERANDS];
    memcpy(args, arguments, sizeof args);
    for (npy_intp row = 0; row < dimensions[0]; row++, advance(args, steps, N_OPERANDS)) {
        for (npy_intp k = 0; k < dimensions[1]; k++) {
            double x[N_JOINT_INPUTS], least, greatest;
            for (int i = 0; i < N_JOINT_INPUTS; i++) {
                x[i] = get(args[i] + k * core[i]);
            }
            bound_rate(x, get(args[DT]), &least, &greatest);
            put(args[MIN] + k * core[MIN_STEP], least);
            put(args[GREATEST] + k * core[GREATEST_STEP], greatest);
        }
    }
    feclearexcept(FE_ALL_EXCEPT);
}
