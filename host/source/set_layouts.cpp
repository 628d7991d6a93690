#include "source/set_layouts.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "mesh/low_surface.h"

namespace kiln {

SetLayouts::SetLayouts(const Source& source, const Mesh& low, Mesh& part)
    : source_(impl_of(source)),
      low_(low),
      part_(part),
      nowhere_(static_cast<std::uint32_t>(low.uvs.size())) {
  LowSurface::check(low);
  known_.mesh = &part;
  known_.shape = Source::Impl::shape_hash(part);
  part_.uvs.resize(low.uvs.size() + 1);
  part_.uv_triangles.assign(low.uv_triangles.size(), {nowhere_, nowhere_, nowhere_});
}

SetLayouts::~SetLayouts() { source_.set_known_low({}); }

void SetLayouts::lay_out(const TextureSet& set) {
  if (set.tile_u != tile_u_ || set.tile_v != tile_v_) {
    tile_u_ = set.tile_u;
    tile_v_ = set.tile_v;
    const auto u = static_cast<float>(tile_u_), v = static_cast<float>(tile_v_);
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < low_.uvs.size(); ++i) {
      part_.uvs[i] = {low_.uvs[i].x - u, low_.uvs[i].y - v};
    }
    part_.uvs.back() = {kNaN, kNaN};
  }
  for (const std::uint32_t t : members_) part_.uv_triangles[t] = {nowhere_, nowhere_, nowhere_};
  members_ = set.members;
  known_.with_uvs.clear();
  for (const std::uint32_t t : members_) {
    const Triangle& corners = part_.uv_triangles[t] = low_.uv_triangles[t];
    const bool is_finite = std::all_of(corners.begin(), corners.end(), [&](std::uint32_t corner) {
      return std::isfinite(low_.uvs[corner].x) && std::isfinite(low_.uvs[corner].y);
    });
    if (is_finite) known_.with_uvs.push_back(t);
  }
  // The number is unique among all SetLayouts, since the source may still cache the surface of a layout of an earlier
  // SetLayouts.
  static std::atomic<std::uint64_t> layouts{0};
  known_.layout = ++layouts;
  source_.set_known_low(known_);
}

}  // namespace kiln
