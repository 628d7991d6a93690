#include "bake/fallback_blend.h"

#include <algorithm>
#include <array>
#include <functional>
#include <queue>
#include <utility>

#include "mesh/kernels_shared.h"
#include "mesh/surface_links.h"
#include "texel/sample_pick.h"

namespace kiln {
namespace {

/// Costs of a straight and a diagonal step, as integers so that sums do not depend on their order.
constexpr std::uint32_t kStraightCost = 1000;
constexpr std::uint32_t kDiagonalCost = 1414;
constexpr std::uint32_t kFarFromBorder = 0xFFFFFFFFU;

/// The eight neighbours of a texel on the surface; the four that share a side come first.
class TexelNeighbours {
 public:
  TexelNeighbours(const TexelLinks& links, std::uint32_t width) : links_(links), width_(width) {}

  /// The eight neighbours, in the order of kiln_visibility_smooth_seams; KILN_VISIBILITY_NO_LINK if one is missing.
  std::array<std::uint32_t, 8> of(std::uint32_t texel) const {
    std::array<std::uint32_t, 8> result;
    if (links_.kind[texel] == KILN_VISIBILITY_INNER) {
      const std::uint32_t row_above = texel - width_;
      const std::uint32_t row_below = texel + width_;
      return {texel - 1,     texel + 1,     row_above,     row_below,
              row_above - 1, row_above + 1, row_below - 1, row_below + 1};
    }
    // Links of border texels are sorted by texel, so a binary search finds them.
    std::size_t low = 0;
    std::size_t high = links_.links.size() / 9;
    while (low + 1 < high) {
      const std::size_t middle = (low + high) / 2;
      (links_.links[9 * middle] <= texel ? low : high) = middle;
    }
    std::copy_n(&links_.links[9 * low + 1], 8, result.begin());
    return result;
  }

