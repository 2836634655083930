#include "iterative/native/solve_pose.h"

#include <math.h>
#include <string.h>

#include "iterative/native/attempt.h"
#include "iterative/native/starts.h"
#include "numerics/_rigid.h"
#include "numerics/_tolerances.h"

#define RESERVED_PART 4  /* 1 / RESERVED_PART of the budget is reserved for refinement */
#define MAX_RESERVED 400 /* maximum number of evaluations: in total, and in one refinement */

/* The state of a search: the best result so far, and the results of attempts, sorted by error. */
typedef struct {
    Evaluation best;
    double *best_q; /* (n,) */
    Ending ending;
    int budget, tried, n_ends;
    double errors[FINALISTS];
} Search;

static void take_best(const Problem *problem, Search *search, const Evaluation *now)
{
    search->best = *now;
    memcpy(search->best_q, problem->work->q, problem->arm->n * sizeof(double));
}

/* Makes attempts from successive start configurations until an attempt converges. */
static void try_starts(const Problem *problem, const double *seed, Search *search)
{
    Evaluation now = search->best;
    for (; search->ending != CONVERGED && search->ending != NO_POSE && search->budget > 0;
         search->tried++) {
        if (!next_start(problem, seed, search->tried)) {
            break;
        }
        search->ending = attempt(problem, LM_HASTY_GAIN, &search->budget, &now);
        search->n_ends = keep_end(problem, now.half_square, search->errors, search->n_ends);
        if (search->ending == CONVERGED || now.half_square < search->best.half_square) {
            take_best(problem, search, &now);
        }
    }
}

/* Refines the best results to the nearest minimum error. */
static void refine_ends(const Problem *problem, Search *search)
{
    Evaluation now = search->best;
    Ending last = search->ending;
    for (int k = 0; k < search->n_ends && last != CONVERGED && search->budget > 0; k++) {
        const double *end = problem->work->best + k * problem->arm->n;
        int all = k == 0 || search->budget < MAX_RESERVED;
        int share = all ? search->budget : MAX_RESERVED, left = share;
        last = patient_attempt(problem, end, &left, &now);
        search->budget -= share - left;
        if (k == 0 || last == CONVERGED || now.half_square < search->best.half_square) {
            take_best(problem, search, &now);
            search->ending = last;
        }
    }
    if (search->ending == OUT_OF_BUDGET && search->budget > 0) {
        now = search->best;
        search->ending = patient_attempt(problem, search->best_q, &search->budget, &now);
        take_best(problem, search, &now);
    }
}

/* If the target is a pose, searches from all start configurations and refines the best results. */
static void search_pose(const Problem *problem, const double *seed, Ending ending,
                        const Results *results)
{
    const Arm *arm = problem->arm;
    int given = problem->task->budget;
    int reserved = given / RESERVED_PART < MAX_RESERVED ? given / RESERVED_PART : MAX_RESERVED;
    Search search = {.best = {.half_square = INFINITY, .residual = NAN},
                     .best_q = problem->work->best + FINALISTS * arm->n,
                     .ending = ending,
                     .budget = given - reserved};
    for (int k = 0; k < arm->n; k++) {
        search.best_q[k] = NAN;
    }
    try_starts(problem, seed, &search);
    search.budget += reserved;
    refine_ends(problem, &search);
    memcpy(results->q, search.best_q, arm->n * sizeof(double));
    *results->residual = search.best.residual * problem->task->unit;
    *results->success = search.ending == CONVERGED;
    *results->ending = search.ending;
    *results->iterations = given - search.budget;
    *results->restarts = search.tried > 1 ? search.tried - 1 : 0;
}

void solve_pose(const Problem *problem, const double *seed, const Results *results)
{
    Problem rigid = *problem;
    double target[POSE];
    Rigidity found = rigidity(problem->target);
    if (found == NEAR_RIGID) {
        nearest_rigid(problem->target, target);
        rigid.target = target;
        rigid.rounded = reached_by_rounding(problem->target);
    }
    search_pose(&rigid, seed, found == NOT_RIGID ? NO_POSE : STALLED, results);
}
