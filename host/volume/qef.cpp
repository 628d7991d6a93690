#include "volume/qef.h"

#include <algorithm>
#include <cmath>

#include "base/symmetric.h"

namespace kiln {
namespace {

Vec3d multiply(const std::array<double, 6>& a, const Vec3d& x) {
  return {a[0] * x.x + a[1] * x.y + a[2] * x.z, a[1] * x.x + a[3] * x.y + a[4] * x.z,
          a[2] * x.x + a[4] * x.y + a[5] * x.z};
}

}  // namespace

void Qef::add(const kiln_volume_qef& local, const CellPlace& cell) {
  const Vec3d o(cell[0], cell[1], cell[2]);
  std::array<double, 6> m{};
  for (std::size_t k = 0; k < 6; ++k) m[k] = local.a[k];
  const Vec3d side(local.b[0], local.b[1], local.b[2]);
  const Vec3d shifted = multiply(m, o);
  for (std::size_t k = 0; k < 6; ++k) a[k] += m[k];
  b += side + shifted;
  c += local.c + 2 * dot(side, o) + dot(o, shifted);
  mass += Vec3d(local.mass[0], local.mass[1], local.mass[2]) + o * double{local.count};
  count += local.count;
}

void Qef::add(const Qef& other) {
  for (std::size_t k = 0; k < 6; ++k) a[k] += other.a[k];
  b += other.b;
  c += other.c;
  mass += other.mass;
  count += other.count;
}

double Qef::error_at(const Vec3d& place) const {
  const double sum = dot(place, multiply(a, place)) - 2 * dot(b, place) + c;
  return std::sqrt(std::max(0.0, sum) / count);
}

Qef::Minimum Qef::find_minimum(const Vec3d& low, const Vec3d& high) const {
  const Vec3d middle = mass * (1 / count);
  const Vec3d residual = b - multiply(a, middle);
  Matrix3 m = {{{a[0], a[1], a[2]}, {a[1], a[3], a[4]}, {a[2], a[4], a[5]}}};
  Matrix3 v;
  diagonalise(m, v);
  const double largest = std::max({m[0][0], m[1][1], m[2][2]});
  // Restricts the linear system to the subspace that the quadric determines well. The unknown is
  // the step from the mean of the crossings.
  std::array<double, 3> step{}, right{};
  Matrix3 damped_matrix{};
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(m[k][k] > KILN_VOLUME_EIGEN_LIMIT * largest)) continue;
    const double coordinate = v[0][k] * residual.x + v[1][k] * residual.y + v[2][k] * residual.z;
    for (std::size_t i = 0; i < 3; ++i) {
      step[i] += v[i][k] * (coordinate / m[k][k]);
      right[i] += v[i][k] * coordinate;
      for (std::size_t j = 0; j < 3; ++j) damped_matrix[i][j] += m[k][k] * v[i][k] * v[j][k];
    }
  }
  const std::array<double, 3> from = {low.x - middle.x, low.y - middle.y, low.z - middle.z};
  const std::array<double, 3> to = {high.x - middle.x, high.y - middle.y, high.z - middle.z};
  bool outside_distance = false;
  for (std::size_t i = 0; i < 3; ++i) {
    const double clamped = std::clamp(step[i], from[i], to[i]);
    outside_distance = outside_distance || clamped != step[i];
    step[i] = clamped;
  }
  if (outside_distance) {
    // Finds the minimum within the box by coordinate descent. A small term on the diagonal keeps
    // undetermined directions at the mean, and makes the matrix positive definite, so that the
    // descent converges.
    for (std::size_t i = 0; i < 3; ++i) damped_matrix[i][i] += 1e-3 * largest;
    for (int round = 0; round < 24; ++round) {
      double step_length = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        const double best =
            (right[i] - damped_matrix[i][j] * step[j] - damped_matrix[i][k] * step[k]) /
            damped_matrix[i][i];
        const double next = std::clamp(best, from[i], to[i]);
        step_length = std::max(step_length, std::abs(next - step[i]));
        step[i] = next;
      }
      if (step_length < 1e-6) break;
    }
  }
  const Vec3d d(step[0], step[1], step[2]);
  const double at_middle = dot(middle, multiply(a, middle)) - 2 * dot(b, middle) + c;
  const double error = at_middle - 2 * dot(residual, d) + dot(d, multiply(a, d));
  return {middle + d, std::sqrt(std::max(0.0, error) / count)};
}

}  // namespace kiln
