// Eigenvectors of small symmetric matrices.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace kiln {

using Matrix3 = std::array<std::array<double, 3>, 3>;

/// Diagonalizes the symmetric matrix `m` by cyclic Jacobi sweeps: eigenvalues end on its diagonal, eigenvectors in the
/// columns of `v`.
inline void diagonalise(Matrix3& m, Matrix3& v) {
  v = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (int sweep = 0; sweep < 8; ++sweep) {
    const double off_diagonal = m[0][1] * m[0][1] + m[0][2] * m[0][2] + m[1][2] * m[1][2];
    const double trace = m[0][0] + m[1][1] + m[2][2];
    if (off_diagonal <= 1e-24 * trace * trace) return;
    for (std::size_t p = 0; p < 2; ++p) {
      for (std::size_t q = p + 1; q < 3; ++q) {
        if (m[p][q] == 0) continue;
        const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        const double t =
            (theta < 0 ? -1.0 : 1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        const std::size_t r = 3 - p - q;
        m[p][p] -= t * m[p][q];
        m[q][q] += t * m[p][q];
        m[p][q] = m[q][p] = 0;
        const double rp = m[r][p], rq = m[r][q];
        m[r][p] = m[p][r] = c * rp - s * rq;
        m[r][q] = m[q][r] = s * rp + c * rq;
        for (auto& row : v) {
          const double vp = row[p], vq = row[q];
          row[p] = c * vp - s * vq;
          row[q] = s * vp + c * vq;
        }
      }
    }
  }
}

}  // namespace kiln
