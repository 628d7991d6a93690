#include "bake/match_transitions.h"

#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "mesh/charts.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::uint8_t kNotCovered = 0;

Vec3d pixel(const Image& image, std::size_t i) {
  return {image.pixels[3 * i], image.pixels[3 * i + 1], image.pixels[3 * i + 2]};
}

}  // namespace

MatchTransitions::MatchTransitions(const Mesh& low, std::span<const std::uint32_t> with_uvs,
                                   std::uint32_t width, std::uint32_t height)
    : width_(width),
      chart_of_triangle_(uv_charts(low, with_uvs)),
      method_(std::size_t{width} * height, kNotCovered),
      chart_(method_.size()) {}

void MatchTransitions::store(BandReads& reads, const TexelBand& band,
                             std::span<const DecidingMethod> deciding_methods) {
  if (band.texel_count == 0) return;
  const std::vector<std::uint32_t>& index = reads.read(band.texel_index, band.texel_count);
  const std::vector<std::uint32_t>& first =
      reads.read(band.texel_first, band.texel_count + std::size_t{1});
  const std::vector<std::uint32_t>& triangle = reads.read(band.triangle, band.sample_count);
  const std::size_t offset = std::size_t{band.first_row} * width_;
  for (std::size_t t = 0; t < index.size(); ++t) {
    method_[offset + index[t]] =
        static_cast<std::uint8_t>(1 + static_cast<std::uint8_t>(deciding_methods[first[t]]));
    chart_[offset + index[t]] = chart_of_triangle_[triangle[first[t]]];
  }
}

TransitionReport MatchTransitions::measure(const Image& image) const {
  struct Sums {
    std::uint64_t switched = 0, kept = 0;
    double across = 0, elsewhere = 0;
  };
  constexpr std::size_t kRowsPerBlock = 64;
  const std::size_t rows = method_.size() / width_;
  std::vector<Sums> blocks((rows + kRowsPerBlock - 1) / kRowsPerBlock);
  parallel_for(rows, kRowsPerBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      Sums& sums = blocks[y / kRowsPerBlock];
      for (std::size_t x = 0; x < width_; ++x) {
        const std::size_t i = y * width_ + x;
        if (method_[i] == kNotCovered) continue;
        const auto compare = [&](std::size_t j) {
          if (method_[j] == kNotCovered || chart_[j] != chart_[i]) return;
          const Vec3d a = pixel(image, i);
          const Vec3d b = pixel(image, j);
          const double angle = std::atan2(length(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
          const bool switched = method_[i] != method_[j];
          (switched ? sums.across : sums.elsewhere) += angle;
          ++(switched ? sums.switched : sums.kept);
        };
        if (x + 1 < width_) compare(i + 1);
        if (y + 1 < rows) compare(i + width_);
      }
    }
  });
  Sums total;
  for (const Sums& sums : blocks) {
    total.switched += sums.switched;
    total.kept += sums.kept;
    total.across += sums.across;
    total.elsewhere += sums.elsewhere;
  }
  TransitionReport report;
  report.sides = total.switched;
  if (total.switched != 0) report.mean_degrees = total.across / static_cast<double>(total.switched);
  if (total.kept != 0) report.elsewhere_degrees = total.elsewhere / static_cast<double>(total.kept);
  return report;
}

}  // namespace kiln
