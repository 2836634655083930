// Calls a kinematics plugin through its base class, for Python.
#include <moveit/kinematics_base/kinematics_base.hpp>
#include <moveit/robot_state/robot_state.hpp>
#include <sstream>

kinematics::KinematicsBase *created_plugin();

namespace
{
using Pose = geometry_msgs::msg::Pose;
using Values = std::vector<double>;
using Code = moveit_msgs::msg::MoveItErrorCodes;
using Accept = bool (*)(const double *theta);

struct Plugin {
    moveit::core::RobotModel model;
    std::shared_ptr<rclcpp::Node> node = std::make_shared<rclcpp::Node>();
    std::unique_ptr<kinematics::KinematicsBase> base{created_plugin()};

    Values row(const double *values) const
    {
        return values ? Values(values, values + base->getJointNames().size()) : Values();
    }
};

Pose pose(const double *v)
{
    Pose made;
    made.position = {v[0], v[1], v[2]};
    made.orientation = {v[3], v[4], v[5], v[6]};
    return made;
}
} // namespace

extern "C" {
/** Each line of the model: name, type, parent, child, origin by row, axis, lower, upper, bounded.
 */
Plugin *create(const char *lines)
{
    auto *plugin = new Plugin();
    auto &model = plugin->model;
    std::istringstream text(lines);
    std::string name, type, parent, child, leader;
    while (text >> name >> type >> parent >> child) {
        auto &joint = model.joints[name];
        joint.name = name;
        joint.type = type == "fixed"       ? moveit::core::JointModel::FIXED
                     : type == "prismatic" ? moveit::core::JointModel::PRISMATIC
                                           : moveit::core::JointModel::REVOLUTE;
        for (int k = 0; k < 16; ++k) {
            text >> joint.origin.matrix()(k / 4, k % 4);
        }
        text >> joint.axis.x() >> joint.axis.y() >> joint.axis.z();
        text >> joint.bounds.min_position_ >> joint.bounds.max_position_;
        text >> joint.bounds.position_bounded_ >> leader >> joint.multiplier;
        joint.mimic = leader == "-" ? nullptr : &model.joints.at(leader);
        model.links[parent].name = parent;
        model.links[child] = {};
        model.links[child].name = child;
        model.links[child].joint = &joint;
        joint.parent = &model.links[parent];
    }
    // The group is the chain from "base" to "ee", as in an SRDF file.
    auto &group = model.group;
    for (const auto *link = &model.links["ee"]; link->name != "base"; link = link->joint->parent) {
        group.links.insert(group.links.begin(), link->name);
        if (link->joint->type != moveit::core::JointModel::FIXED && !link->joint->mimic) {
            group.joints.insert(group.joints.begin(), link->joint->name);
        }
    }
    return plugin;
}

void set_parameter(Plugin *plugin, const char *name, const char *value)
{
    plugin->node->parameters[std::string("robot_description_kinematics.arm.") + name] = value;
}

bool initialize(Plugin *plugin, const char *group, const char *base, const char *tip, double step)
{
    return plugin->base->initialize(plugin->node, plugin->model, group, base, {tip}, step);
}

const char *last_error()
{
    return rclcpp::get_logger("").text;
}

const char *names(Plugin *plugin, bool links)
{
    static std::string joined;
    joined.clear();
    for (const auto &name : links ? plugin->base->getLinkNames() : plugin->base->getJointNames()) {
        joined += name + " ";
    }
    return joined.c_str();
}

bool set_redundant(Plugin *plugin, unsigned int joint)
{
    return plugin->base->setRedundantJoints(std::vector<unsigned int>{joint});
}

bool nearest(Plugin *plugin, const double *target, const double *seed, double *theta, int *code)
{
    Values found;
    Code error;
    const bool is_found =
        plugin->base->getPositionIK(pose(target), plugin->row(seed), found, error);
    std::copy(found.begin(), found.end(), theta);
    *code = error.val;
    return is_found;
}

/** Returns the number of solutions. */
int all_solutions(Plugin *plugin, int poses, const double *target, const double *seed, int method,
                  double *theta, double *percentage, int *error)
{
    std::vector<Values> found;
    kinematics::KinematicsResult result;
    kinematics::KinematicsQueryOptions options;
    options.discretization_method = static_cast<kinematics::DiscretizationMethod>(method);
    const std::vector<Pose> targets(static_cast<std::size_t>(poses), pose(target));
    const bool is_found =
        plugin->base->getPositionIK(targets, plugin->row(seed), found, result, options);
    for (const Values &row : found) {
        theta = std::copy(row.begin(), row.end(), theta);
    }
    *percentage = result.solution_percentage;
    *error = result.kinematic_error;
    return is_found ? static_cast<int>(found.size()) : 0;
}

/** Searches with the overload that takes the given arguments; as_list passes a list of poses. */
bool search(Plugin *plugin, bool as_list, const double *target, const double *seed, double timeout,
            const double *limits, Accept accept, bool locked, double *theta, int *code)
{
    Values found;
    Code error;
    kinematics::KinematicsQueryOptions options;
    options.lock_redundant_joints = locked;
    const Pose one = pose(target);
    const Values from = plugin->row(seed), near = plugin->row(limits);
    const auto &base = *plugin->base;
    kinematics::KinematicsBase::IKCallbackFn callback;
    if (accept) {
        callback = [accept](const Pose &, const Values &row, Code &answer) {
            answer.val = accept(row.data()) ? Code::SUCCESS : Code::NO_IK_SOLUTION;
        };
    }
    bool is_found;
    if (as_list) {
        is_found = base.searchPositionIK(std::vector<Pose>{one}, from, timeout, near, found,
                                         callback, nullptr, error, options);
    } else if (limits && accept) {
        is_found = base.searchPositionIK(one, from, timeout, near, found, callback, error, options);
    } else if (limits) {
        is_found = base.searchPositionIK(one, from, timeout, near, found, error, options);
    } else if (accept) {
        is_found = base.searchPositionIK(one, from, timeout, found, callback, error, options);
    } else {
        is_found = base.searchPositionIK(one, from, timeout, found, error, options);
    }
    std::copy(found.begin(), found.end(), theta);
    *code = error.val;
    return is_found;
}

bool forward(Plugin *plugin, const char *link, const double *theta, double *found)
{
    std::vector<Pose> poses;
    if (!plugin->base->getPositionFK({link}, plugin->row(theta), poses)) {
        return false;
    }
    const auto &at = poses[0].position;
    const auto &turn = poses[0].orientation;
    const double values[] = {at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w};
    std::copy(values, values + 7, found);
    return true;
}
}
