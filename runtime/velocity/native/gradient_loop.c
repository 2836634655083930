#include <fenv.h>

#include "velocity/native/rate_loops.h"
#include "velocity/native/strided.h"

enum { J, H, UNIT, ROW, RANK, MEASURE, GRADIENT, N_OPERANDS };
enum { J_ROW, J_COLUMN, H_ROW, H_COLUMN, H_STEP, UNIT_STEP, ROW_STEP, GRADIENT_STEP };

/* Replaces p->J by the derivative of the measure w with respect to the entries of the unscaled
 * Jacobian. Returns w, the product of sigma[:rank]. Since d sigma = u^T dJ v, the derivative is the
 * sum over i of (product of sigma_j, j != i) u_i v_i^T. */
static double differentiate_measure(RateProblem *p, npy_intp rank)
{
    int n = p->n;
    const Svd *svd = &p->svd;
    double measure = 1;
    memset(p->J, 0, TWIST * n * sizeof(double));
    for (int i = 0; i < rank; i++) {
        double others = 1;
        measure *= svd->sigma[i];
        for (int j = 0; j < rank; j++) {
            others *= j == i ? 1 : svd->sigma[j];
        }
        for (int a = 0; a < TWIST; a++) {
            for (int k = 0; k < n; k++) {
                p->J[a * n + k] +=
                    others * p->row[a] * p->unit[k] * svd->u[i][a] * svd->v[i * n + k];
            }
        }
    }
    return measure;
}

void gradient_loop(char **arguments, const npy_intp *dimensions, const npy_intp *steps,
                   void *Py_UNUSED(data))
{
    RateProblem p;
    int n = (int)dimensions[2];
    const npy_intp *core = steps + N_OPERANDS;
    char *args[N_OPERANDS];
    memcpy(args, arguments, sizeof args);
    if (rate_problem_new(&p, n) < 0) {
        NPY_ALLOW_C_API_DEF
        NPY_ALLOW_C_API;
        PyErr_NoMemory();
        NPY_DISABLE_C_API;
        return;
    }
    for (npy_intp row = 0; row < dimensions[0]; row++, advance(args, steps, N_OPERANDS)) {
        npy_intp rank;
        memcpy(&rank, args[RANK], sizeof rank);
        read_vector(p.unit, args[UNIT], n, core[UNIT_STEP]);
        read_vector(p.row, args[ROW], TWIST, core[ROW_STEP]);
        if (!read_jacobian(&p, args[J], core[J_ROW], core[J_COLUMN])) {
            put(args[MEASURE], NAN);
            fill_vector(args[GRADIENT], n, core[GRADIENT_STEP], NAN);
            continue;
        }
        svd_decompose(&p.svd, p.J, p.fixed);
        put(args[MEASURE], differentiate_measure(&p, rank));
        memset(p.y, 0, n * sizeof(double));
        for (int a = 0; a < TWIST; a++) {
            for (int j = 0; j < n; j++) {
                const char *by_q = args[H] + a * core[H_ROW] + j * core[H_COLUMN];
                for (int k = 0; k < n; k++) {
                    p.y[k] += p.J[a * n + j] * get(by_q + k * core[H_STEP]);
                }
            }
        }
        for (int k = 0; k < n; k++) {
            put(args[GRADIENT] + k * core[GRADIENT_STEP], p.y[k]);
        }
    }
    rate_problem_free(&p);
    feclearexcept(FE_ALL_EXCEPT);
}
