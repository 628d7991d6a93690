#include "volume/normal_splat.h"

#include <algorithm>
#include <numeric>
#include <span>

#include "base/parallel.h"
#include "mesh/frame.h"
#include "mesh/low_shading.h"
#include "mesh/low_surface.h"
#include "volume/seams.h"

namespace kiln {
namespace {

template <typename Vector>
auto view(const Vector& vector) {
  return std::span<const typename Vector::value_type>(vector.data(), vector.size());
}

/// Memory layout of the mip pyramids of all charts.
struct ChartPyramids {
  struct PyramidLevel {
    std::vector<std::uint32_t> row_charts, first_rows;
  };
  std::vector<PyramidLevel> levels;
  // Index of the first texel of each chart at each level
  std::vector<std::uint32_t> chart_first_texels;
  std::uint64_t texels = 0;
};

ChartPyramids make_pyramids(const Atlas& atlas) {
  ChartPyramids result;
  const std::size_t charts = atlas.charts.size();
  for (std::uint32_t level = 0;; ++level) {
    ChartPyramids::PyramidLevel rows;
    rows.first_rows.resize(charts);
    const auto side = [&](std::uint32_t texels) { return (texels + (1U << level) - 1) >> level; };
    result.chart_first_texels.resize((level + 1) * charts);
    for (std::size_t i = 0; i < charts; ++i) {
      const kiln_volume_chart& chart = atlas.charts[i];
      rows.first_rows[i] = static_cast<std::uint32_t>(rows.row_charts.size());
      // A chart's pyramid ends with the level of 1 x 1 texels.
      if (level > 0 &&
          (std::max(chart.size[0], chart.size[1]) + (1U << (level - 1)) - 1) >> (level - 1) == 1) {
        continue;
      }
      result.chart_first_texels[level * charts + i] = static_cast<std::uint32_t>(result.texels);
      result.texels += std::uint64_t{side(chart.size[0])} * side(chart.size[1]);
      rows.row_charts.insert(rows.row_charts.end(), side(chart.size[1]),
                             static_cast<std::uint32_t>(i));
    }
    if (rows.row_charts.empty()) return result;
    result.levels.push_back(std::move(rows));
  }
}

/// Texels of all charts on the device, one float4 each.
class DeviceCharts {
 public:
  DeviceCharts(cl::Context& context, const Atlas& atlas, const ChartPyramids& chart_pyramids,
               const kiln_volume_level& kernel_params)
      : context_(context),
        atlas_(atlas),
        pyramids_(chart_pyramids),
        kernel_params_(kernel_params),
        charts_(context, view(atlas.charts)),
        first_texels_(context, view(chart_pyramids.chart_first_texels)),
        texels_(context, 4 * chart_pyramids.texels) {
    for (const ChartPyramids::PyramidLevel& level : chart_pyramids.levels) {
      level_rows_.push_back({cl::Array<std::uint32_t>(context, view(level.row_charts)),
                             cl::Array<std::uint32_t>(context, view(level.first_rows))});
    }
  }

  /// \returns the number of texels that contain fine vertices
  std::uint64_t splat_fine_vertices(const FineSurface& surface,
                                    const SimplifiedIsosurface& low_poly) {
    const cl::Array<kiln_volume_vertex> vertices(context_, view(surface.vertices));
    const cl::Array<std::uint32_t> begins(context_, view(low_poly.leaf_begins));
    const cl::Array<std::uint32_t> leaves(context_, view(low_poly.leaves));
    const cl::Array<float> normals(
        context_, std::span<const float>(&low_poly.normals[0].x, 3 * low_poly.normals.size()));
    const cl::Array<std::uint32_t> fine_vertex_counts(context_, atlas_.charts.size());
    context_.launch(context_.kernel("volume_map", "kiln_volume_map_splat"), kernel_params_.charts,
                    kLocal, kernel_params_, charts_, begins, leaves, vertices, normals, texels_,
                    fine_vertex_counts);
    const std::vector<std::uint32_t> known = fine_vertex_counts.download(context_);
    return std::accumulate(known.begin(), known.end(), std::uint64_t{0});
  }
  /// Runs a kernel over all rows of a level.
  /// \param middle  kernel arguments that are passed after the parameters and before the texels
  template <typename... Middle>
  void run(const char* family, const char* name, std::uint32_t level, const Middle&... middle) {
    kernel_params_.level = level;
    kernel_params_.rows = static_cast<std::uint32_t>(pyramids_.levels[level].row_charts.size());
    context_.launch(context_.kernel(family, name), kernel_params_.rows, kLocal, kernel_params_,
                    charts_, level_rows_[level].row_charts, level_rows_[level].first_rows,
                    middle..., texels_);
  }
  /// Fills texels without fine vertices by push-pull.
  void fill() {
    const std::uint32_t last = levels();
    for (std::uint32_t level = 1; level < last; ++level) {
      run("volume_map", "kiln_volume_map_push", level, first_texels_);
    }
    for (std::uint32_t level = last - 1; level-- > 0;) {
      run("volume_map", "kiln_volume_map_pull", level, first_texels_);
    }
  }
  /// Gives charts with a common edge the same normals along it.
  /// \param vertices  number of the low poly's vertices
  void join_seams(std::size_t vertices) {
    const ChartAdjacency chart_adjacency = find_chart_adjacency(atlas_.charts, vertices);
    const std::size_t corners = chart_adjacency.edges.size();
    const cl::Array<float> ring(context_, 4 * atlas_.ring_texels);
    {
      const cl::Array<std::uint32_t> corner_begins(context_, view(chart_adjacency.corner_begins));
      const cl::Array<std::uint32_t> corner_members(context_, view(chart_adjacency.corner_members));
      const cl::Array<std::uint32_t> edges(context_, view(chart_adjacency.edges));
      const cl::Array<std::uint32_t> edge_begins(context_, view(chart_adjacency.edge_begins));
      const cl::Array<std::uint32_t> edge_members(context_, view(chart_adjacency.edge_members));
      const cl::Array<float> corner_averages(context_, 4 * corners);
      context_.launch(context_.kernel("volume_seam", "kiln_volume_seam_average_corners"), corners,
                      kLocal, kernel_params_, charts_, corner_begins, corner_members, texels_,
                      corner_averages);
      context_.launch(context_.kernel("volume_seam", "kiln_volume_seam_average_sides"), corners,
                      kLocal, kernel_params_, charts_, edges, edge_begins, edge_members,
                      corner_averages, texels_, ring);
      context_.finish();
    }
    run("volume_seam", "kiln_volume_seam_gather", 1, first_texels_, ring);
    // Levels coarser than the width of the band along seams contribute nothing and are skipped
    // (seam_compute_fade in volume_seam.cl).
    std::uint32_t last = levels();
    while (last > 2 && static_cast<float>(1U << (last - 1)) >= 2 * kernel_params_.reach) --last;
    for (std::uint32_t level = 2; level < last; ++level) {
      run("volume_seam", "kiln_volume_seam_push", level, first_texels_);
    }
    for (std::uint32_t level = last - 1; level-- > 1;) {
      run("volume_seam", "kiln_volume_seam_pull", level, first_texels_);
    }
    run("volume_seam", "kiln_volume_seam_finish", 0, first_texels_, ring);
    context_.launch(context_.kernel("volume_seam", "kiln_volume_seam_mirror"),
                    kernel_params_.charts, kLocal, kernel_params_, charts_, texels_);
    context_.finish();
  }
  /// Downloads the texels of the finest level.
  RawVector<float> download(std::uint64_t texels) const {
    RawVector<float> values(4 * texels);
    texels_.read(context_, values);
    return values;
  }

