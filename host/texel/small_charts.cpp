#include "texel/small_charts.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>
#include <unordered_map>

#include "base/disjoint_sets.h"
#include "base/parallel.h"

namespace kiln {
namespace {

// Maximum distance in texels of an assigned texel from its chart.
constexpr std::int64_t kMaxTexelDistance = 8;
// log2 of a tile's side: tiles of 64 x 64 texels without small charts are skipped
constexpr std::uint32_t kTileShift = 6;
constexpr std::size_t kTrianglesPerTask = 1 << 14;
// Minimum inradius, in samples, of a triangle that certainly covers a sample's centre; any value above sqrt(1/2)
constexpr double kMinCoveringInradius = 0.75;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  const std::int64_t q = a / b;
  return q - (a % b != 0 && (a < 0) != (b < 0) ? 1 : 0);
}

/// Exact range of columns of the samples that a piece covers in a row.
SampleRange covered_column_range(const kiln_texel_piece& piece, std::uint32_t shift,
                                 std::int64_t row, std::int64_t count) {
  SampleRange columns{0, count - 1};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int64_t open = ((piece.closed >> k) & 1U) != 0 ? 0 : 1;
    const std::int64_t step = std::int64_t{piece.a[k]} * (std::int64_t{1} << shift);
    const std::int64_t remainder =
        std::int64_t{piece.b[k]} * row * (std::int64_t{1} << shift) + piece.c[k] - open;
    if (step == 0) {
      if (remainder < 0) return {0, -1};
    } else if (step > 0) {
      columns.first = std::max(columns.first, -floor_div(remainder, step));
    } else {
      columns.last = std::min(columns.last, floor_div(remainder, -step));
    }
  }
  return columns;
}

/// True if the triangle certainly covers the centre of a sample.
bool surely_covers_sample(const FixedPointTriangle& f, const UvGrid& grid) {
  if (grid.is_beyond_square(f)) return false;
  double perimeter = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    perimeter += std::hypot(double{1.0} * f.x[k] - f.x[(k + 1) % 3],
                            double{1.0} * f.y[k] - f.y[(k + 1) % 3]);
  }
  const double area = std::abs(static_cast<double>(doubled_area(f)));
  return area > kMinCoveringInradius * std::ldexp(perimeter, static_cast<int>(grid.shift));
}

/// Hash of a corner's UV and position; corners of equal hashes are one vertex of a chart.
std::uint64_t vertex_hash(const LowSurface::Corner& corner) {
  std::uint64_t key = 0;
  for (const float value :
       {corner.uv.x, corner.uv.y, corner.position.x, corner.position.y, corner.position.z}) {
    key = (key ^ std::bit_cast<std::uint32_t>(value + 0.0F)) * 0x9E3779B97F4A7C15U;
    key ^= key >> 29U;
  }
  return key;
}

/// A UV triangle in texels, with rows downwards.
struct TexelTriangle {
  std::array<double, 3> x{}, y{};

  TexelTriangle(const LowSurface& surface, std::uint32_t triangle, double width, double height) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2& uv = surface.triangles[triangle][k].uv;
      x[k] = uv.x * width;
      y[k] = (1 - double{uv.y}) * height;
    }
  }

  /// Range of x of the triangle between two values of y; empty (minimum above maximum) if the triangle lies
  /// outside.
  std::array<double, 2> x_range_between(double top, double bottom) const {
    double low = kInfinity, high = -kInfinity;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      const double upper = std::min(y[k], y[next]), lower = std::max(y[k], y[next]);
      if (lower < top || upper > bottom) continue;
      for (const double at : {std::max(upper, top), std::min(lower, bottom)}) {
        const double share = y[next] == y[k] ? 0 : (at - y[k]) / (y[next] - y[k]);
        low = std::min(low, x[k] + share * (x[next] - x[k]));
        high = std::max(high, x[k] + share * (x[next] - x[k]));
      }
      if (y[next] == y[k]) {
        low = std::min(low, x[next]);
        high = std::max(high, x[next]);
      }
    }
    return {low, high};
  }

  /// Squared distance from the triangle to a texel's centre.
  double squared_distance(std::int64_t column, std::int64_t row) const {
    const double at_x = static_cast<double>(column) + 0.5, at_y = static_cast<double>(row) + 0.5;
    const auto [u, v] = nearest_weights(x, y, at_x, at_y);
    const double dx = x[0] + u * (x[1] - x[0]) + v * (x[2] - x[0]) - at_x;
    const double dy = y[0] + u * (y[1] - y[0]) + v * (y[2] - y[0]) - at_y;
    return dx * dx + dy * dy;
  }
};

