#include "lowpoly/flat_system.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "lowpoly/pairing.h"

namespace kiln {
namespace {

/// Lists, one after another.
struct Lists {
  std::vector<std::uint32_t> starts, entries;
  std::span<const std::uint32_t> of(std::size_t i) const {
    return {entries.data() + starts[i], entries.data() + starts[i + 1]};
  }
};

/// The neighbours of each vertex; inner ones are there twice.
Lists neighbours_of(const FlatChart& chart) {
  Lists lists;
  lists.starts.assign(chart.points.size() + 1, 0);
  for (const Triangle& t : chart.triangles) {
    for (const std::uint32_t v : t) lists.starts[v] += 2;
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& start : lists.starts) start = sum += start;
  lists.entries.resize(sum);
  for (const Triangle& t : chart.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      lists.entries[--lists.starts[t[k]]] = t[(k + 1) % 3];
      lists.entries[--lists.starts[t[k]]] = t[(k + 2) % 3];
    }
  }
  return lists;
}

/// Vertices in an order of elimination: that of least degree.
std::vector<std::uint32_t> least_degree(const Lists& neighbours) {
  const auto size = static_cast<int>(neighbours.starts.size()) - 1;
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.resizeNonZeros(static_cast<Eigen::Index>(neighbours.entries.size()) + size);
  int* to = matrix.innerIndexPtr();
  for (int v = 0; v < size; ++v) {
    matrix.outerIndexPtr()[v] = static_cast<int>(to - matrix.innerIndexPtr());
    *to++ = v;
    const auto near = neighbours.of(static_cast<std::size_t>(v));
    for (auto it = near.begin(); it != near.end(); ++it) {
      if (std::find(near.begin(), it, *it) == it) *to++ = static_cast<int>(*it);
    }
  }
  matrix.outerIndexPtr()[size] = static_cast<int>(to - matrix.innerIndexPtr());
  matrix.resizeNonZeros(to - matrix.innerIndexPtr());
  std::fill(matrix.valuePtr(), matrix.valuePtr() + matrix.nonZeros(), 1.0);
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::internal::minimum_degree_ordering(matrix, permutation);
  std::vector<std::uint32_t> order(permutation.indices().begin(), permutation.indices().end());
  return order;
}

template <std::size_t N>
using Block = typename FlatSystem<N>::Block;

/// a -= b * c, the latter transposed.
template <std::size_t N>
void subtract(Block<N>& a, const Block<N>& b, const Block<N>& c) {
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < N; ++j) {
      for (std::size_t k = 0; k < N; ++k) a[N * i + j] -= b[N * i + k] * c[N * j + k];
    }
  }
}

template <std::size_t N>
Block<N> product(const Block<N>& a, const Block<N>& b) {
  Block<N> result{};
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < N; ++j) {
      for (std::size_t k = 0; k < N; ++k) result[N * i + j] += a[N * i + k] * b[N * k + j];
    }
  }
  return result;
}

/// \returns whether the block is positive definite
bool invert(const Block<1>& a, Block<1>& inverse) {
  inverse[0] = 1 / a[0];
  return a[0] > 0;
}
bool invert(const Block<2>& a, Block<2>& inverse) {
  const double det = a[0] * a[3] - a[1] * a[2], scale = 1 / det;
  inverse = {a[3] * scale, -a[1] * scale, -a[2] * scale, a[0] * scale};
  return det > 0 && a[0] > 0;
}

FlatPoint product(const Block<1>& a, const FlatPoint& p) { return p * a[0]; }
FlatPoint product(const Block<2>& a, const FlatPoint& p) {
  return {a[0] * p.x + a[1] * p.y, a[2] * p.x + a[3] * p.y};
}
FlatPoint transposed_product(const Block<1>& a, const FlatPoint& p) { return p * a[0]; }
FlatPoint transposed_product(const Block<2>& a, const FlatPoint& p) {
  return {a[0] * p.x + a[2] * p.y, a[1] * p.x + a[3] * p.y};
}

}  // namespace

