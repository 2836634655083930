/* The data of inverse kinematics by iteration: the arm, the task, and the memory of an iteration.
 *
 * Vectors of coordinates have n_all entries: the n coordinates, followed for a platform by the
 * joints of its chain. Jacobians that the iteration works on are (n, 6): stored column by column.
 */
#ifndef CHASLES_ARM_H
#define CHASLES_ARM_H

#include "library/_kernel.h"
#include "numerics/_vectors.h"

#define MOST_KERNELS 4
#define FINALISTS 16 /* the best ends of attempts, which are refined to the least error nearby */

/* The axis of a joint between the base and the tip, constant in the frame before the joint. */
typedef struct {
    int frame;          /* index of the link before the joint, -1 for the base */
    int joint;          /* index of the coordinate, or of the chain's joint */
    double axis[TWIST]; /* twist per unit of the joint, measured at and expressed in `frame` */
} Screw;

/* The frame whose pose is wanted, and the compiled functions that give it:
 *   TIP_TOOL       fk_jacobian_mixed, hessian_mixed
 *   TIP_LINK       link_poses, and for a robot with loops chain_D_q; screws up to the link
 *   TIP_PLATFORM   chain_fk, chain_jacobian_mixed, actuators, actuators_D_chain */
typedef enum { TIP_TOOL, TIP_LINK, TIP_PLATFORM } TipKind;

typedef struct {
    TipKind kind;
    const chasles_kernel *kernels[MOST_KERNELS];
    int n_kernels;
    int n;     /* coordinates */
    int n_all; /* coordinates and, for a platform, the joints of its chain */
    int link, n_links, n_joints, n_screws; /* for TIP_LINK */
    Screw *screws;
    double *lower, *upper; /* (n,) */
    int n_starts;
    double *starts;      /* (n_starts, n_all) */
    double *start_poses; /* (12, n_starts): the first three rows of each pose, entry by entry */
} Arm;

typedef struct {
    const double *weights; /* (6,) of the error, linear first; those of lengths per unit */
    double unit;           /* metre: the length that counts as much as a radian */
    double tolerance;      /* radian, and parts of the unit */
    int in_tool_axes; /* whether weights and error are along the axes of the tip, not the base */
    int whole;        /* whether all weights are positive: the error is then the logarithm */
    int budget;       /* evaluations of forward kinematics */
    const unsigned char *locked; /* (n,) coordinates that keep the seed's values, or NULL */
    int n_locked;
} Task;

/* The memory of an iteration, all of it in one block. */
typedef struct {
    double *q, *trial, *halley; /* (n_all,): the iterate, and the ends of the two steps from it */
    double *best;               /* (FINALISTS + 1, n_all): ends in order, then the best of all */
    double *J, *trial_J, *halley_J; /* (n, 6): Jacobians of the weighted error there */
    double *normal, *A;             /* (m, m): J^T J of the m free coordinates, and its copy */
    double *gradient, *step;        /* (m,): J^T e of the free coordinates, and its copy */
    double *scratch;                /* scratch_size doubles */
    double *distances;              /* (n_starts,) */
    int *free;                      /* (n,): indices of the free coordinates */
} Workspace;

/* The target of one search, and the memory that it works in. */
typedef struct {
    const Arm *arm;
    const Task *task;
    const double *target; /* (4, 4) */
    double rounded;       /* residual up to which a least error reaches a target that was rounded */
    Workspace *work;
} Problem;

#endif
