#include "volume/normal_splat.h"

#include <algorithm>
#include <numeric>
#include <span>

#include "base/parallel.h"
#include "mesh/frame.h"
#include "mesh/low_shading.h"
#include "mesh/low_surface.h"

namespace kiln {
namespace {

constexpr std::size_t kLocal = 64;

template <typename Vector>
auto view(const Vector& vector) {
  return std::span<const typename Vector::value_type>(vector.data(), vector.size());
}

/// Rows and texels of all charts' pyramids.
struct Pyramids {
  struct Level {
    std::vector<std::uint32_t> row_charts, first_rows;
  };
  std::vector<Level> levels;
  std::vector<std::uint32_t> first_texels;  // [level][chart]
  std::uint64_t texels = 0;
};

Pyramids make_pyramids(const Atlas& atlas) {
  Pyramids result;
  const std::size_t charts = atlas.charts.size();
  for (std::uint32_t level = 0;; ++level) {
    Pyramids::Level rows;
    rows.first_rows.resize(charts);
    const auto side = [&](std::uint32_t texels) { return (texels + (1U << level) - 1) >> level; };
    result.first_texels.resize((level + 1) * charts);
    for (std::size_t i = 0; i < charts; ++i) {
      const kiln_volume_chart& chart = atlas.charts[i];
      rows.first_rows[i] = static_cast<std::uint32_t>(rows.row_charts.size());
      // Down to 1 x 1, which the level before may already be.
      if (level > 0 &&
          (std::max(chart.size[0], chart.size[1]) + (1U << (level - 1)) - 1) >> (level - 1) == 1) {
        continue;
      }
      result.first_texels[level * charts + i] = static_cast<std::uint32_t>(result.texels);
      result.texels += std::uint64_t{side(chart.size[0])} * side(chart.size[1]);
      rows.row_charts.insert(rows.row_charts.end(), side(chart.size[1]),
                             static_cast<std::uint32_t>(i));
    }
    if (rows.row_charts.empty()) return result;
    result.levels.push_back(std::move(rows));
  }
}

}  // namespace

Image splat_normals(cl::Context& context, const FineSurface& surface, const LightSurface& light,
                    const Atlas& atlas, const ExtractOptions& options, std::uint64_t& splatted) {
  const Pyramids pyramids = make_pyramids(atlas);
  kiln_volume_level params{};
  params.charts = static_cast<std::uint32_t>(atlas.charts.size());
  params.space = options.space == NormalMapSpace::tangent ? KILN_SPACE_TANGENT : KILN_SPACE_OBJECT;
  params.y_scale = options.flip_y ? -1.0F : 1.0F;
  params.scale = options.raw ? 1.0F : 0.5F;
  params.offset = options.raw ? 0.0F : 0.5F;

  const cl::Array<kiln_volume_chart> charts(context, view(atlas.charts));
  const cl::Array<std::uint32_t> first_texels(context, view(pyramids.first_texels));
  // float4 a texel.
  const cl::Array<float> texels(context, 4 * pyramids.texels);
  {
    const cl::Array<kiln_volume_vertex> fine(context, view(surface.vertices));
    const cl::Array<std::uint32_t> begins(context, view(light.leaf_begins));
    const cl::Array<std::uint32_t> leaves(context, view(light.leaves));
    const cl::Array<float> normals(
        context, std::span<const float>(&light.normals[0].x, 3 * light.normals.size()));
    const cl::Array<std::uint32_t> counts(context, atlas.charts.size());
    context.launch(context.kernel("volume_map", "kiln_volume_map_splat"), params.charts, kLocal,
                   params, charts, begins, leaves, fine, normals, texels, counts);
    const std::vector<std::uint32_t> known = counts.download(context);
    splatted = std::accumulate(known.begin(), known.end(), std::uint64_t{0});
  }
  struct DeviceRows {
    cl::Array<std::uint32_t> row_charts, first_rows;
  };
  std::vector<DeviceRows> rows;
  for (const Pyramids::Level& level : pyramids.levels) {
    rows.push_back({cl::Array<std::uint32_t>(context, view(level.row_charts)),
                    cl::Array<std::uint32_t>(context, view(level.first_rows))});
  }
  const auto run = [&](const cl::Kernel& kernel, std::uint32_t level, const auto& middle) {
    params.level = level;
    params.rows = static_cast<std::uint32_t>(pyramids.levels[level].row_charts.size());
    context.launch(kernel, params.rows, kLocal, params, charts, rows[level].row_charts,
                   rows[level].first_rows, middle, texels);
  };
  const auto last = static_cast<std::uint32_t>(pyramids.levels.size());
  const cl::Kernel push = context.kernel("volume_map", "kiln_volume_map_push");
  const cl::Kernel pull = context.kernel("volume_map", "kiln_volume_map_pull");
  for (std::uint32_t level = 1; level < last; ++level) run(push, level, first_texels);
  for (std::uint32_t level = last - 1; level-- > 0;) run(pull, level, first_texels);
  std::vector<kiln_low_shading> shading(1);
  if (options.space == NormalMapSpace::tangent) {
    shading = low_shading(LowSurface::of(atlas.mesh, Frame::of(atlas.mesh)));
  }
  const cl::Array<kiln_low_shading> device_shading(context, view(shading));
  run(context.kernel("volume_map", "kiln_volume_map_encode"), 0, device_shading);

  Image image;
  image.width = image.height = options.size;
  image.channels = 3;
  const std::size_t count = std::size_t{options.size} * options.size;
  image.pixels.resize(3 * count);
  const float flat = params.offset;
  parallel_for(count, 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      image.pixels[3 * i] = image.pixels[3 * i + 1] = flat;
      image.pixels[3 * i + 2] = 1;
    }
  });
  RawVector<float> values(4 * atlas.texels);
  texels.read(context, values);
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

}  // namespace kiln
