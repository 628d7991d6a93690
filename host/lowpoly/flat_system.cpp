#include "lowpoly/flat_system.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "base/two.h"
#include "lowpoly/pairing.h"

namespace kiln {
namespace {

Two load_two(const double* from) {
  Two value;
  std::memcpy(&value, from, sizeof value);
  return value;
}
void store_two(double* to, Two value) { std::memcpy(to, &value, sizeof value); }
Two both(double value) { return Two{value, value}; }

/// Edges by their higher end, in its list the lower ones, from the lowest up.
struct EdgeLists {
  std::vector<std::uint32_t> first, low;

  /// \param each  calls a function with both ends of every edge, once or more often; again, the same
  template <typename Each>
  EdgeLists(std::size_t count, const Each& each) : first(count + 1, 0) {
    each([&](std::uint32_t a, std::uint32_t b) { ++first[std::max(a, b)]; });
    std::uint32_t sum = 0;
    for (std::uint32_t& f : first) f = sum += f;
    low.resize(sum);
    each([&](std::uint32_t a, std::uint32_t b) { low[--first[std::max(a, b)]] = std::min(a, b); });
    std::uint32_t kept = 0;
    for (std::size_t v = 0; v < count; ++v) {
      const auto begin = low.begin() + first[v], end = low.begin() + first[v + 1];
      std::sort(begin, end);
      first[v] = kept;
      for (auto at = begin; at != end; ++at) {
        if (kept == first[v] || low[kept - 1] != *at) low[kept++] = *at;
      }
    }
    first[count] = kept;
    low.resize(kept);
  }

  /// The place of an edge that there is.
  std::uint32_t find(std::uint32_t a, std::uint32_t b) const {
    std::uint32_t e = first[std::max(a, b)];
    while (low[e] != std::min(a, b)) ++e;
    return e;
  }
};

/// The place of each vertex in Eigen's order of least degree.
std::vector<std::uint32_t> least_degree(const EdgeLists& edges) {
  const std::size_t count = edges.first.size() - 1;
  const auto size = static_cast<Eigen::Index>(count);
  Eigen::SparseMatrix<double> upper(size, size);
  upper.reserve(static_cast<Eigen::Index>(count + edges.low.size()));
  for (std::size_t v = 0; v < count; ++v) {
    const auto column = static_cast<Eigen::Index>(v);
    upper.startVec(column);
    for (std::uint32_t e = edges.first[v]; e < edges.first[v + 1]; ++e)
      upper.insertBack(edges.low[e], column) = 1;
    upper.insertBack(column, column) = 1;
  }
  upper.finalize();
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>()(upper.selfadjointView<Eigen::Upper>(), order);
  std::vector<std::uint32_t> place(count);
  for (std::size_t p = 0; p < count; ++p) {
    place[static_cast<std::size_t>(order.indices()[static_cast<Eigen::Index>(p)])] =
        static_cast<std::uint32_t>(p);
  }
  return place;
}

}  // namespace

FlatPattern::FlatPattern(const FlatChart& chart) {
  const std::size_t count = chart.points.size();
  const EdgeLists given(count, [&](const auto& add) {
    for (const Triangle& t : chart.triangles) {
      for (std::size_t k = 0; k < 3; ++k) add(t[k], t[(k + 1) % 3]);
    }
  });
  place = least_degree(given);
  EdgeLists edges(count, [&](const auto& add) {
    for (std::size_t v = 0; v < count; ++v) {
      for (std::uint32_t e = given.first[v]; e < given.first[v + 1]; ++e)
        add(place[v], place[given.low[e]]);
    }
  });
  slots.reserve(chart.triangles.size() * 6);
  for (const Triangle& t : chart.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t p = place[t[k]];
      slots.push_back(p);
      slots.push_back(static_cast<std::uint32_t>(count) + edges.find(p, place[t[(k + 1) % 3]]));
    }
  }
  first = std::move(edges.first);
  low = std::move(edges.low);
  find_factors();
}

/// Where L is not zero (Davis, "Direct Methods for Sparse Linear Systems", 2006, chapter 4): of each row the
/// columns on the ways up the elimination tree from the matrix's.
void FlatPattern::find_factors() {
  const auto count = static_cast<std::uint32_t>(place.size());
  std::vector<std::uint32_t> parent(count, kNoIndex), seen(count, kNoIndex);
  column_first.assign(count + 1, 0);
  row_first.assign(1, 0);
  row_first.reserve(count + 1);
  row.reserve(4 * low.size());
  for (std::uint32_t k = 0; k < count; ++k) {
    seen[k] = k;
    const auto begin = static_cast<std::ptrdiff_t>(row.size());
    for (std::uint32_t e = first[k]; e < first[k + 1]; ++e) {
      const auto way = static_cast<std::ptrdiff_t>(row.size());
      for (std::uint32_t i = low[e]; seen[i] != k; i = parent[i]) {
        if (parent[i] == kNoIndex) parent[i] = k;
        seen[i] = k;
        row.push_back(i);
        ++column_first[i + 1];
      }
      std::reverse(row.begin() + way, row.end());
    }
    // A later way may lead to an earlier one, and so goes before it.
    std::reverse(row.begin() + begin, row.end());
    row_first.push_back(static_cast<std::uint32_t>(row.size()));
  }
  for (std::uint32_t k = 0; k < count; ++k) column_first[k + 1] += column_first[k];
  column.resize(row.size());
  std::vector<std::uint32_t> end(column_first.begin(), column_first.end() - 1);
  for (std::uint32_t k = 0; k < count; ++k) {
    for (std::uint32_t n = row_first[k]; n < row_first[k + 1]; ++n) column[end[row[n]]++] = k;
  }
}

