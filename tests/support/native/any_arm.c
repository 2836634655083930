/* Runs the general inverse kinematics solver for an arm that is defined by tables. */
#include <stddef.h>

#include "chasles_general.h"

static chasles_general_arm arm;

/* Computes the tip pose and the mixed Jacobian of the arm from its constant transforms. */
static void pose_jacobian(const double *q, double *T, double *J)
{
    const int n = arm.joints;
    double at[12], moved[12], axis[CHASLES_CHAIN_MAX_JOINTS][3], point[CHASLES_CHAIN_MAX_JOINTS][3];
    memcpy(at, arm.placed[0], sizeof at);
    for (int k = 0; k < n; k++) {
        const double along = arm.direction[k] * q[k];
        const int slides = chasles_general_slides(&arm, k);
        const double c = slides ? 1.0 : cos(along), s = slides ? 0.0 : sin(along);
        const double motion[12] = {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, slides ? along : 0.0};
        for (int i = 0; i < 3; i++)
            axis[k][i] = at[4 * i + 2], point[k][i] = at[4 * i + 3];
        chasles_general_product(at, motion, moved);
        chasles_general_product(moved, arm.placed[k + 1], at);
    }
    memcpy(T, at, sizeof at);
    T[12] = T[13] = T[14] = 0.0, T[15] = 1.0;
    for (int k = 0; k < n; k++) {
        const int slides = chasles_general_slides(&arm, k);
        double lever[3];
        for (int i = 0; i < 3; i++)
            lever[i] = at[4 * i + 3] - point[k][i];
        for (int i = 0; i < 3; i++) {
            const int a = (i + 1) % 3, b = (i + 2) % 3;
            const double turned = axis[k][a] * lever[b] - axis[k][b] * lever[a];
            J[n * i + k] = arm.direction[k] * (slides ? axis[k][i] : turned);
            J[n * (3 + i) + k] = slides ? 0.0 : arm.direction[k] * axis[k][i];
        }
    }
}

/* Stores the given arm, with pose_jacobian as its forward kinematics function. */
void take(const chasles_general_arm *given)
{
    arm = *given;
    arm.pose_jacobian = pose_jacobian;
}

/* Computes the mixed Jacobian (6, n) at a configuration. */
void jacobian(const double *q, double *J)
{
    double T[16];
    pose_jacobian(q, T, J);
}

/* Computes the tip pose of each configuration, and solves the inverse kinematics for this pose. The
 * fixed joints keep their values from the configuration. Writes all solution slots with their
 * residuals. */
void solve(int count, const double *q, double *found, double *residual)
{
    double T[16], J[6 * CHASLES_CHAIN_MAX_JOINTS], margin[CHASLES_SLOTS],
        value[CHASLES_CHAIN_MAX_GIVEN];
    const int n = arm.joints;
    for (int i = 0; i < count; i++, q += n, found += CHASLES_SLOTS * n, residual += CHASLES_SLOTS) {
        for (int k = 0, given = 0; k < n; k++) {
            if (!chasles_general_is_solved(&arm, k))
                value[given++] = q[k];
        }
        pose_jacobian(q, T, J);
        chasles_general_slots(&arm, value, T, found, residual, margin);
    }
}
