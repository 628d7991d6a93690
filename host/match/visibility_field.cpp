#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/parallel.h"
#include "match/visibility.h"
#include "match/visibility_clusters.h"
#include "match/visibility_means.h"
#include "mesh/kernels_shared.h"
#include "mesh/surface_links.h"

namespace kiln {
namespace {

constexpr std::uint32_t kMaxFieldSide = 2048;
constexpr std::size_t kTexelsPerTask = 1 << 14;

/// Number of samples per band for which the sets of directions that see these samples take 64 MiB.
std::uint32_t clustered_samples_per_band(const VisibilityOptions& options, std::size_t directions) {
  if (options.clusters == 1) return 1U << 22;
  const std::size_t words_per_point = (directions + 31) / 32;
  return static_cast<std::uint32_t>(std::size_t{1} << 24) /
         static_cast<std::uint32_t>(words_per_point);
}

/// Clusters the directions of a band's samples that have widely scattered directions, in the samples' order.
void cluster_band(cl::Context& context, const VisibilityProbe& probe, const TexelBand& band,
                  const VisibilityProbe::ProbedPoints& probed, const VisibilityOptions& options,
                  std::uint32_t field_width, std::vector<ClusteredTexel>& clustered_texels) {
  const std::vector<ProbeDirection>& directions = probe.directions();
  const std::size_t plane = probed.capacity;
  const std::vector<float> sums = probed.sums.download(context);
  const std::vector<float> points = probed.points.download(context);
  const std::vector<std::int32_t> seen_bits = probed.seen.download(context);
  std::vector<std::uint32_t> index(probed.count);
  band.texel_index.read(context, index);
  std::vector<std::uint32_t> cluster_means;
  for (std::uint32_t i = 0; i < probed.count; ++i) {
    const std::array<float, 4> mean =
        mean_of({Vec3d{sums[i], sums[i + plane], sums[i + 2 * plane]}, sums[i + 3 * plane]});
    if (mean[3] > 0 && deviation_of(mean) > options.cluster_deviation) cluster_means.push_back(i);
  }
  std::vector<ClusteredTexel> found(cluster_means.size());
  parallel_for(cluster_means.size(), 256, [&](std::size_t begin, std::size_t end) {
    std::vector<SeenDirection> seen_directions;
    for (std::size_t c = begin; c < end; ++c) {
      const std::size_t i = cluster_means[c];
      const Vec3d normal{points[i + 3 * plane], points[i + 4 * plane], points[i + 5 * plane]};
      seen_directions.clear();
      for (std::size_t d = 0; d < directions.size(); ++d) {
        const auto bits = static_cast<std::uint32_t>(seen_bits[(d / 32) * plane + i]);
        if ((bits >> (d % 32) & 1U) == 0) continue;
        seen_directions.push_back(
            {directions[d].toward, directions[d].weight * dot(normal, directions[d].toward)});
      }
      found[c] = {band.first_row * field_width + index[i],
                  cluster_directions(seen_directions, options.clusters)};
    }
  });
  for (ClusteredTexel& texel : found) {
    if (texel.directions.size() > 1) clustered_texels.push_back(std::move(texel));
  }
}

}  // namespace

VisibilityField::VisibilityField(cl::Context& context, const LowSurface& surface,
                                 std::uint32_t width, std::uint32_t height,
                                 const VisibilityOptions& options, Traversal traversal,
                                 VisibilityReport& report, ShareCallback report_share)
    : context_(context), width_(width), height_(height) {
  const auto start = std::chrono::steady_clock::now();
  check_visibility(options);
  std::vector<ProbeDirection> directions = probe_directions(options);
  report.directions = static_cast<std::uint32_t>(directions.size());
  report.by_rays = options.test == VisibilityTest::rays;
  VisibilityProbe probe(context, surface, std::move(directions), options.view_size, traversal);
  probe.set_progress(std::move(report_share));
  if (options.at == VisibilityAt::texel) {
    make_texels(surface, probe, options, report);
  } else {
    make_corners(surface, probe, options, report);
  }
  normals_ = cl::Array<float>(context, std::span<const float>(probe.normals().download(context)));
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void VisibilityField::make_texels(const LowSurface& surface, VisibilityProbe& probe,
                                  const VisibilityOptions& options, VisibilityReport& report) {
  const std::uint32_t size_divisor =
      (std::max(width_, height_) + kMaxFieldSide - 1) / kMaxFieldSide;
  field_width_ = report.width = (width_ + size_divisor - 1) / size_divisor;
  field_height_ = report.height = (height_ + size_divisor - 1) / size_divisor;
  const std::size_t pixels = std::size_t{field_width_} * field_height_;
  cl::Array<float> from(context_, 4 * pixels);
  field_triangle_ = cl::Array<std::uint32_t>(context_, pixels);
  std::vector<ClusteredTexel> clustered_texels;
  context_.fill(from, 0.0F);
  context_.fill(field_triangle_, std::uint32_t{KILN_NO_TRIANGLE});
  {
    TexelSampler sampler(context_, surface,
                         {field_width_, field_height_, 1,
                          clustered_samples_per_band(options, probe.directions().size())});
    for (std::uint32_t b = 0; b < sampler.band_count(); ++b) {
      const TexelBand band = sampler.sample(b);
      if (band.sample_count == 0) continue;
      VisibilityProbe::ProbedPoints probed = probe.make_points(band);
      if (options.clusters > 1) probe.allocate_seen(probed);
      if (report.by_rays) {
        probe.add_directions_by_rays(probed);
      } else {
        probe.add_directions_by_views(probed);
      }
      kiln_visibility_params params{};
      params.count = probed.count;
      params.capacity = probed.capacity;
      context_.launch(context_.kernel("visibility", "kiln_visibility_scatter"), probed.count,
                      kLocal, params, band.first_row * field_width_, band.texel_index,
                      band.triangle, probed.sums, from, field_triangle_);
      context_.finish();
      if (options.clusters > 1) {
        cluster_band(context_, probe, band, probed, options, field_width_, clustered_texels);
      }
      report.places += probed.count;
    }
  }

  const SurfaceTopology topology = SurfaceTopology::of(surface);
  const std::vector<std::uint32_t> texel_triangle = field_triangle_.download(context_);
  const TexelLinks links =
      TexelLinks::of(surface, topology, texel_triangle, field_width_, field_height_);
  const auto border = static_cast<std::uint32_t>(links.links.size() / 9);
  const cl::Array<std::uint8_t> kind(context_, std::span<const std::uint8_t>(links.kind));
  cluster_links_ = cl::Array<std::uint32_t>(context_, std::span<const std::uint32_t>(links.links));
  std::vector<std::uint32_t> border_link(pixels, KILN_VISIBILITY_NO_LINK);
  for (std::uint32_t i = 0; i < border; ++i) border_link[links.links[9 * std::size_t{i}]] = i;
  chart_borders_ = cl::Array<std::uint32_t>(context_, std::span<const std::uint32_t>(border_link));
  cl::Array<float> to;
  if (options.smoothing > 0) {
    to = cl::Array<float>(context_, 4 * pixels);
    context_.fill(to, 0.0F);
  }
  for (std::uint32_t round = 0; round < options.smoothing; ++round) {
    context_.launch(context_.kernel("visibility", "kiln_visibility_smooth"), pixels, kLocal,
                    static_cast<std::uint32_t>(pixels), field_width_, kind, from, to);
    if (border != 0) {
      context_.launch(context_.kernel("visibility", "kiln_visibility_smooth_seams"), border, kLocal,
                      border, cluster_links_, from, to);
    }
    std::swap(from, to);
  }
  context_.finish();
  to = cl::Array<float>();

  std::vector<std::array<float, 4>> means(pixels);
  from.read(context_, std::span<float>(means[0].data(), 4 * pixels));
  std::vector<std::uint32_t> unseen;
  parallel_for(pixels, kTexelsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::array<float, 4>& m = means[i];
      const double weight = m[3];
      m = mean_of({Vec3d{m[0], m[1], m[2]}, weight});
    }
  });
  for (std::size_t i = 0; i < pixels; ++i) {
    if (links.kind[i] != KILN_VISIBILITY_EMPTY && means[i][3] == 0) {
      unseen.push_back(static_cast<std::uint32_t>(i));
    }
  }
  fill_unseen(
      means, std::move(unseen),
      [&](std::uint32_t texel, const auto& visit) {
        if (links.kind[texel] == KILN_VISIBILITY_INNER) {
          for (const std::uint32_t row : {texel - field_width_, texel, texel + field_width_}) {
            for (const std::uint32_t other : {row - 1, row, row + 1}) visit(other);
          }
          return;
        }
        const std::size_t at = 9 * std::size_t{border_link[texel]};
        for (std::size_t k = 1; k < 9; ++k) {
          if (links.links[at + k] != KILN_VISIBILITY_NO_LINK) visit(links.links[at + k]);
        }
      },
      report);
  add_deviation(means, report);
  if (options.clusters > 1) {
    report.clustered = clustered_texels.size();
    store_clusters(clustered_texels, options.clusters, means);
  } else {
    from.write(context_, std::span<const float>(means[0].data(), 4 * pixels));
    field_ = std::move(from);
  }
  texel_charts_ =
      cl::Array<std::uint32_t>(context_, std::span<const std::uint32_t>(topology.chart));
}