FlatPattern::FlatPattern(const FlatChart& chart) {
  const Lists neighbours = neighbours_of(chart);
  const std::vector<std::uint32_t> order = least_degree(neighbours);
  const auto size = static_cast<std::uint32_t>(order.size());
  place.resize(size);
  for (std::uint32_t p = 0; p < size; ++p) place[order[p]] = p;
  // Rows of the matrix, and of the factor: what is reached from a row's entries by parents (Davis 2005).
  std::vector<std::uint32_t> parent(size, kNoIndex), seen(size, kNoIndex), known(size, 0);
  std::vector<std::uint32_t> below(std::size_t{size} + 1, 0);
  starts.push_back(0);
  row_starts.push_back(0);
  columns.reserve(neighbours.entries.size() / 4 + 2 * std::size_t{size});
  std::vector<std::uint32_t> path, reached(size);
  for (std::uint32_t p = 0; p < size; ++p) {
    std::size_t top = size;
    seen[p] = p;
    for (const std::uint32_t v : neighbours.of(order[p])) {
      std::uint32_t q = place[v];
      if (q > p || known[q] == p + 1) continue;
      known[q] = p + 1;
      columns.push_back(q);
      for (path.clear(); seen[q] != p; q = parent[q]) {
        if (parent[q] == kNoIndex) parent[q] = p;
        seen[q] = p;
        path.push_back(q);
        ++below[q + 1];
      }
      // Before what was reached already, which may depend on it.
      while (!path.empty()) reached[--top] = path.back(), path.pop_back();
    }
    columns.push_back(p);
    starts.push_back(static_cast<std::uint32_t>(columns.size()));
    row_columns.insert(row_columns.end(), reached.begin() + static_cast<std::ptrdiff_t>(top),
                       reached.end());
    row_starts.push_back(static_cast<std::uint32_t>(row_columns.size()));
  }
  std::partial_sum(below.begin(), below.end(), below.begin());
  column_starts = below;
  column_rows.resize(row_columns.size());
  for (std::uint32_t p = 0; p < size; ++p) {
    for (std::uint32_t i = row_starts[p]; i < row_starts[p + 1]; ++i)
      column_rows[below[row_columns[i]]++] = p;
  }
  slots.reserve(chart.triangles.size() * 6);
  for (const Triangle& t : chart.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(place[t[k]], place[t[(k + 1) % 3]]);
      std::uint32_t slot = starts[high];
      while (columns[slot] != low) ++slot;
      slots.push_back(starts[place[t[k]] + 1] - 1);
      slots.push_back(slot);
    }
  }
}

template <std::size_t N>
bool FlatSystem<N>::factorize() {
  const FlatPattern& p = pattern_;
  for (std::uint32_t k = 0; k < p.count(); ++k) filled_[k] = p.column_starts[k];
  for (std::uint32_t k = 0; k < p.count(); ++k) {
    const std::uint32_t last = p.starts[k + 1] - 1;
    for (std::uint32_t e = p.starts[k]; e < last; ++e) row_[p.columns[e]] = values_[e];
    Block own = values_[last];
    for (std::uint32_t e = p.row_starts[k]; e < p.row_starts[k + 1]; ++e) {
      const std::uint32_t i = p.row_columns[e], end = filled_[i]++;
      const Block at = row_[i];
      row_[i] = {};
      for (std::uint32_t f = p.column_starts[i]; f < end; ++f)
        subtract<N>(row_[p.column_rows[f]], at, factor_[f]);
      factor_[end] = product<N>(at, inverse_[i]);
      subtract<N>(own, factor_[end], at);
    }
    if (!invert(own, inverse_[k])) return false;
  }
  return true;
}

template <std::size_t N>
bool FlatSystem<N>::solve(std::vector<FlatPoint>& points) {
  const FlatPattern& p = pattern_;
  points_.resize(p.count());
  for (std::size_t v = 0; v < p.count(); ++v) points_[p.place[v]] = points[v];
  for (std::size_t k = 0; k < p.count(); ++k) {
    const FlatPoint at = points_[k];
    for (std::uint32_t f = p.column_starts[k]; f < p.column_starts[k + 1]; ++f) {
      FlatPoint& to = points_[p.column_rows[f]];
      to = to - product(factor_[f], at);
    }
  }
  for (std::size_t k = p.count(); k-- > 0;) {
    FlatPoint at = product(inverse_[k], points_[k]);
    for (std::uint32_t f = p.column_starts[k]; f < p.column_starts[k + 1]; ++f)
      at = at - transposed_product(factor_[f], points_[p.column_rows[f]]);
    points_[k] = at;
  }
  bool finite = true;
  for (std::size_t v = 0; v < p.count(); ++v) {
    points[v] = points_[p.place[v]];
    finite = finite && std::isfinite(points[v].x) && std::isfinite(points[v].y);
  }
  return finite;
}

template class FlatSystem<1>;
template class FlatSystem<2>;

}  // namespace kiln