class SmallChartFinder {
 public:
  SmallChartFinder(const LowSurface& surface, const TexelPieces& pieces, std::uint32_t width,
                   std::uint32_t height, std::uint32_t samples)
      : surface_(surface),
        pieces_(pieces),
        width_(width),
        height_(height),
        samples_(samples),
        grid_(UvGrid::of(width * samples, height * samples)) {}

  SmallCharts run() {
    find_uncovered();
    find_charts();
    if (result_.triangles.empty()) return std::move(result_);
    mark_occupied_texels();
    assign_texels();
    return std::move(result_);
  }

 private:
  struct FreeTexel {
    double squared_distance = kInfinity;
    std::int64_t row = 0, column = 0;
    bool found() const { return squared_distance < kInfinity; }
    bool operator<(const FreeTexel& other) const {
      return std::tie(squared_distance, row, column) <
             std::tie(other.squared_distance, other.row, other.column);
    }
  };

  bool covers_any_sample(std::size_t i) const {
    const FixedPointTriangle& f = pieces_.fixed_point_triangles[i];
    if (surely_covers_sample(f, grid_)) return true;
    const SampleRange rows = rows_of(f, pieces_.fraction_bits, height_ * samples_);
    for (std::int64_t row = rows.first; row <= rows.last; ++row) {
      const SampleRange columns = covered_column_range(pieces_.pieces[i], pieces_.fraction_bits,
                                                       row, std::int64_t{width_} * samples_);
      if (columns.first <= columns.last) return true;
    }
    return false;
  }

  /// Finds the triangles that have pieces, but whose pieces cover no sample.
  void find_uncovered() {
    triangle_states_.assign(surface_.triangles.size(), kNoPiece);
    std::vector<std::uint8_t> piece_covers_sample(pieces_.pieces.size());
    parallel_for(piece_covers_sample.size(), kTrianglesPerTask,
                 [&](std::size_t begin, std::size_t end) {
                   for (std::size_t i = begin; i < end; ++i)
                     piece_covers_sample[i] = covers_any_sample(i) ? 1 : 0;
                 });
    for (std::size_t i = 0; i < piece_covers_sample.size(); ++i) {
      std::uint8_t& covers = triangle_states_[pieces_.pieces[i].triangle];
      covers = std::max(covers, piece_covers_sample[i] != 0 ? kCoversSample : kCoversNoSample);
    }
    for (std::uint32_t t = 0; t < triangle_states_.size(); ++t) {
      if (triangle_states_[t] == kCoversNoSample) uncovered_triangles_.push_back(t);
    }
  }

  /// Finds the charts in which no triangle covers a sample.
  void find_charts() {
    if (uncovered_triangles_.empty()) return;
    // vertex index by hash, for corners of uncovered triangles
    std::unordered_map<std::uint64_t, std::uint32_t> at;
    std::vector<std::array<std::uint32_t, 3>> corners;
    at.reserve(3 * uncovered_triangles_.size());
    for (const std::uint32_t t : uncovered_triangles_) {
      std::array<std::uint32_t, 3> corner_vertices{};
      for (std::size_t k = 0; k < 3; ++k) {
        corner_vertices[k] =
            at.emplace(vertex_hash(surface_.triangles[t][k]), static_cast<std::uint32_t>(at.size()))
                .first->second;
      }
      corners.push_back(corner_vertices);
    }
    DisjointSets sets(at.size());
    for (const auto& corner_vertices : corners) {
      sets.join(corner_vertices[0], corner_vertices[1]);
      sets.join(corner_vertices[0], corner_vertices[2]);
    }
    std::vector<std::uint8_t> is_at_covered_triangle(at.size()), touches(at.size());
    parallel_for(triangle_states_.size(), kTrianglesPerTask,
                 [&](std::size_t begin, std::size_t end) {
                   for (std::size_t t = begin; t < end; ++t) {
                     if (triangle_states_[t] != kCoversSample) continue;
                     for (const LowSurface::Corner& corner : surface_.triangles[t]) {
                       const auto found = at.find(vertex_hash(corner));
                       if (found == at.end()) continue;
                       std::atomic_ref<std::uint8_t>(is_at_covered_triangle[found->second])
                           .store(1, std::memory_order_relaxed);
                     }
                   }
                 });
    for (std::uint32_t i = 0; i < is_at_covered_triangle.size(); ++i) {
      if (is_at_covered_triangle[i] != 0) touches[sets.find(i)] = 1;
    }
    std::unordered_map<std::uint32_t, std::uint32_t> chart_of_root;
    for (std::size_t i = 0; i < uncovered_triangles_.size(); ++i) {
      const std::uint32_t root = sets.find(corners[i][0]);
      if (touches[root] != 0) continue;
      const auto chart =
          chart_of_root.emplace(root, static_cast<std::uint32_t>(chart_triangles_.size())).first;
      if (chart->second == chart_triangles_.size()) chart_triangles_.emplace_back();
      chart_triangles_[chart->second].push_back(
          static_cast<std::uint32_t>(result_.triangles.size()));
      result_.triangles.push_back(uncovered_triangles_[i]);
      texel_triangles_.emplace_back(surface_, uncovered_triangles_[i], width_, height_);
    }
  }

