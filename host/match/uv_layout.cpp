#include <algorithm>
#include <array>

#include "base/option.h"
#include "base/parallel.h"
#include "match/uv.h"
#include "mesh/uv_grid.h"
#include "source/high_poly_uvs.h"

namespace kiln {
namespace {

constexpr std::uint32_t kLayoutTile = KILN_UV_TILE;

void check_uvs(const Source::Impl& source) {
  if (has_uvs(source)) return;
  throw Error(ErrorCode::input, "The high poly has no UVs, which " + option("match.method", "uv") +
                                    " finds its points by: give it the low "
                                    "poly's layout, or use another match, such as ray.");
}

/// Makes the pieces of a range of triangles.
struct PieceBuilder {
  const Source::Impl& source;
  UvGrid grid;
  std::vector<kiln_uv_piece> pieces;
  std::vector<kiln_uv_clip> clips;
  std::uint64_t outside = 0, without_area = 0;

  void add(std::uint32_t t) {
    std::array<Vec2, 3> uvs;
    bool usable = true;
    for (std::size_t k = 0; k < 3; ++k) {
      uvs[k] = source.uvs[source.uv_triangles[t][k]];
      usable = usable && is_finite(uvs[k]) && is_finite(source.positions[source.triangles[t][k]]);
    }
    if (!usable) {
      ++without_area;
      return;
    }
    if (in_prism(uvs[0]) && in_prism(uvs[1]) && in_prism(uvs[2])) {
      FixedPointTriangle fixed_triangle;
      for (std::size_t k = 0; k < 3; ++k) {
        fixed_triangle.x[k] = grid.fixed_x(uvs[k].x);
        fixed_triangle.y[k] = grid.fixed_y(uvs[k].y);
      }
      if (doubled_area(fixed_triangle) == 0) {
        ++without_area;
        return;
      }
      if (grid.is_beyond_square(fixed_triangle)) ++outside;
      add_piece(fixed_triangle, t, 0);
      return;
    }
    ++outside;
    const std::vector<ClipVertex> polygon = clip_to_prism(uvs);
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      const std::array<ClipVertex, 3> fan{polygon[0], polygon[i - 1], polygon[i]};
      FixedPointTriangle fixed_triangle;
      kiln_uv_clip clip{};
      for (std::size_t k = 0; k < 3; ++k) {
        fixed_triangle.x[k] = grid.fixed_x(fan[k].u);
        fixed_triangle.y[k] = grid.fixed_y(fan[k].v);
        clip.weight1[k] = static_cast<float>(fan[k].weight[1]);
        clip.weight2[k] = static_cast<float>(fan[k].weight[2]);
      }
      if (doubled_area(fixed_triangle) == 0 || grid.is_outside_square(fixed_triangle)) continue;
      clips.push_back(clip);
      add_piece(fixed_triangle, t, static_cast<std::uint32_t>(clips.size()));
    }
  }

  void add_piece(const FixedPointTriangle& fixed, std::uint32_t t, std::uint32_t clip) {
    if (grid.is_outside_square(fixed)) return;
    kiln_uv_piece uv_piece{};
    std::copy(fixed.x.begin(), fixed.x.end(), uv_piece.x);
    std::copy(fixed.y.begin(), fixed.y.end(), uv_piece.y);
    uv_piece.triangle = t;
    uv_piece.clip = clip;
    pieces.push_back(uv_piece);
  }
};

/// Calls add(task) for the tiles of a piece, row by row.
template <typename Add>
void for_each_task(const kiln_uv_piece& uv_piece, std::uint32_t index, const UvGrid& grid,
                   const Add& add) {
  const auto [x_low, x_high] = std::minmax_element(uv_piece.x, uv_piece.x + 3);
  const auto [y_low, y_high] = std::minmax_element(uv_piece.y, uv_piece.y + 3);
  const SampleRange columns = samples_within(*x_low, *x_high, grid.shift, grid.sample_width);
  const SampleRange rows = samples_within(*y_low, *y_high, grid.shift, grid.sample_height);
  constexpr auto kTileSide = std::int64_t{kLayoutTile};
  for (std::int64_t y = rows.first; y <= rows.last;) {
    const std::int64_t y_end = std::min((y / kTileSide + 1) * kTileSide, rows.last + 1);
    for (std::int64_t x = columns.first; x <= columns.last; x += kTileSide) {
      const std::int64_t x_end = std::min(x + kTileSide, columns.last + 1);
      add(kiln_uv_task{index, static_cast<kiln_int>(x), static_cast<kiln_int>(y),
                       static_cast<std::uint32_t>(x_end - x) | static_cast<std::uint32_t>(y_end - y)
                                                                   << 16});
    }
    y = y_end;
  }
}

}  // namespace

UvLayout UvLayout::of(const Source::Impl& source, std::uint32_t sample_width,
                      std::uint32_t sample_height) {
  check_uvs(source);
  const PieceBuilder empty_builder{source, UvGrid::of(sample_width, sample_height), {}, {}};
  constexpr std::size_t kTrianglesPerRun = 1 << 14;
  const std::size_t count = source.triangles.size();
  std::vector<PieceBuilder> runs((count + kTrianglesPerRun - 1) / kTrianglesPerRun, empty_builder);
  parallel_for(runs.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      const std::size_t last = std::min(count, (r + 1) * kTrianglesPerRun);
      for (std::size_t t = r * kTrianglesPerRun; t < last; ++t)
        runs[r].add(static_cast<std::uint32_t>(t));
    }
  });

  UvLayout layout;
  layout.shift = empty_builder.grid.shift;
  for (PieceBuilder& run : runs) {
    const auto offset = static_cast<std::uint32_t>(layout.clips.size());
    for (kiln_uv_piece& uv_piece : run.pieces) {
      if (uv_piece.clip != 0) uv_piece.clip += offset;
    }
    layout.pieces.insert(layout.pieces.end(), run.pieces.begin(), run.pieces.end());
    layout.clips.insert(layout.clips.end(), run.clips.begin(), run.clips.end());
    layout.outside += run.outside;
    layout.without_area += run.without_area;
    run.pieces = {};
    run.clips = {};
  }

  // Sorts the tasks by runs of rows, with a counting sort.
  const std::size_t row_runs = (sample_height + kLayoutTile - 1) / kLayoutTile;
  layout.first_task.assign(row_runs + 1, 0);
  const auto for_all = [&](const auto& add) {
    for (std::size_t i = 0; i < layout.pieces.size(); ++i) {
      for_each_task(layout.pieces[i], static_cast<std::uint32_t>(i), empty_builder.grid, add);
    }
  };
  for_all([&](const kiln_uv_task& task) {
    ++layout.first_task[static_cast<std::uint32_t>(task.y) / kLayoutTile + 1];
  });
  for (std::size_t i = 0; i < row_runs; ++i) layout.first_task[i + 1] += layout.first_task[i];
  layout.tasks.resize(layout.first_task[row_runs]);
  std::vector<std::uint32_t> cursor(layout.first_task.begin(), layout.first_task.end() - 1);
  for_all([&](const kiln_uv_task& task) {
    layout.tasks[cursor[static_cast<std::uint32_t>(task.y) / kLayoutTile]++] = task;
  });
  return layout;
}

}  // namespace kiln