void VisibilityField::store_clusters(const std::vector<ClusteredTexel>& clustered_texels,
                                     std::uint32_t count,
                                     std::vector<std::array<float, 4>>& means) {
  clusters_.emplace();
  clusters_->width = field_width_;
  clusters_->height = field_height_;
  clusters_->count = count;
  clusters_->number.assign(means.size(), 0);
  clusters_->directions.resize(means.size() * count);
  for (std::size_t i = 0; i < means.size(); ++i) {
    const Vec3d mean{means[i][0], means[i][1], means[i][2]};
    const double size = length(mean);
    if (!(means[i][3] > 0)) continue;
    clusters_->number[i] = 1;
    if (!(size > 0)) continue;
    std::fill_n(&clusters_->directions[i * count], count, to_float(mean * (1 / size)));
  }
  other_clusters_.clear();
  for (std::uint32_t k = 0; k < count; ++k) {
    for (const ClusteredTexel& texel : clustered_texels) {
      const std::size_t number = texel.directions.size();
      const Vec3 direction = to_float(texel.directions[k < number ? k : 0]);
      clusters_->number[texel.pixel] = static_cast<std::uint8_t>(number);
      clusters_->directions[std::size_t{texel.pixel} * count + k] = direction;
      means[texel.pixel] = {direction.x, direction.y, direction.z, 1};
    }
    cl::Array<float> field(context_, std::span<const float>(means[0].data(), 4 * means.size()));
    if (k == 0) {
      field_ = std::move(field);
    } else {
      other_clusters_.push_back(std::move(field));
    }
  }
}