  std::size_t tile_index(std::int64_t column, std::int64_t row) const {
    return static_cast<std::size_t>((row >> kTileShift) * tiles_across_ + (column >> kTileShift));
  }

  /// Calls `visit(column, row)` for the map's texels within `reach` texels of a triangle, and for a few
  /// that are slightly farther away; with reach 0 only for the texels that overlap the triangle.
  template <class Visit>
  void for_each_texel_near(const TexelTriangle& outline, std::int64_t reach,
                           const Visit& visit) const {
    const auto [top, bottom] = std::minmax({outline.y[0], outline.y[1], outline.y[2]});
    const auto to_texel = [](double x, std::uint32_t size) {
      return static_cast<std::int64_t>(std::clamp(x, -16.0, size + 16.0));
    };
    const std::int64_t first = to_texel(std::floor(top), height_) - reach;
    const std::int64_t last = to_texel(std::ceil(bottom), height_) - 1 + reach;
    for (std::int64_t row = std::max<std::int64_t>(first, 0);
         row <= std::min<std::int64_t>(last, std::int64_t{height_} - 1); ++row) {
      const auto [low, high] = outline.x_range_between(static_cast<double>(row - reach),
                                                       static_cast<double>(row + reach + 1));
      if (low > high) continue;
      const std::int64_t left = to_texel(std::floor(low), width_) - reach;
      const std::int64_t right = to_texel(std::ceil(high), width_) - 1 + reach;
      for (std::int64_t column = std::max<std::int64_t>(left, 0);
           column <= std::min<std::int64_t>(right, std::int64_t{width_} - 1); ++column) {
        visit(column, row);
      }
    }
  }

  /// Marks the texels near small charts that have a covered sample as occupied.
  void mark_occupied_texels() {
    tiles_across_ = (std::int64_t{width_} >> kTileShift) + 1;
    is_tile_used_.assign(
        tile_index(0, std::int64_t{height_}) + static_cast<std::size_t>(tiles_across_), 0);
    for (const TexelTriangle& outline : texel_triangles_) {
      for_each_texel_near(outline, kMaxTexelDistance, [&](std::int64_t column, std::int64_t row) {
        is_tile_used_[tile_index(column, row)] = 1;
      });
    }
    is_occupied_.assign(std::size_t{width_} * height_, false);
    const auto samples = std::int64_t{samples_};
    for (std::size_t i = 0; i < pieces_.pieces.size(); ++i) {
      const FixedPointTriangle& f = pieces_.fixed_point_triangles[i];
      const SampleRange rows = rows_of(f, pieces_.fraction_bits, height_ * samples_);
      const auto [low, high] = std::minmax_element(f.x.begin(), f.x.end());
      const std::int64_t texel = samples << pieces_.fraction_bits;
      const auto tile = [&](std::int64_t column) {
        return std::clamp<std::int64_t>(column, 0, std::int64_t{width_} - 1) >> kTileShift;
      };
      const std::int64_t left = tile(floor_div(*low, texel)), right = tile(floor_div(*high, texel));
      for (std::int64_t row = rows.first; row <= rows.last; ++row) {
        const auto first =
            is_tile_used_.begin() + static_cast<std::ptrdiff_t>(tile_index(0, row / samples));
        if (std::find(first + left, first + right + 1, 1) == first + right + 1) {
          // Continues with the next row of tiles.
          row = ((row / samples >> kTileShift) + 1) * (samples << kTileShift) - 1;
          continue;
        }
        const SampleRange columns = covered_column_range(pieces_.pieces[i], pieces_.fraction_bits,
                                                         row, std::int64_t{width_} * samples);
        if (columns.first > columns.last) continue;
        const auto line =
            is_occupied_.begin() + static_cast<std::ptrdiff_t>(row / samples * width_);
        std::fill(line + columns.first / samples, line + columns.last / samples + 1, true);
      }
    }
  }

  std::size_t texel_index(std::int64_t column, std::int64_t row) const {
    return static_cast<std::size_t>(row * std::int64_t{width_} + column);
  }

  void assign_texel(std::uint32_t small_index, const FreeTexel& place) {
    is_occupied_[texel_index(place.column, place.row)] = true;
    has_texel_[small_index] = 1;
    result_.texels.push_back({static_cast<std::uint32_t>(place.column),
                              static_cast<std::uint32_t>(place.row),
                              result_.triangles[small_index]});
  }