 private:
  std::uint32_t levels() const { return static_cast<std::uint32_t>(pyramids_.levels.size()); }

  struct Rows {
    cl::Array<std::uint32_t> row_charts, first_rows;
  };
  cl::Context& context_;
  const Atlas& atlas_;
  const ChartPyramids& pyramids_;
  kiln_volume_level kernel_params_;
  cl::Array<kiln_volume_chart> charts_;
  cl::Array<std::uint32_t> first_texels_;
  cl::Array<float> texels_;
  std::vector<Rows> level_rows_;
};

/// Copies the charts to their positions in the map.
/// \param flat  value of the first two channels outside of charts
Image compose_map(const RawVector<float>& values, const Atlas& atlas, std::uint32_t size,
                  float flat) {
  Image image;
  image.width = image.height = size;
  image.channels = 3;
  const std::size_t count = std::size_t{size} * size;
  image.pixels.resize(3 * count);
  parallel_for(count, 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      image.pixels[3 * i] = image.pixels[3 * i + 1] = flat;
      image.pixels[3 * i + 2] = 1;
    }
  });
  parallel_for(atlas.charts.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const kiln_volume_chart& chart = atlas.charts[i];
      for (std::uint32_t y = 0; y < chart.size[1]; ++y) {
        const float* from = &values[4 * (chart.first_texel + std::size_t{y} * chart.size[0])];
        float* to = image.at(chart.place[0], chart.place[1] + y);
        for (std::uint32_t x = 0; x < chart.size[0]; ++x, from += 4, to += 3) {
          std::copy_n(from, 3, to);
        }
      }
    }
  });
  return image;
}

}  // namespace

Image splat_normals(cl::Context& context, const FineSurface& surface,
                    const SimplifiedIsosurface& low_poly, const Atlas& atlas,
                    double texels_per_cell, const ExtractOptions& options,
                    std::uint64_t& splatted) {
  const ChartPyramids chart_pyramids = make_pyramids(atlas);
  kiln_volume_level kernel_params{};
  kernel_params.charts = static_cast<std::uint32_t>(atlas.charts.size());
  kernel_params.space =
      options.space == NormalMapSpace::tangent ? KILN_SPACE_TANGENT : KILN_SPACE_OBJECT;
  kernel_params.y_scale = options.flip_y ? -1.0F : 1.0F;
  kernel_params.scale = options.raw ? 1.0F : 0.5F;
  kernel_params.offset = options.raw ? 0.0F : 0.5F;
  kernel_params.reach = static_cast<float>(texels_per_cell);
  DeviceCharts charts(context, atlas, chart_pyramids, kernel_params);
  splatted = charts.splat_fine_vertices(surface, low_poly);
  charts.fill();
  charts.join_seams(low_poly.positions.size());
  std::vector<kiln_low_shading> shading(1);
  if (options.space == NormalMapSpace::tangent) {
    shading = low_shading(LowSurface::of(atlas.mesh, Frame::of(atlas.mesh)));
  }
  const cl::Array<kiln_low_shading> device_shading(context, view(shading));
  charts.run("volume_map", "kiln_volume_map_encode", 0, device_shading);
  return compose_map(charts.download(atlas.texels), atlas, options.size, kernel_params.offset);
}

}  // namespace kiln