kiln_visibility_band VisibilityField::band_params(const TexelBand& band, std::uint32_t samples,
                                                  std::uint32_t capacity) const {
  kiln_visibility_band params{};
  params.texel_count = band.texel_count;
  params.capacity = band.capacity;
  params.out_capacity = capacity;
  params.first_row = band.first_row;
  params.width = width_;
  params.height = height_;
  params.samples = samples;
  params.field_width = field_width_;
  params.field_height = field_height_;
  return params;
}

void VisibilityField::means(const TexelBand& band, std::uint32_t samples,
                            const cl::Array<float>& seen, std::uint32_t capacity,
                            std::uint32_t cluster) const {
  context_.launch(context_.kernel("visibility", "kiln_visibility_write_means"), band.texel_count,
                  kLocal, band_params(band, samples, capacity), band.texel_index, band.texel_first,
                  band.sample_slot, band.triangle, band.barycentric,
                  cluster == 0 ? field_ : other_clusters_[cluster - 1], field_triangle_,
                  texel_charts_, chart_borders_, cluster_links_, seen);
}

void VisibilityField::write_directed_samples(const TexelBand& band, std::uint32_t samples,
                                             bool hybrid, const cl::Array<float>& directed,
                                             std::uint32_t capacity, std::uint32_t cluster) const {
  kiln_visibility_band params = band_params(band, samples, capacity);
  params.hybrid = hybrid ? 1 : 0;
  context_.launch(context_.kernel("visibility", "kiln_visibility_write_directions"),
                  band.texel_count, kLocal, params, band.texel_index, band.texel_first,
                  band.sample_slot, band.triangle, band.barycentric, band.points, normals_,
                  cluster == 0 ? field_ : other_clusters_[cluster - 1], field_triangle_,
                  texel_charts_, chart_borders_, cluster_links_, directed);
}

}  // namespace kiln
