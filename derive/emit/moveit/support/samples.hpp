/** The values of the inputs of an inverse, such as a redundant joint, in the order of a search. */
#ifndef CHASLES_MOVEIT_SAMPLES_HPP
#define CHASLES_MOVEIT_SAMPLES_HPP

#include <algorithm>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace chasles_robot_moveit
{

using Values = std::vector<double>;

constexpr double FULL_TURN = 6.283185307179586; // rad
constexpr double UNLIMITED = std::numeric_limits<double>::infinity();

/** First the values of the seed, then values in growing distance or random values. */
class Samples
{
  public:
    /** An input with its interval, the distance of its samples, and whether they are random. */
    struct Axis {
        double seed, lower, upper, step;
        bool is_random;
    };

    explicit Samples(std::vector<Axis> axes)
        : axes_(std::move(axes)), index_(axes_.size(), 0), values_(axes_.size())
    {
        for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
            Axis &a = axes_[axis];
            a.seed = std::max(a.lower, std::min(a.upper, a.seed));
            values_[axis] = a.seed;
        }
    }

    /** Whether the first sample exists: no interval is empty. */
    bool exists() const
    {
        return std::all_of(axes_.begin(), axes_.end(),
                           [](const Axis &a) { return a.lower <= a.upper; });
    }

    const Values &values() const
    {
        return values_;
    }

    /** Goes to the next sample, or returns false after the last. */
    bool next()
    {
        for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
            const bool is_last = index_[axis] == above(axes_[axis]) + below(axes_[axis]);
            index_[axis] = is_last ? 0 : index_[axis] + 1;
            values_[axis] = value(axes_[axis], index_[axis]);
            if (!is_last) {
                return true;
            }
        }
        return false;
    }

  private:
    static std::size_t above(const Axis &a)
    {
        return a.step > 0 ? static_cast<std::size_t>((a.upper - a.seed) / a.step) : 0;
    }
    static std::size_t below(const Axis &a)
    {
        return a.step > 0 ? static_cast<std::size_t>((a.seed - a.lower) / a.step) : 0;
    }

    static double value(const Axis &a, std::size_t index)
    {
        if (index == 0) {
            return a.seed;
        }
        if (a.is_random) {
            thread_local std::mt19937 engine{std::random_device{}()};
            return std::uniform_real_distribution<double>(a.lower, a.upper)(engine);
        }
        const std::size_t up = above(a), both = std::min(up, below(a));
        const bool alternates = index <= 2 * both;
        const std::size_t count = alternates ? (index + 1) / 2 : index - both;
        const bool is_up = alternates ? index % 2 == 1 : up > both;
        return a.seed + (is_up ? a.step : -a.step) * static_cast<double>(count);
    }

    std::vector<Axis> axes_;
    std::vector<std::size_t> index_;
    Values values_;
};

} // namespace chasles_robot_moveit

#endif
