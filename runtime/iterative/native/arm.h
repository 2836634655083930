/* Data of iterative inverse kinematics: arm, task, memory. Jacobians (n, 6) are stored by column.
 */
#pragma once

#include "library/_kernel.h"
#include "numerics/_vectors.h"

#define MAX_KERNELS 2
#define FINALISTS 16 /* number of attempts that are refined to the nearest minimum error */

/* A joint of the chain from the base to the tip. */
typedef struct {
    int link;           /* index of the link that the joint moves */
    int joint;          /* index of the coordinate, or of the main-chain joint */
    double axis[TWIST]; /* twist of the link per joint unit, at the link origin and in link axes */
} Screw;

/* The tip frame and the compiled functions that compute its pose. If the tip is the tool, the
 * functions are fk_jacobian_mixed and hessian_mixed. If the tip is a link, the function is
 * link_poses, and the Jacobian is computed from the screws of the joints before the link. For a
 * robot with loops, chain_D_q is also needed. */
typedef struct {
    int link; /* the index of the link, -1 for the tool */
    const chasles_kernel *kernels[MAX_KERNELS];
    int n_kernels;
    int n;                           /* coordinates */
    int n_links, n_joints, n_screws; /* for a link */
    Screw *screws;
    const double *lower, *upper; /* (n,) */
    int n_starts;
    const double *starts;      /* (n_starts, n) */
    const double *start_poses; /* (12, n_starts): one pose per column */
} Arm;

typedef struct {
    const double *weights; /* (6,) weights of the error, linear first */
    double unit;           /* [m] the length that is equivalent to one radian */
    double tolerance; /* maximum residual of a solution [rad], with lengths divided by `unit` */
    int in_tool_axes; /* whether weights and error use tip axes instead of base axes */
    int whole;        /* whether all six weights are positive */
    int budget;       /* maximum number of evaluations of forward kinematics */
    const unsigned char *locked; /* (n,) coordinates that keep the seed's values, or NULL */
    int n_locked;
} Task;

/* The memory of an iteration is a single block. */
typedef struct {
    double *q, *trial, *halley; /* (n,): current coordinates, and the ends of two trial steps */
    double *best; /* (FINALISTS + 1, n): end configurations in order, then the best of all */
    double *J, *trial_J, *halley_J; /* (n, 6): Jacobians of the weighted error */
    double *normal, *A; /* (m, m): J^T J of the m free coordinates, and a copy of this matrix */
    double *gradient, *step; /* (m,): J^T e of the free coordinates, and a copy of this vector */
    double *scratch;         /* scratch_size doubles */
    double *distances;       /* (n_starts,) */
    int *free;               /* (n,): indices of the free coordinates */
} Workspace;

/* The target and the working memory of one search. */
typedef struct {
    const Arm *arm;
    const Task *task;
    const double *target; /* (4, 4) */
    double rounded;       /* maximum residual of a solution for a rounded target */
    Workspace *work;
} Problem;
