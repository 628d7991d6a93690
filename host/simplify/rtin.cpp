#include "simplify/rtin.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "simplify/heightfield_constraint.h"

namespace kiln {
namespace {

constexpr std::size_t kPointsPerTask = std::size_t{1} << 15;
/// Largest ratio of lattice points to grid points. The lattice is a square, so long strips exceed this ratio.
constexpr std::size_t kMaxLatticeRatio = 8;

/// Heights over a grid of columns (x) and rows (y), stored row by row.
struct Grid {
  std::vector<double> x, y, z;
};

std::vector<double> distinct_values(const std::vector<Vec3d>& points, double Vec3d::*axis) {
  std::vector<double> values(points.size());
  std::transform(points.begin(), points.end(), values.begin(),
                 [axis](const Vec3d& p) { return p.*axis; });
  // Most meshes list vertices row by row, so removing repeated values first makes sorting cheap.
  values.erase(std::unique(values.begin(), values.end()), values.end());
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

/// The grid of heights that a mesh forms; nullopt if the mesh is not a complete grid.
std::optional<Grid> grid_of(const Work& work) {
  Grid grid{distinct_values(work.points, &Vec3d::x), distinct_values(work.points, &Vec3d::y), {}};
  const std::size_t columns = grid.x.size(), rows = grid.y.size();
  if (columns < 2 || rows < 2 || columns * rows != work.points.size() ||
      work.triangles.size() != 2 * (columns - 1) * (rows - 1)) {
    return std::nullopt;
  }
  struct GridCell {
    std::uint32_t column, row;
  };
  std::vector<GridCell> at(work.points.size());
  const auto index = [](const std::vector<double>& values, double value) {
    return static_cast<std::uint32_t>(std::lower_bound(values.begin(), values.end(), value) -
                                      values.begin());
  };
  parallel_for(at.size(), kPointsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      at[i] = {index(grid.x, work.points[i].x), index(grid.y, work.points[i].y)};
    }
  });
  std::vector<std::uint8_t> is_point_used(work.points.size(), 0);
  grid.z.resize(work.points.size());
  for (std::size_t i = 0; i < at.size(); ++i) {
    const std::size_t lattice_index = at[i].row * columns + at[i].column;
    if (std::exchange(is_point_used[lattice_index], 1) != 0) return std::nullopt;
    grid.z[lattice_index] = work.points[i].z;
  }
  // There are two triangles per cell, and each lies within one cell and faces up. So the triangles fill each cell
  // exactly.
  const bool fits =
      std::all_of(work.triangles.begin(), work.triangles.end(), [&](const Triangle& t) {
        const auto [left, right] = std::minmax({at[t[0]].column, at[t[1]].column, at[t[2]].column});
        const auto [bottom, top] = std::minmax({at[t[0]].row, at[t[1]].row, at[t[2]].row});
        return right - left == 1 && top - bottom == 1 &&
               upward_quality(work.points[t[0]], work.points[t[1]], work.points[t[2]]) > 0;
      });
  return fits ? std::optional(std::move(grid)) : std::nullopt;
}

/// The grid's surface, resampled to a square of 2^n x 2^n cells, which recursive halving requires.
class Lattice {
 public:
  static std::size_t cells_for(const Grid& grid) {
    std::size_t cells = 1;
    while (cells + 1 < std::max(grid.x.size(), grid.y.size())) cells *= 2;
    return cells;
  }
  explicit Lattice(const Grid& grid) : cells_(cells_for(grid)) {
    x_ = resample(grid.x);
    y_ = resample(grid.y);
    z_.resize(side() * side());
    const std::size_t columns = grid.x.size();
    parallel_for(side(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j) {
        const auto [row, up] = cell(j, grid.y.size());
        for (std::size_t i = 0; i < side(); ++i) {
          const auto [column, right] = cell(i, columns);
          const double* at = &grid.z[row * columns + column];
          const std::size_t step_right = right > 0 ? 1 : 0, step_up = up > 0 ? columns : 0;
          const double low = at[0] + (at[step_right] - at[0]) * right;
          const double high = at[step_up] + (at[step_up + step_right] - at[step_up]) * right;
          z_[j * side() + i] = low + (high - low) * up;
        }
      }
    });
  }
  std::size_t cells() const { return cells_; }
  std::size_t side() const { return cells_ + 1; }
  double height(std::size_t lattice_index) const { return z_[lattice_index]; }
  Vec3d point(std::size_t lattice_index) const {
    return {x_[lattice_index % side()], y_[lattice_index / side()], z_[lattice_index]};
  }

 private:
  /// The row or column at or before a position in the lattice, and the fraction of the way to the next.
  std::pair<std::size_t, double> cell(std::size_t lattice_index, std::size_t count) const {
    const std::size_t scaled = lattice_index * (count - 1);
    return {scaled / cells_, static_cast<double>(scaled % cells_) / static_cast<double>(cells_)};
  }
  std::vector<double> resample(const std::vector<double>& values) const {
    std::vector<double> result(side());
    for (std::size_t i = 0; i < side(); ++i) {
      const auto [at, on] = cell(i, values.size());
      result[i] = on > 0 ? values[at] + (values[at + 1] - values[at]) * on : values[at];
    }
    return result;
  }

  std::size_t cells_;
  std::vector<double> x_, y_, z_;
};

