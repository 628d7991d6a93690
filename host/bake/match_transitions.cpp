#include "bake/match_transitions.h"

#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "mesh/charts.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::uint8_t kNotCovered = 0;

Vec3d texel_value(const Image& image, std::size_t i) {
  return {image.pixels[3 * i], image.pixels[3 * i + 1], image.pixels[3 * i + 2]};
}

}  // namespace

MethodTransitions::MethodTransitions(const Mesh& low, std::span<const std::uint32_t> with_uvs,
                                     std::uint32_t width, std::uint32_t height)
    : width_(width),
      chart_of_triangle_(uv_charts(low, with_uvs)),
      texel_methods_(std::size_t{width} * height, kNotCovered),
      texel_charts_(texel_methods_.size()) {}

void MethodTransitions::record_band(BandReads& reads, const TexelBand& band,
                                    std::span<const DecidingMethod> deciding_methods) {
  if (band.texel_count == 0) return;
  const std::vector<std::uint32_t>& index = reads.read(band.texel_index, band.texel_count);
  const std::vector<std::uint32_t>& first =
      reads.read(band.texel_first, band.texel_count + std::size_t{1});
  const std::vector<std::uint32_t>& triangle = reads.read(band.triangle, band.sample_count);
  const std::size_t offset = std::size_t{band.first_row} * width_;
  for (std::size_t t = 0; t < index.size(); ++t) {
    texel_methods_[offset + index[t]] =
        static_cast<std::uint8_t>(1 + static_cast<std::uint8_t>(deciding_methods[first[t]]));
    texel_charts_[offset + index[t]] = chart_of_triangle_[triangle[first[t]]];
  }
}

TransitionReport MethodTransitions::measure(const Image& image) const {
  struct Sums {
    std::uint64_t switched_pairs = 0, same_method_pairs = 0;
    double switched_sum = 0, same_method_sum = 0;
  };
  constexpr std::size_t kRowsPerBlock = 64;
  const std::size_t rows = texel_methods_.size() / width_;
  std::vector<Sums> block_sums((rows + kRowsPerBlock - 1) / kRowsPerBlock);
  parallel_for(rows, kRowsPerBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      Sums& sums = block_sums[y / kRowsPerBlock];
      for (std::size_t x = 0; x < width_; ++x) {
        const std::size_t i = y * width_ + x;
        if (texel_methods_[i] == kNotCovered) continue;
        const auto compare = [&](std::size_t j) {
          if (texel_methods_[j] == kNotCovered || texel_charts_[j] != texel_charts_[i]) return;
          const Vec3d a = texel_value(image, i);
          const Vec3d b = texel_value(image, j);
          const double angle = std::atan2(length(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
          const bool switched_pairs = texel_methods_[i] != texel_methods_[j];
          (switched_pairs ? sums.switched_sum : sums.same_method_sum) += angle;
          ++(switched_pairs ? sums.switched_pairs : sums.same_method_pairs);
        };
        if (x + 1 < width_) compare(i + 1);
        if (y + 1 < rows) compare(i + width_);
      }
    }
  });
  Sums total;
  for (const Sums& sums : block_sums) {
    total.switched_pairs += sums.switched_pairs;
    total.same_method_pairs += sums.same_method_pairs;
    total.switched_sum += sums.switched_sum;
    total.same_method_sum += sums.same_method_sum;
  }
  TransitionReport report;
  report.sides = total.switched_pairs;
  if (total.switched_pairs != 0)
    report.mean_degrees = total.switched_sum / static_cast<double>(total.switched_pairs);
  if (total.same_method_pairs != 0)
    report.elsewhere_degrees = total.same_method_sum / static_cast<double>(total.same_method_pairs);
  return report;
}

}  // namespace kiln