  /// Finds the free texel with the nearest centre.
  FreeTexel nearest_free_texel(const TexelTriangle& outline) const {
    FreeTexel best;
    for (std::int64_t reach = 1; reach <= kMaxTexelDistance; reach *= 2) {
      for_each_texel_near(outline, reach, [&](std::int64_t column, std::int64_t row) {
        if (is_occupied_[texel_index(column, row)]) return;
        best = std::min(best, FreeTexel{outline.squared_distance(column, row), row, column});
      });
      // Texels that were not visited have centres more than `reach` + 1/2 texels away.
      const double certain_distance = static_cast<double>(reach) + 0.5;
      if (best.squared_distance <= certain_distance * certain_distance) break;
    }
    const double max_distance = static_cast<double>(kMaxTexelDistance);
    return best.squared_distance <= max_distance * max_distance ? best : FreeTexel{};
  }

  void assign_texels() {
    has_texel_.assign(texel_triangles_.size(), 0);
    search_failed_.assign(texel_triangles_.size(), 0);
    for (const std::vector<std::uint32_t>& chart : chart_triangles_) {
      FreeTexel best;
      std::uint32_t owner = 0;
      for (const std::uint32_t small : chart) {
        const FreeTexel place = nearest_free_texel(texel_triangles_[small]);
        search_failed_[small] = place.found() ? 0 : 1;
        if (!(place < best)) continue;
        best = place;
        owner = small;
      }
      if (best.found()) assign_texel(owner, best);
    }
    assign_overlapped_texels();
    for (std::uint32_t small = 0; small < texel_triangles_.size(); ++small) {
      if (has_texel_[small] != 0) continue;
      // A search that failed is not repeated, since texels never become free again.
      const FreeTexel place =
          search_failed_[small] != 0 ? FreeTexel{} : nearest_free_texel(texel_triangles_[small]);
      if (place.found()) {
        assign_texel(small, place);
      } else {
        result_.triangles_without_texel.push_back(result_.triangles[small]);
      }
    }
    std::sort(result_.texels.begin(), result_.texels.end(),
              [](const AssignedTexel& a, const AssignedTexel& b) {
                return std::tie(a.row, a.column) < std::tie(b.row, b.column);
              });
  }

  void assign_overlapped_texels() {
    struct OverlappedTexel {
      std::size_t texel;
      double squared_distance;
      std::uint32_t small;
    };
    std::vector<OverlappedTexel> overlapped_texels;
    for (std::uint32_t small_index = 0; small_index < texel_triangles_.size(); ++small_index) {
      for_each_texel_near(
          texel_triangles_[small_index], 0, [&](std::int64_t column, std::int64_t row) {
            const std::size_t texel = texel_index(column, row);
            if (is_occupied_[texel]) return;
            overlapped_texels.push_back(
                {texel, texel_triangles_[small_index].squared_distance(column, row), small_index});
          });
    }
    std::sort(overlapped_texels.begin(), overlapped_texels.end(),
              [](const OverlappedTexel& a, const OverlappedTexel& b) {
                return std::tie(a.texel, a.squared_distance, a.small) <
                       std::tie(b.texel, b.squared_distance, b.small);
              });
    for (const auto& [texel, squared_distance, small_index] : overlapped_texels) {
      if (is_occupied_[texel]) continue;
      assign_texel(small_index, {squared_distance, static_cast<std::int64_t>(texel / width_),
                                 static_cast<std::int64_t>(texel % width_)});
    }
  }

  static constexpr std::uint8_t kNoPiece = 0, kCoversNoSample = 1, kCoversSample = 2;

  const LowSurface& surface_;
  const TexelPieces& pieces_;
  std::uint32_t width_, height_, samples_;
  UvGrid grid_;
  SmallCharts result_;
  // For each triangle, whether it covers a sample, covers none, or has no piece
  std::vector<std::uint8_t> triangle_states_;
  std::vector<std::uint32_t> uncovered_triangles_;
  // The triangles of result_.triangles, in texels
  std::vector<TexelTriangle> texel_triangles_;
  std::vector<std::vector<std::uint32_t>> chart_triangles_;  // indices into result_.triangles
  std::vector<std::uint8_t> has_texel_, search_failed_;
  std::int64_t tiles_across_ = 0;
  std::vector<std::uint8_t> is_tile_used_;  // For each tile, 1 if a small chart may overlap it
  std::vector<bool> is_occupied_;           // Texels that have a covered sample or are assigned
};

}  // namespace

SmallCharts SmallCharts::of(const LowSurface& surface, const TexelPieces& pieces,
                            std::uint32_t width, std::uint32_t height, std::uint32_t samples) {
  return SmallChartFinder(surface, pieces, width, height, samples).run();
}

}  // namespace kiln