template <int N>
FlatSystem<N>::FlatSystem(std::shared_ptr<const FlatPattern> pattern)
    : pattern_(std::move(pattern)),
      blocks_(pattern_->place.size() + pattern_->low.size()),
      lower_(pattern_->row.size()),
      pivots_(pattern_->place.size()) {}

/// Row by row, each by a sparse triangular solve.
template <int N>
bool FlatSystem<N>::factorize() {
  const std::vector<std::uint32_t>&first = pattern_->first, &low = pattern_->low,
        &row_first = pattern_->row_first, &row = pattern_->row,
        &column_first = pattern_->column_first, &column = pattern_->column;
  const auto count = static_cast<std::uint32_t>(pivots_.size());
  open_.assign(count, Block{});
  column_end_.assign(column_first.begin(), column_first.end() - 1);
  for (std::uint32_t k = 0; k < count; ++k) {
    for (std::uint32_t e = first[k]; e < first[k + 1]; ++e) open_[low[e]] = blocks_[count + e];
    const Block& own = blocks_[k];
    Pivot& pivot = pivots_[k];
    if constexpr (N == 1) {
      double d = own[0];
      for (std::uint32_t n = row_first[k]; n < row_first[k + 1]; ++n) {
        const std::uint32_t i = row[n], end = column_end_[i]++;
        const double y = std::exchange(open_[i][0], 0);
        for (std::uint32_t p = column_first[i]; p < end; ++p)
          open_[column[p]][0] -= lower_[p][0] * y;
        const double l = y / pivots_[i].d[0];
        d -= l * y;
        lower_[end][0] = l;
      }
      pivot.d[0] = d;
    } else {
      // Both rows of the block at once; then the lower one by the upper.
      Two d{own[0], own[3]};
      double between = own[1];
      for (std::uint32_t n = row_first[k]; n < row_first[k + 1]; ++n) {
        const std::uint32_t i = row[n], end = column_end_[i]++;
        double* const y = open_[i].data();
        const Two upper = load_two(y), lower = load_two(y + 2) - both(pivots_[i].between) * upper;
        open_[i] = {};
        for (std::uint32_t p = column_first[i]; p < end; ++p) {
          const double* const l = lower_[p].data();
          double* const to = open_[column[p]].data();
          store_two(to, load_two(to) - both(l[0]) * upper - both(l[2]) * lower);
          store_two(to + 2, load_two(to + 2) - both(l[1]) * upper - both(l[3]) * lower);
        }
        const Two left = upper / both(pivots_[i].d[0]), right = lower / both(pivots_[i].d[1]);
        d = d - left * upper - right * lower;
        between = between - left[0] * upper[1] - right[0] * lower[1];
        store_two(lower_[end].data(), left);
        store_two(lower_[end].data() + 2, right);
      }
      pivot.between = between / d[0];
      pivot.d = {d[0], d[1] - pivot.between * between};
    }
    for (const double d : pivot.d) {
      if (!(d > 0)) return false;
    }
  }
  return true;
}

template <int N>
bool FlatSystem<N>::solve(std::vector<FlatPoint>& points) {
  const std::vector<std::uint32_t>&place = pattern_->place, &column_first = pattern_->column_first,
        &column = pattern_->column;
  const std::size_t count = place.size();
  right_.resize(2 * count);
  double* const x = right_.data();
  for (std::size_t v = 0; v < count; ++v) {
    double* const p = x + std::size_t{2} * place[v];
    p[0] = points[v].x;
    p[1] = points[v].y;
  }
  for (std::size_t i = 0; i < count; ++i) {
    double* const own = x + 2 * i;
    if constexpr (N == 2) own[1] -= pivots_[i].between * own[0];
    const Two at = load_two(own);
    for (std::uint32_t p = column_first[i]; p < column_first[i + 1]; ++p) {
      double* const to = x + std::size_t{2} * column[p];
      const double* const l = lower_[p].data();
      if constexpr (N == 1) {
        store_two(to, load_two(to) - both(l[0]) * at);
      } else {
        store_two(to, load_two(to) - load_two(l) * both(at[0]) - load_two(l + 2) * both(at[1]));
      }
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    x[2 * i] *= 1 / pivots_[i].d[0];
    x[2 * i + 1] *= 1 / pivots_[i].d[N - 1];
  }
  for (std::size_t i = count; i-- > 0;) {
    double* const own = x + 2 * i;
    const std::uint32_t begin = column_first[i], end = column_first[i + 1];
    if constexpr (N == 1) {
      Two at = load_two(own);
      for (std::uint32_t p = begin; p < end; ++p)
        at = at - both(lower_[p][0]) * load_two(x + std::size_t{2} * column[p]);
      store_two(own, at);
    } else {
      for (const std::size_t half : {1, 0}) {
        double at = own[half];
        if (half == 0) at -= pivots_[i].between * own[1];
        for (std::uint32_t p = begin; p < end; ++p) {
          const double* const from = x + std::size_t{2} * column[p];
          const double* const l = lower_[p].data() + 2 * half;
          at = at - l[0] * from[0] - l[1] * from[1];
        }
        own[half] = at;
      }
    }
  }
  for (std::size_t v = 0; v < count; ++v) {
    const double* const p = x + std::size_t{2} * place[v];
    points[v] = {p[0], p[1]};
  }
  return std::all_of(right_.begin(), right_.end(),
                     [](double value) { return std::isfinite(value); });
}

template class FlatSystem<1>;
template class FlatSystem<2>;

}  // namespace kiln