/// For each lattice point except the corners: the largest height error that remains if no triangle is halved at that
/// point.
std::vector<double> errors_of(const Lattice& lattice) {
  const std::size_t side = lattice.side();
  std::vector<double> errors(side * side, 0);
  // Visits the midpoints of all hypotenuses, from the smallest triangles to the largest. In each size, hypotenuses on
  // sides of squares come first, then those on diagonals.
  for (std::size_t step = 1; step < lattice.cells(); step *= 2) {
    const std::size_t square_size = 2 * step;
    const auto height_error = [&](std::size_t at, std::size_t from, std::size_t to) {
      return std::abs(lattice.height(at) - (lattice.height(from) + lattice.height(to)) / 2);
    };
    // Triangles whose hypotenuse is the side of a square. The hypotenuses of their children have their midpoints in the
    // centres of the adjacent squares of half the size.
    parallel_for(lattice.cells() / step + 1, 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        const std::size_t j = row * step;
        const bool is_upright = row % 2 == 1;
        for (std::size_t i = is_upright ? 0 : step; i < side; i += square_size) {
          const std::size_t at = j * side + i, half_hypotenuse = is_upright ? step * side : step;
          double error = height_error(at, at - half_hypotenuse, at + half_hypotenuse);
          if (step > 1) {
            const std::size_t half = step / 2;
            for (const bool right : {false, true}) {
              for (const bool up : {false, true}) {
                if ((right ? i + half >= side : i < half) || (up ? j + half >= side : j < half))
                  continue;
                error = std::max(
                    error,
                    errors[(up ? j + half : j - half) * side + (right ? i + half : i - half)]);
              }
            }
          }
          errors[at] = error;
        }
      }
    });
    // These diagonals run from the corners of the square of double size to its centre.
    parallel_for(lattice.cells() / square_size, 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        for (std::size_t column = 0; column < lattice.cells() / square_size; ++column) {
          const std::size_t at = (row * square_size + step) * side + column * square_size + step;
          const bool is_rising = (row + column) % 2 == 0;
          const std::size_t half_hypotenuse = is_rising ? step * side + step : step * side - step;
          errors[at] = std::max({height_error(at, at - half_hypotenuse, at + half_hypotenuse),
                                 errors[at - step], errors[at + step], errors[at - step * side],
                                 errors[at + step * side]});
        }
      }
    });
  }
  return errors;
}

/// The error limit with which about `faces` triangles are left. Triangles with a larger error are halved.
double error_limit_for(const std::vector<double>& errors, std::size_t faces, double error) {
  const std::size_t max_halvings =
      faces / 2;  // Each halving adds two triangles, or one at the border
  if (max_halvings >= errors.size()) return std::min(0.0, error);
  std::vector<double> sorted_errors = errors;
  std::nth_element(sorted_errors.begin(),
                   sorted_errors.begin() + static_cast<std::ptrdiff_t>(max_halvings),
                   sorted_errors.end(), std::greater<>());
  return std::min(sorted_errors[max_halvings], error);
}

/// Halves triangles recursively where their error exceeds the limit.
class TriangleHalving {
 public:
  TriangleHalving(const Lattice& lattice, const std::vector<double>& errors, double limit)
      : lattice_(lattice), errors_(errors), limit_(limit), vertex_index_(errors.size(), kNoVertex) {
    const std::size_t last = errors.size() - 1, end = lattice.cells();
    add(last, 0, end);
    add(0, last, last - end);
  }
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;

 private:
  /// Adds a triangle, or its halves.
  /// \param a, b, c  lattice points, counter-clockwise; ab is the hypotenuse, and the right angle is at c
  void add(std::size_t a, std::size_t b, std::size_t c) {
    const std::size_t middle = (a + b) / 2;
    const bool smallest =
        std::max(a, c) - std::min(a, c) == 1 || std::max(a, c) - std::min(a, c) == lattice_.side();
    if (!smallest && errors_[middle] > limit_) {
      add(c, a, middle);
      add(b, c, middle);
      return;
    }
    triangles.push_back({vertex_index(c), vertex_index(a), vertex_index(b)});
  }
  std::uint32_t vertex_index(std::size_t lattice_index) {
    if (vertex_index_[lattice_index] == kNoVertex) {
      vertex_index_[lattice_index] = static_cast<std::uint32_t>(points.size());
      points.push_back(lattice_.point(lattice_index));
    }
    return vertex_index_[lattice_index];
  }

  const Lattice& lattice_;
  const std::vector<double>& errors_;
  double limit_;
  std::vector<std::uint32_t> vertex_index_;
};

}  // namespace

bool simplify_to_rtin(Work& work, std::size_t faces, double error) {
  const std::optional<Grid> grid = grid_of(work);
  if (!grid) return false;
  const std::size_t side = Lattice::cells_for(*grid) + 1;
  if (side * side > kMaxLatticeRatio * work.points.size()) return false;
  const Lattice lattice(*grid);
  const std::vector<double> errors = errors_of(lattice);
  TriangleHalving triangle_halving(lattice, errors, error_limit_for(errors, faces, error));
  work.points = std::move(triangle_halving.points);
  work.triangles = std::move(triangle_halving.triangles);
  work.sources.clear();
  return true;
}

}  // namespace kiln
