#include "solver.hpp"

#include <algorithm>
#include <random>
#include <utility>

namespace chasles_robot_moveit
{
namespace
{

/** Largest difference of the exported poses from the robot model (m or rad): a URDF with rounded
 * numbers differs less; a robot with other lengths, joint directions or frames differs more. */
constexpr double MODEL_DIFFERENCE = 1e-4;
/** Number of configurations at which the robot model is compared. */
constexpr int COMPARED = 5;
/** Distance of these configurations from the reference of a robot with loops (rad or m): farther
 * away, the loops may not close. */
constexpr double NEAR = 0.01;

} // namespace

Solver::Solver(Robot robot) : robot_(std::move(robot))
{
    for (const int joint : robot_.inputs) {
        if (joint >= 0) {
            redundant_joint_indices_.push_back(static_cast<unsigned int>(joint));
        }
    }
    if (!robot_.inputs.empty()) {
        supported_methods_.push_back(kinematics::DiscretizationMethods::ALL_DISCRETIZED);
        supported_methods_.push_back(kinematics::DiscretizationMethods::ALL_RANDOM_SAMPLED);
    }
}

bool Solver::fail(const std::string &message) const
{
    RCLCPP_ERROR(rclcpp::get_logger("chasles_robot_moveit"), "%s", message.c_str());
    return false;
}

bool Solver::initialize(const rclcpp::Node::SharedPtr &node,
                        const moveit::core::RobotModel &robot_model, const std::string &group_name,
                        const std::string &base_frame, const std::vector<std::string> &tip_frames,
                        double search_discretization)
{
    node_ = node;
    step_ = search_discretization;
    storeValues(robot_model, group_name, base_frame, tip_frames, search_discretization);
    group_ = nullptr;
    if (tip_frames_.size() != 1) {
        return fail("the plugin needs one tip frame");
    }
    if (!robot_model.hasJointModelGroup(group_name)) {
        return fail("the robot model has no group " + group_name);
    }
    if (!findJoints() || !findFrames() || !agreesWithModel()) {
        return false;
    }
    group_ = robot_model.getJointModelGroup(group_name);
    return true;
}

bool Solver::findJoints()
{
    joint_names_.clear();
    link_names_.clear();
    lower_.clear();
    upper_.clear();
    for (const std::string &name : {base_frame_, tip_frames_[0]}) {
        if (!robot_model_->hasLinkModel(name)) {
            return fail("the robot model has no link " + name);
        }
    }
    std::vector<const moveit::core::JointModel *> found;
    const auto *link = robot_model_->getLinkModel(tip_frames_[0]);
    for (; link && link->getName() != base_frame_;
         link = link->getParentJointModel() ? link->getParentJointModel()->getParentLinkModel()
                                            : nullptr) {
        link_names_.push_back(link->getName());
        const auto *joint = link->getParentJointModel();
        // A mimic joint follows a joint of the chain and has no position of its own.
        if (joint && joint->getType() != moveit::core::JointModel::FIXED && !joint->getMimic()) {
            found.push_back(joint);
        }
    }
    if (!link) {
        return fail("the link " + tip_frames_[0] + " is not below " + base_frame_);
    }
    std::reverse(link_names_.begin(), link_names_.end());
    std::reverse(found.begin(), found.end());
    const auto *group = robot_model_->getJointModelGroup(group_name_);
    for (const auto *joint : found) {
        if (joint->getVariableCount() != 1 || !group->hasJointModel(joint->getName())) {
            return fail("the joint " + joint->getName() +
                        " is not a joint of the group with one own position");
        }
        const auto &bounds = robot_model_->getVariableBounds(joint->getName());
        joint_names_.push_back(joint->getName());
        lower_.push_back(bounds.position_bounded_ ? bounds.min_position_ : -UNLIMITED);
        upper_.push_back(bounds.position_bounded_ ? bounds.max_position_ : UNLIMITED);
    }
    if (found.size() != robot_.periods.size()) {
        return fail("the exported robot has " + std::to_string(robot_.periods.size()) +
                    " joints, the chain of the group has " + std::to_string(found.size()));
    }
    return true;
}

std::string Solver::link(const char *parameter, const char *exported, const std::string &own) const
{
    const std::string name = "robot_description_kinematics." + group_name_ + "." + parameter;
    std::string found = robot_model_->hasLinkModel(exported) ? exported : own;
    if (node_ && node_->has_parameter(name)) {
        node_->get_parameter(name, found);
    } else if (node_) {
        found = node_->declare_parameter<std::string>(name, found);
    }
    return found;
}

bool Solver::findFrames()
{
    moveit::core::RobotState state(robot_model_);
    state.setToDefaultValues();
    state.update();
    const auto relative = [&](const std::string &from, const std::string &to,
                              Eigen::Isometry3d &T) {
        if (!robot_model_->hasLinkModel(to)) {
            return fail("the robot model has no link " + to);
        }
        const auto *a = robot_model_->getLinkModel(from), *b = robot_model_->getLinkModel(to);
        if (moveit::core::RobotModel::getRigidlyConnectedParentLinkModel(a) !=
            moveit::core::RobotModel::getRigidlyConnectedParentLinkModel(b)) {
            return fail("a joint moves " + to + " relative to " + from);
        }
        T = state.getGlobalLinkTransform(a).inverse() * state.getGlobalLinkTransform(b);
        return true;
    };
    const std::string base = link("chasles_base_link", robot_.base, base_frame_);
    const std::string tip = link("chasles_tip_link", robot_.tip, tip_frames_[0]);
    if (!relative(base_frame_, base, base_) || !relative(tip_frames_[0], tip, tip_)) {
        return false;
    }
    base_ = base_.inverse();
    return true;
}

bool Solver::agreesWithModel() const
{
    moveit::core::RobotState state(robot_model_);
    state.setToDefaultValues();
    const auto *base = robot_model_->getLinkModel(base_frame_);
    const auto *tip = robot_model_->getLinkModel(tip_frames_[0]);
    std::mt19937 engine(1);
    for (int number = 0; number < COMPARED; ++number) {
        Values theta(joint_names_.size());
        for (std::size_t joint = 0; joint < theta.size(); ++joint) {
            double lower = std::max(lower_[joint], -FULL_TURN / 2);
            double upper = std::min(upper_[joint], FULL_TURN / 2);
            if (!robot_.reference.empty()) {
                lower = robot_.reference[joint] - NEAR;
                upper = robot_.reference[joint] + NEAR;
            }
            theta[joint] = std::uniform_real_distribution<double>(lower, upper)(engine);
        }
        state.setVariablePositions(joint_names_, theta);
        state.update();
        const Eigen::Isometry3d expected =
            state.getGlobalLinkTransform(base).inverse() * state.getGlobalLinkTransform(tip);
        const Eigen::Isometry3d found = tipPose(theta);
        const double difference = (found.matrix() - expected.matrix()).cwiseAbs().maxCoeff();
        if (!(difference <= MODEL_DIFFERENCE)) {
            return fail("the pose of " + tip_frames_[0] + " in " + base_frame_ +
                        " differs from the exported robot by " + std::to_string(difference) +
                        " (m or rad); export the URDF of this robot, or set chasles_base_link and "
                        "chasles_tip_link to the links of the exported frames " +
                        robot_.base + " and " + robot_.tip);
        }
    }
    return true;
}

bool Solver::setRedundantJoints(const std::vector<unsigned int> &redundant_joint_indices)
{
    const bool is_same =
        redundant_joint_indices.size() == redundant_joint_indices_.size() &&
        std::is_permutation(redundant_joint_indices.begin(), redundant_joint_indices.end(),
                            redundant_joint_indices_.begin());
    return is_same && KinematicsBase::setRedundantJoints(redundant_joint_indices);
}

} // namespace chasles_robot_moveit
