#include "solver.hpp"

#include "chasles_nearest.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <utility>

namespace chasles_robot_moveit
{
namespace
{

using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

Eigen::Isometry3d toIsometry(const Pose &pose)
{
    const auto &at = pose.position;
    const auto &turn = pose.orientation;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::Quaterniond(turn.w, turn.x, turn.y, turn.z).normalized().toRotationMatrix();
    T.translation() << at.x, at.y, at.z;
    return T;
}

Pose toPose(const Eigen::Isometry3d &T)
{
    const Eigen::Quaterniond turn(T.linear());
    Pose pose;
    pose.position.x = T.translation().x();
    pose.position.y = T.translation().y();
    pose.position.z = T.translation().z();
    pose.orientation.x = turn.x();
    pose.orientation.y = turn.y();
    pose.orientation.z = turn.z();
    pose.orientation.w = turn.w();
    return pose;
}

/** Whether each joint is within its consistency limit; empty limits accept every joint. */
bool isConsistent(const Values &theta, const Values &seed, const Values &limits)
{
    for (std::size_t joint = 0; joint < limits.size(); ++joint) {
        if (!(std::abs(theta[joint] - seed[joint]) <= limits[joint])) {
            return false;
        }
    }
    return true;
}

} // namespace

/** Values of the inputs of an inverse, such as a redundant joint, in the order of a search: first
 * the values of the seed, then values in growing distance or random values. */
class Samples
{
  public:
    /** An input with its interval, the distance of its samples, and whether they are random. */
    struct Axis {
        double seed, lower, upper, step;
        bool is_random;
    };

    explicit Samples(std::vector<Axis> axes) : axes_(std::move(axes)), index_(axes_.size(), 0)
    {
        for (Axis &a : axes_) {
            a.seed = std::max(a.lower, std::min(a.upper, a.seed));
            exists = exists && a.lower <= a.upper;
            values.push_back(a.seed);
        }
    }

    /** Goes to the next sample; after the last sample, none exists. */
    void next()
    {
        exists = false;
        for (std::size_t axis = 0; axis < axes_.size() && !exists; ++axis) {
            const Axis &a = axes_[axis];
            const std::size_t up = count(a.upper - a.seed, a), down = count(a.seed - a.lower, a);
            exists = index_[axis] < up + down;
            index_[axis] = exists ? index_[axis] + 1 : 0;
            values[axis] = value(a, index_[axis], up, down);
        }
    }

    Values values;
    bool exists = true;

  private:
    static std::size_t count(double distance, const Axis &a)
    {
        return a.step > 0 ? static_cast<std::size_t>(distance / a.step) : 0;
    }

    static double value(const Axis &a, std::size_t index, std::size_t up, std::size_t down)
    {
        if (a.is_random && index > 0) {
            thread_local std::mt19937 engine{std::random_device{}()};
            return std::uniform_real_distribution<double>(a.lower, a.upper)(engine);
        }
        const std::size_t both = std::min(up, down);
        const bool alternates = index <= 2 * both;
        const std::size_t steps = alternates ? (index + 1) / 2 : index - both;
        const bool is_up = alternates ? index % 2 == 1 : up > both;
        return a.seed + (is_up ? a.step : -a.step) * static_cast<double>(steps);
    }

