// Pinocchio's fk, and fk with mixed Jacobian, of a chain of revolute joints.
#include <string>

#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/multibody.hpp>

namespace pin = pinocchio;
using Pose = Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>;

struct Chain {
    pin::Model model;
    pin::Data data;
    pin::FrameIndex tool;
};

static pin::SE3 placement(const double *block)
{
    return pin::SE3(Eigen::Matrix4d(Pose(const_cast<double *>(block))));
}

// blocks: what stands before each joint, then the tool; row-major 4 x 4 each.
extern "C" __attribute__((visibility("default"))) void *make(long joints, const double *blocks)
{
    Chain *chain = new Chain;
    pin::JointIndex parent = 0;
    for (long k = 0; k < joints; k++) {
        const std::string name = "j" + std::to_string(k);
        parent =
            chain->model.addJoint(parent, pin::JointModelRZ(), placement(blocks + 16 * k), name);
    }
    const pin::SE3 tool = placement(blocks + 16 * joints);
    chain->tool = chain->model.addFrame(pin::Frame("tool", parent, 0, tool, pin::OP_FRAME));
    chain->data = pin::Data(chain->model);
    return chain;
}

static void write(const pin::SE3 &pose, double *T)
{
    Pose out(T);
    out.topLeftCorner<3, 3>() = pose.rotation();
    out.topRightCorner<3, 1>() = pose.translation();
    out.row(3) << 0, 0, 0, 1;
}

static void fk(void *context, const double *q, double *T)
{
    Chain &c = *static_cast<Chain *>(context);
    pin::forwardKinematics(c.model, c.data, Eigen::Map<const Eigen::VectorXd>(q, c.model.nq));
    write(pin::updateFramePlacement(c.model, c.data, c.tool), T);
}

static void fk_jacobian(void *context, const double *q, double *T, double *J)
{
    Chain &c = *static_cast<Chain *>(context);
    const Eigen::Map<const Eigen::VectorXd> v(q, c.model.nq);
    Eigen::Map<Eigen::Matrix<double, 6, Eigen::Dynamic>> out(J, 6, c.model.nv);
    // Faster than computeFrameJacobian.
    pin::computeJointJacobians(c.model, c.data, v);
    pin::updateFramePlacement(c.model, c.data, c.tool);
    pin::getFrameJacobian(c.model, c.data, c.tool, pin::LOCAL_WORLD_ALIGNED, out);
    write(c.data.oMf[c.tool], T);
}

#include "loop.h"
