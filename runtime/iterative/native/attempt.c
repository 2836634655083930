#include "iterative/native/attempt.h"

#include <math.h>
#include <string.h>

#include "iterative/native/evaluate.h"
#include "iterative/native/lm_step.h"
#include "numerics/_tolerances.h"

#define MAX_IDLE 2 /* maximum number of consecutive steps that hardly reduce the error */

static void take_trial(Workspace *work)
{
    double *q = work->q, *J = work->J;
    work->q = work->trial;
    work->J = work->trial_J;
    work->trial = q;
    work->trial_J = J;
}

Ending attempt(const Problem *problem, double least_gain, int *budget, Evaluation *now)
{
    Workspace *work = problem->work;
    double mu = LM_FIRST_MU;
    int idle = 0;
    *budget -= 1;
    if (!evaluate(problem, work->q, work->J, now)) {
        now->half_square = INFINITY;
        return STALLED;
    }
    while (!(now->residual <= problem->task->tolerance)) {
        int m = find_free(problem, now->e), better = 0;
        Ending least = now->residual <= problem->rounded               ? CONVERGED
                       : m < problem->arm->n - problem->task->n_locked ? AT_LIMITS
                                                                       : STALLED;
        double before = now->half_square;
        normal_equations(work, work->J, now->e, m);
        while (!better) {
            double lambda = mu * before + LM_MIN_LAMBDA;
            if (*budget <= 0) {
                return OUT_OF_BUDGET;
            }
            if (!lm_step(problem, m, lambda, budget, now, &better)) {
                return least;
            }
            mu *= better ? LM_MU_DECREASE : LM_MU_INCREASE;
        }
        take_trial(work);
        double gain = now->residual < LM_NEAR_SOLUTION ? LM_PATIENT_GAIN : least_gain;
        idle = now->half_square > (1 - gain) * before ? idle + 1 : 0;
        if (idle >= MAX_IDLE) {
            return least;
        }
    }
    return CONVERGED;
}

Ending patient_attempt(const Problem *problem, const double *x, int *budget, Evaluation *now)
{
    Task apart = *problem->task;
    Problem patient = *problem;
    apart.whole = 0;
    patient.task = &apart;
    memcpy(problem->work->q, x, problem->arm->n * sizeof(double));
    return attempt(&patient, LM_PATIENT_GAIN, budget, now);
}