    std::vector<Axis> axes_;
    std::vector<std::size_t> index_;
};

Eigen::Isometry3d Solver::tipPose(const Values &theta) const
{
    RowMajor T;
    robot_.forward(theta.data(), T.data());
    return base_.inverse() * Eigen::Isometry3d(Eigen::Matrix4d(T)) * tip_.inverse();
}

bool Solver::accepts(const Values &seed, const Values &limits) const
{
    if (!group_) {
        return fail("the plugin is not initialized");
    }
    const auto is_finite = [](double value) { return std::isfinite(value); };
    if (seed.size() != joint_names_.size() || !std::all_of(seed.begin(), seed.end(), is_finite)) {
        return fail("the seed needs one finite position for each joint");
    }
    if (!limits.empty() && limits.size() != seed.size()) {
        return fail("the consistency limits need one value for each joint");
    }
    return true;
}

Samples Solver::samples(const Values &seed, const Values &limits, const Options &options) const
{
    const bool is_random =
        options.discretization_method == kinematics::DiscretizationMethods::ALL_RANDOM_SAMPLED;
    Values values(robot_.inputs.size());
    robot_.inputs_at(seed.data(), values.data());
    std::vector<Samples::Axis> axes;
    for (std::size_t k = 0; k < values.size(); ++k) {
        const int joint = robot_.inputs[k];
        Samples::Axis axis{values[k], values[k] - FULL_TURN / 2, values[k] + FULL_TURN / 2, step_,
                           is_random};
        if (options.lock_redundant_joints) {
            axis.lower = axis.upper = values[k];
        } else if (joint >= 0) {
            const auto j = static_cast<std::size_t>(joint);
            const double reach = limits.empty() ? UNLIMITED : limits[j];
            const bool is_bounded = std::isfinite(lower_[j]) && std::isfinite(upper_[j]);
            axis.lower = std::max(is_bounded ? lower_[j] : axis.lower, values[k] - reach);
            axis.upper = std::min(is_bounded ? upper_[j] : axis.upper, values[k] + reach);
            axis.step = getSearchDiscretization(joint);
        }
        axes.push_back(axis);
    }
    return Samples(std::move(axes));
}

std::vector<Values> Solver::solutions(const Pose &pose, const Values &seed, const Values &inputs,
                                      const Values &limits) const
{
    const std::size_t n = seed.size();
    const RowMajor T = (base_ * toIsometry(pose) * tip_).matrix();
    const Values weights(n, 1.0);
    const chasles_moves moves = {lower_.data(), upper_.data(), weights.data(),
                                 robot_.periods.data()};
    Values slots(robot_.slots * n), residual(robot_.slots);
    robot_.inverse(T.data(), inputs.data(), slots.data(), residual.data());
    std::vector<std::pair<double, Values>> found;
    for (std::size_t slot = 0; slot < robot_.slots; ++slot) {
        Values theta(n);
        const double far = chasles_limited(static_cast<int>(n), &moves, &slots[slot * n],
                                           seed.data(), theta.data());
        if (residual[slot] <= CHASLES_SOLVED && far < UNLIMITED &&
            isConsistent(theta, seed, limits)) {
            found.emplace_back(far, std::move(theta));
        }
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto &a, const auto &b) { return a.first < b.first; });
    std::vector<Values> sorted;
    for (auto &[far, theta] : found) {
        sorted.push_back(std::move(theta));
    }
    return sorted;
}

bool Solver::search(const Pose &pose, const Values &seed, double timeout, const Values &limits,
                    Values &solution, const Callback &callback, ErrorCode &code,
                    const Options &options) const
{
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout);
    code.val = ErrorCode::NO_IK_SOLUTION;
    if (!accepts(seed, limits)) {
        return false;
    }
    for (Samples sample = samples(seed, limits, options); sample.exists; sample.next()) {
        for (const Values &theta : solutions(pose, seed, sample.values, limits)) {
            code.val = ErrorCode::SUCCESS;
            if (callback) {
                callback(pose, theta, code);
            }
            if (code.val == ErrorCode::SUCCESS) {
                solution = theta;
                return true;
            }
        }
        code.val = ErrorCode::TIMED_OUT;
        if (std::chrono::steady_clock::now() >= end) {
            return false;
        }
    }
    code.val = ErrorCode::NO_IK_SOLUTION;
    return false;
}

