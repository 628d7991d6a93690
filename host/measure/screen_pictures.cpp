// Pictures of a high poly at a size on screen, for plans and for checking them (kiln/measure.h).
#include <string>
#include <vector>

#include "kiln/measure.h"
#include "kiln/plan.h"
#include "measure/normal_probe.h"

namespace kiln {
namespace {

/// Number of sampled pixels along each side of a picture, if no size on screen was given.
constexpr std::uint32_t kSampledPixels = 48;

}  // namespace

std::vector<Vec3> plan_directions() { return held_out_views(kPlanViews, spread_views(12)); }

HighPolyView make_high_poly_view(const Source::Impl& source, std::uint32_t screen,
                                 const std::vector<Vec3>& toward, bool coarse) {
  std::vector<ViewAngles> views;
  views.reserve(toward.size());
  for (const Vec3& direction : toward) views.push_back(view_angles(direction));
  const std::uint32_t pixels_per_side = screen == 0 ? kSampledPixels : kScreenPixels;
  HighPolyView shown;
  shown.pictures =
      make_pictures(source, views, {coarse ? pixels_per_side * 2 / 3 : pixels_per_side, screen});
  shown.hits =
      cast_hits(context_of(source.device), source.rays(), shown.pictures, kHighPolyRayStart);
  return shown;
}

Mesh add_placeholder_uvs(Mesh mesh) {
  mesh.uvs = {{0, 0}, {1, 0}, {0, 1}};
  mesh.uv_triangles.assign(mesh.triangles.size(), Triangle{0, 1, 2});
  return mesh;
}

struct ScreenPictures::Impl {
  const Source& source;
  HighPolyView shown;
};

ScreenPictures::ScreenPictures(const Source& source, std::uint32_t screen, std::size_t views) {
  if (screen < 16 || screen > 16384 || views == 0) {
    throw Error(ErrorCode::usage, "ScreenPictures: screen is " + std::to_string(screen) +
                                      " pixels, views is " + std::to_string(views) +
                                      ": screen must be 16 to 16384 pixels, and views at least 1.");
  }
  const std::vector<Vec3> toward =
      held_out_views(static_cast<std::uint32_t>(views), plan_directions());
  impl_.reset(new Impl{source, make_high_poly_view(impl_of(source), screen, toward)});
}
ScreenPictures::~ScreenPictures() = default;

double ScreenPictures::degrees(const Mesh& low) const {
  const NormalProbe normal_probe(impl_of(impl_->source), add_placeholder_uvs(low), impl_->shown);
  return normal_probe.without_map().mean_degrees;
}

double ScreenPictures::degrees(const Mesh& low, const Image& map, const BakeOptions& baked) const {
  const NormalProbe normal_probe(impl_of(impl_->source), low, impl_->shown);
  return normal_probe.with_map(map, baked).mean_degrees;
}

}  // namespace kiln