 private:
  const TexelLinks& links_;
  std::uint32_t width_;
};

}  // namespace

FallbackBlend::FallbackBlend(std::uint32_t width, std::uint32_t height, std::uint32_t reach)
    : width_(width),
      height_(height),
      reach_(reach),
      texel_triangles_(std::size_t{width} * height, KILN_NO_TRIANGLE),
      texel_methods_(texel_triangles_.size()) {}

void FallbackBlend::record_band(BandReads& reads, const TexelBand& band,
                                std::span<const DecidingMethod> deciding_methods) {
  if (band.texel_count == 0) return;
  const std::vector<std::uint32_t>& index = reads.read(band.texel_index, band.texel_count);
  const std::vector<std::uint32_t>& first =
      reads.read(band.texel_first, band.texel_count + std::size_t{1});
  const std::vector<std::uint32_t>& triangle = reads.read(band.triangle, band.sample_count);
  const std::size_t offset = std::size_t{band.first_row} * width_;
  for (std::size_t t = 0; t < index.size(); ++t) {
    // The method that counts for the texel: of its samples' methods, the one whose enumerator is highest
    DecidingMethod deciding_method = DecidingMethod::nothing;
    for (std::uint32_t s = first[t]; s < first[t + 1]; ++s) {
      deciding_method = std::max(deciding_method, deciding_methods[s]);
    }
    texel_triangles_[offset + index[t]] = triangle[first[t]];
    texel_methods_[offset + index[t]] = static_cast<std::uint8_t>(deciding_method);
  }
}

void FallbackBlend::plan(const LowSurface& surface) {
  const SurfaceTopology topology = SurfaceTopology::of(surface);
  const TexelLinks links = TexelLinks::of(surface, topology, texel_triangles_, width_, height_);
  const TexelNeighbours neighbours(links, width_);
  const auto is = [this](std::uint32_t texel, DecidingMethod deciding_method) {
    return texel_triangles_[texel] != KILN_NO_TRIANGLE &&
           texel_methods_[texel] == static_cast<std::uint8_t>(deciding_method);
  };
  border_costs_.assign(texel_methods_.size(), kFarFromBorder);
  // The border between the two matches lies half a texel from the centre of the nearest texel that the fallback matched.
  const std::uint32_t max_cost = reach_ * kStraightCost + kStraightCost / 2;
  // A path's cost, and the texel where it ends
  using Step = std::pair<std::uint32_t, std::uint32_t>;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> open_steps;
  const auto reach = [&](std::uint32_t texel, std::uint32_t cost) {
    if (cost >= max_cost || cost >= border_costs_[texel]) return;
    border_costs_[texel] = cost;
    open_steps.emplace(cost, texel);
  };
  // Relaxes an edge in Dijkstra's algorithm. Only texels whose match comes from the method, not
  // from the fallback, are reached.
  const auto relax_neighbours = [&](std::uint32_t texel, std::uint32_t cost) {
    const std::array<std::uint32_t, 8> neighbour_texels = neighbours.of(texel);
    for (std::size_t k = 0; k < 8; ++k) {
      if (neighbour_texels[k] == KILN_VISIBILITY_NO_LINK ||
          !is(neighbour_texels[k], DecidingMethod::method))
        continue;
      reach(neighbour_texels[k], cost + (k < 4 ? kStraightCost : kDiagonalCost));
    }
  };
  for (std::uint32_t texel = 0; texel < texel_methods_.size(); ++texel) {
    if (!is(texel, DecidingMethod::fallback)) continue;
    border_costs_[texel] = 0;
    relax_neighbours(texel, 0);
  }
  while (!open_steps.empty()) {
    const auto [cost, texel] = open_steps.top();
    open_steps.pop();
    if (cost == border_costs_[texel]) relax_neighbours(texel, cost);
  }
  texel_triangles_ = {};
}

float FallbackBlend::share(std::size_t texel) const {
  const std::uint32_t cost = border_costs_[texel];
  if (cost == kFarFromBorder) return 1;
  if (cost == 0) return 0;
  const double relative_distance = (static_cast<double>(cost) / kStraightCost - 0.5) / reach_;
  return static_cast<float>(relative_distance * relative_distance * (3 - 2 * relative_distance));
}

bool FallbackBlend::has_blended_texels(const TexelBand& band) const {
  const auto first = border_costs_.begin() + static_cast<std::ptrdiff_t>(band.first_row) * width_;
  return std::any_of(first, first + static_cast<std::ptrdiff_t>(band.row_count) * width_,
                     [](std::uint32_t cost) { return cost != kFarFromBorder; });
}

std::uint64_t FallbackBlend::run(cl::Context& context, const TexelBand& band, Matcher& matcher,
                                 const Make& make) {
  std::vector<std::uint32_t> index(band.texel_count);
  std::vector<std::uint32_t> first(band.texel_count + std::size_t{1});
  band.texel_index.read(context, index);
  band.texel_first.read(context, first);
  const std::span<const DecidingMethod> deciding_methods = matcher.deciding_methods();
  std::vector<float> ray_shares(band.sample_count, 1.0F);
  std::vector<std::uint32_t> chosen;
  const std::size_t offset = std::size_t{band.first_row} * width_;
  for (std::size_t t = 0; t < index.size(); ++t) {
    const float match_share = share(offset + index[t]);
    if (match_share == 1) continue;
    for (std::uint32_t s = first[t]; s < first[t + 1]; ++s) {
      if (deciding_methods[s] != DecidingMethod::method) continue;
      ray_shares[s] = match_share;
      chosen.push_back(s);
    }
  }
  if (chosen.empty()) return 0;
  matcher.run_fallback(band, chosen, found_);
  if (other_.capacity < band.capacity) {
    other_ = DeviceCorrespondence();
    other_ = DeviceCorrespondence(context, band.capacity);
  }
  context.fill(other_.triangle, std::uint32_t{KILN_NO_TRIANGLE});
  SamplePick(context, chosen).scatter_correspondence(found_, other_);
  const cl::Array<float> device_shares(context, std::span<const float>(ray_shares));
  make(other_, device_shares);
  context.finish();

  std::vector<std::uint32_t> found(chosen.size());
  found_.triangle.read(context, found);
  std::uint64_t texels = 0;
  std::size_t c = 0;
  for (std::size_t t = 0; t < index.size(); ++t) {
    bool has_blended_sample = false;
    for (; c < chosen.size() && chosen[c] < first[t + 1]; ++c) {
      has_blended_sample = has_blended_sample || found[c] != KILN_NO_TRIANGLE;
    }
    texels += has_blended_sample ? 1 : 0;
  }
  return texels;
}

}  // namespace kiln