bool Solver::getPositionIK(const std::vector<Pose> &poses, const Values &seed,
                           std::vector<Values> &solutions, kinematics::KinematicsResult &result,
                           const Options &options) const
{
    namespace Errors = kinematics::KinematicErrors;
    const auto &known = supported_methods_;
    const auto method = options.discretization_method;
    const bool is_known = std::find(known.begin(), known.end(), method) != known.end();
    solutions.clear();
    result.solution_percentage = 0;
    result.kinematic_error = poses.empty()        ? Errors::EMPTY_TIP_POSES
                             : poses.size() != 1  ? Errors::MULTIPLE_TIPS_NOT_SUPPORTED
                             : !is_known          ? Errors::UNSUPORTED_DISCRETIZATION_REQUESTED
                             : !accepts(seed, {}) ? Errors::SOLVER_NOT_ACTIVE
                                                  : Errors::OK;
    if (result.kinematic_error != Errors::OK) {
        return false;
    }
    Options sampled = options;
    sampled.lock_redundant_joints |= method == kinematics::DiscretizationMethods::NO_DISCRETIZATION;
    std::size_t searched = 0;
    for (Samples sample = samples(seed, {}, sampled); sample.exists; sample.next()) {
        for (Values &theta : this->solutions(poses[0], seed, sample.values, {})) {
            solutions.push_back(std::move(theta));
        }
        searched += robot_.slots;
    }
    if (solutions.empty()) {
        result.kinematic_error = Errors::NO_SOLUTION;
        return false;
    }
    result.solution_percentage =
        static_cast<double>(solutions.size()) / static_cast<double>(searched);
    return true;
}

bool Solver::searchPositionIK(const std::vector<Pose> &poses, const Values &seed, double timeout,
                              const Values &limits, Values &solution, const Callback &callback,
                              PassedCost cost_function, ErrorCode &code, const Options &options,
                              const moveit::core::RobotState *context_state) const
{
    if (!cost_function || poses.size() != 1) {
        return searchPositionIK(poses, seed, timeout, limits, solution, callback, code, options,
                                context_state);
    }
    moveit::core::RobotState state(robot_model_);
    state.setToDefaultValues();
    if (context_state) {
        state = *context_state;
    }
    // Up to Humble, cost functions take a group that is not const.
    auto *group = const_cast<moveit::core::JointModelGroup *>(group_);
    double lowest = UNLIMITED;
    // Each acceptable solution is compared and then rejected, so that the search goes on.
    const auto compared = [&](const Pose &pose, const Values &theta, ErrorCode &found) {
        if (callback) {
            callback(pose, theta, found);
        }
        if (found.val == ErrorCode::SUCCESS) {
            state.setVariablePositions(joint_names_, theta);
            state.update();
            const double cost = cost_function(pose, state, group, seed);
            if (cost < lowest) {
                lowest = cost;
                solution = theta;
            }
        }
        found.val = ErrorCode::NO_IK_SOLUTION;
    };
    Values rejected;
    search(poses[0], seed, timeout, limits, rejected, compared, code, options);
    if (lowest < UNLIMITED) {
        code.val = ErrorCode::SUCCESS;
    }
    return lowest < UNLIMITED;
}

bool Solver::getPositionFK(const std::vector<std::string> &link_names, const Values &joint_angles,
                           std::vector<Pose> &poses) const
{
    if (!accepts(joint_angles, {})) {
        return false;
    }
    moveit::core::RobotState state(robot_model_);
    state.setToDefaultValues();
    state.setVariablePositions(joint_names_, joint_angles);
    state.update();
    const auto *base = robot_model_->getLinkModel(base_frame_);
    poses.clear();
    for (const std::string &name : link_names) {
        if (!robot_model_->hasLinkModel(name)) {
            return fail("the robot model has no link " + name);
        }
        const auto *link = robot_model_->getLinkModel(name);
        // With loops, the pose in C belongs to the assembly of the robot, not to these joints.
        const bool is_exported = name == tip_frames_[0] && robot_.reference.empty();
        const Eigen::Isometry3d in_model =
            state.getGlobalLinkTransform(base).inverse() * state.getGlobalLinkTransform(link);
        poses.push_back(toPose(is_exported ? tipPose(joint_angles) : in_model));
    }
    return true;
}

} // namespace chasles_robot_moveit
