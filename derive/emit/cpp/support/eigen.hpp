/** Conversions between Eigen and the types of chasles/kinematics.hpp. */
#ifndef CHASLES_EIGEN_HPP
#define CHASLES_EIGEN_HPP

#include <Eigen/Geometry>

#include "kinematics.hpp"

namespace chasles
{

/** A view of an Eigen vector with fixed size, without a copy. */
template <typename Vector> auto view(const Eigen::PlainObjectBase<Vector> &values) noexcept
{
    static_assert(Vector::IsVectorAtCompileTime && Vector::SizeAtCompileTime > 0,
                  "view needs a vector with fixed size; matrices are column-major in Eigen");
    return View<static_cast<std::size_t>(Vector::SizeAtCompileTime)>(values.data());
}
template <typename Vector> auto view(const Eigen::PlainObjectBase<Vector> &&) = delete;

/** An Eigen vector over an array, without a copy. */
template <std::size_t N> auto eigen(const std::array<double, N> &values) noexcept
{
    return Eigen::Map<const Eigen::Matrix<double, static_cast<int>(N), 1>>(values.data());
}
template <std::size_t N> auto eigen(const std::array<double, N> &&) = delete;

/** An Eigen matrix over an array, without a copy. */
template <std::size_t Rows, std::size_t Columns>
auto eigen(const Array<Rows, Columns> &values) noexcept
{
    constexpr auto order = Columns == 1 ? Eigen::ColMajor : Eigen::RowMajor;
    using Matrix = Eigen::Matrix<double, static_cast<int>(Rows), static_cast<int>(Columns), order>;
    return Eigen::Map<const Matrix>(values.data());
}
template <std::size_t Rows, std::size_t Columns> auto eigen(const Array<Rows, Columns> &&) = delete;

/** The pose as an Eigen transform. */
inline Eigen::Isometry3d isometry(const Array<4, 4> &T)
{
    return Eigen::Isometry3d(Eigen::Matrix4d(eigen(T)));
}

/** The row-major pose of an Eigen transform. */
inline Array<4, 4> pose(const Eigen::Isometry3d &T)
{
    Array<4, 4> copied{};
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(copied.data()) = T.matrix();
    return copied;
}

} // namespace chasles

#endif
