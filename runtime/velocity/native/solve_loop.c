#include <fenv.h>

#include "numerics/_tolerances.h"
#include "velocity/native/rate_loops.h"
#include "velocity/native/strided.h"

/* Indices of the operands, then indices of the strides of array operands. */
enum { J, V, LOWER, UPPER, SECONDARY, UNIT, ROW, BORDER, RANK, N_INPUTS };
enum { RATES = N_INPUTS, REACHED, DAMPING, SMALLEST, DIRECTION, SCALE, LIMITED, N_OPERANDS };
enum { J_ROW, J_COLUMN, V_STEP, LOWER_STEP, UPPER_STEP, SECONDARY_STEP, UNIT_STEP, ROW_STEP };
enum { RATES_STEP = ROW_STEP + 1, REACHED_STEP, DIRECTION_STEP, LIMITED_STEP };

static void lock_joints(RateProblem *p)
{
    int n = p->n, free = 0;
    for (int k = 0; k < n; k++) {
        p->locked[k] = p->exact_lo[k] == 0 && p->exact_hi[k] == 0;
        free += !p->locked[k];
        for (int i = 0; i < TWIST && p->locked[k]; i++) {
            p->J[i * n + k] = 0;
        }
        p->z[k] = p->locked[k] ? 0 : p->z[k];
    }
    p->rank = p->rank < free ? p->rank : free;
}

/* Reads and scales the inputs. Returns 0 if an input is not finite; bounds may be infinite, but not
 * NaN. */
static int read_problem(RateProblem *p, char **args, const npy_intp *core)
{
    int n = p->n;
    int finite = read_vector(p->unit, args[UNIT], n, core[UNIT_STEP]);
    finite &= read_vector(p->row, args[ROW], TWIST, core[ROW_STEP]);
    finite &= read_jacobian(p, args[J], core[J_ROW], core[J_COLUMN]);
    finite &= read_vector(p->V, args[V], TWIST, core[V_STEP]);
    finite &= read_vector(p->z, args[SECONDARY], n, core[SECONDARY_STEP]);
    read_vector(p->exact_lo, args[LOWER], n, core[LOWER_STEP]);
    read_vector(p->exact_hi, args[UPPER], n, core[UPPER_STEP]);
    for (int k = 0; k < n; k++) {
        finite &= !isnan(p->exact_lo[k]) & !isnan(p->exact_hi[k]);
        p->lo[k] = p->exact_lo[k] / p->unit[k];
        p->hi[k] = p->exact_hi[k] / p->unit[k];
        p->z[k] /= p->unit[k];
    }
    for (int i = 0; i < TWIST; i++) {
        p->V[i] *= p->row[i];
    }
    npy_intp rank;
    memcpy(&rank, args[RANK], sizeof rank);
    p->rank = (int)rank;
    p->border = get(args[BORDER]);
    lock_joints(p);
    return finite;
}

/* Writes the smallest singular value, the squared damping lambda^2, and the twist. The largest
 * entry of the dimensionless twist is positive. */
static void write_smallest(const RateProblem *p, char **args, const npy_intp *core)
{
    const double *u = p->svd.u[p->rank - 1];
    double sigma = p->svd.sigma[p->rank - 1], border = p->border, sign = 0, largest = 0;
    for (int i = 0; i < TWIST; i++) {
        if (fabs(u[i]) > largest + DIRECTION_TIE) {
            largest = fabs(u[i]), sign = u[i] < 0 ? -1 : 1;
        }
    }
    for (int i = 0; i < TWIST; i++) {
        double value = p->row[i] > 0 ? sign * u[i] / p->row[i] : 0;
        put(args[DIRECTION] + i * core[DIRECTION_STEP], value);
    }
    put(args[DAMPING], sigma < border ? (border - sigma) * (border + sigma) : 0);
    put(args[SMALLEST], sigma);
}

static void write_rates(RateProblem *p, char **args, const npy_intp *core)
{
    int n = p->n;
    for (int k = 0; k < n; k++) {
        double rate = clamp(p->y[k] * p->unit[k], p->exact_lo[k], p->exact_hi[k]);
        p->y[k] = p->locked[k] ? 0 : rate;
        put(args[RATES] + k * core[RATES_STEP], p->y[k]);
        args[LIMITED][k * core[LIMITED_STEP]] = p->limited[k] || p->locked[k];
    }
    for (int i = 0; i < TWIST; i++) {
        double sum = 0;
        for (int k = 0; k < n; k++) {
            sum += get(args[J] + i * core[J_ROW] + k * core[J_COLUMN]) * p->y[k];
        }
        put(args[REACHED] + i * core[REACHED_STEP], sum);
    }
}

/* Writes NaN, or 0 if all joints are locked, to all results of a row. */
static void write_everywhere(double value, int limited, int n, char **args, const npy_intp *core)
{
    fill_vector(args[RATES], n, core[RATES_STEP], value);
    fill_vector(args[REACHED], TWIST, core[REACHED_STEP], value);
    fill_vector(args[DIRECTION], TWIST, core[DIRECTION_STEP], value);
    put(args[DAMPING], value);
    put(args[SMALLEST], value);
    put(args[SCALE], value);
    for (int k = 0; k < n; k++) {
        args[LIMITED][k * core[LIMITED_STEP]] = (char)limited;
    }
}

void solve_loop(char **arguments, const npy_intp *dimensions, const npy_intp *steps,
                void *Py_UNUSED(data))
{
    RateProblem p;
    const npy_intp *core = steps + N_OPERANDS;
    char *args[N_OPERANDS];
    memcpy(args, arguments, sizeof args);
    if (rate_problem_new(&p, (int)dimensions[2]) < 0) {
        NPY_ALLOW_C_API_DEF
        NPY_ALLOW_C_API;
        PyErr_NoMemory();
        NPY_DISABLE_C_API;
        return;
    }
    for (npy_intp row = 0; row < dimensions[0]; row++, advance(args, steps, N_OPERANDS)) {
        if (!read_problem(&p, args, core)) {
            write_everywhere(NAN, 0, p.n, args, core);
            continue;
        }
        if (p.rank == 0) {
            write_everywhere(0, 1, p.n, args, core);
            continue;
        }
        memcpy(p.fixed, p.locked, p.n);
        svd_decompose(&p.svd, p.J, p.fixed);
        write_smallest(&p, args, core);
        put(args[SCALE], solve_within_bounds(&p));
        add_null_motion(&p);
        write_rates(&p, args, core);
    }
    rate_problem_free(&p);
    feclearexcept(FE_ALL_EXCEPT);
}
