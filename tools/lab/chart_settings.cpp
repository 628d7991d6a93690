// Settings that `kiln chart` compares, by name.
#include <algorithm>

#include "lab/chart.h"

namespace kiln::cli {
namespace {

BakeOptions by(MatchMethod method, std::uint32_t samples = 1) {
  BakeOptions bake;
  bake.match.method = method;
  bake.samples = samples;
  return bake;
}

/// \param size  pixels a side; 0: by the high poly's density
BakeOptions views(std::uint32_t count, std::uint32_t size = 0) {
  BakeOptions bake = by(MatchMethod::views);
  bake.match.views.count = count;
  bake.match.views.size = size;
  return bake;
}

BakeOptions automatic_views() {
  BakeOptions bake = by(MatchMethod::views);
  bake.match.views.count.reset();
  bake.match.views.automatic = true;
  return bake;
}

/// As Wang, Froehlich and Goebel 2003 do: least depth difference, points left where they are.
BakeOptions paper_views(std::uint32_t count) {
  BakeOptions bake = views(count);
  bake.match.views.criterion = ViewCriterion::depth;
  bake.match.views.refine = false;
  return bake;
}

BakeOptions views_then_rays(std::uint32_t count) {
  BakeOptions bake = views(count);
  bake.match.fallback = {MatchMethod::ray};
  return bake;
}

BakeOptions visibility(MatchMethod method, VisibilityAt at) {
  BakeOptions bake = by(method);
  bake.match.visibility.at = at;
  return bake;
}

}  // namespace

std::vector<ChartSetting> chart_settings() {
  std::vector<ChartSetting> settings = {
      {"ray", "rays", "rays", by(MatchMethod::ray)},
      {"ray_2x2", "rays, 2×2 samples", "rays", by(MatchMethod::ray, 2)},
      {"ray_4x4", "rays, 4×4 samples", "rays", by(MatchMethod::ray, 4)},
      {"views_6", "6 views", "views", views(6)},
      {"views_12", "12 views", "views", views(12)},
      {"views_24", "24 views", "views", views(24)},
      {"views_48", "48 views", "views", views(48)},
      {"views_auto", "views chosen", "views", automatic_views()},
      {"views_12_512", "12 views, 512²", "views", views(12, 512)},
      {"views_12_1024", "12 views, 1024²", "views", views(12, 1024)},
      {"views_12_2048", "12 views, 2048²", "views", views(12, 2048)},
      {"views_12_4096", "12 views, 4096²", "views", views(12, 4096)},
      {"paper_12", "12 views as in the paper", "paper", paper_views(12)},
      {"views_12_ray", "12 views, then rays", "views_rays", views_then_rays(12)},
      {"closest", "nearest points", "closest", by(MatchMethod::closest)},
      {"visibility_texel", "visibility, texels", "visibility",
       visibility(MatchMethod::visibility, VisibilityAt::texel)},
      {"visibility_vertex", "visibility, vertices", "visibility",
       visibility(MatchMethod::visibility, VisibilityAt::vertex)},
      {"visibility_face", "visibility, faces", "visibility",
       visibility(MatchMethod::visibility, VisibilityAt::face)},
      {"hybrid", "hybrid, texels", "visibility",
       visibility(MatchMethod::hybrid, VisibilityAt::texel)},
      {"uv", "same UVs", "uv", by(MatchMethod::uv)},
  };
  add_other_matches(matches(), settings);
  return settings;
}

void add_other_matches(std::span<const MatchInfo> rows, std::vector<ChartSetting>& settings) {
  for (const MatchInfo& row : rows) {
    const bool used = std::any_of(
        settings.begin(), settings.end(),
        [&](const ChartSetting& setting) { return setting.bake.match.method == row.method; });
    const std::string name(row.method.name);
    if (!used && !needs_direction(row)) settings.push_back({name, name, "others", by(row.method)});
  }
}

std::vector<ChartSetting> all_chart_settings() {
  const auto along = [](RayDirection direction) {
    BakeOptions bake;
    bake.match.ray.direction = direction;
    return bake;
  };
  const auto caged = [&](RayDirection direction) {
    BakeOptions bake = along(direction);
    bake.match.cage = Length::share(0.03);
    return bake;
  };
  const BakeOptions plain;
  BakeOptions nearest = along(RayDirection::averaged);
  nearest.match.ray.rule = RayRule::nearest;
  std::vector<ChartSetting> settings = chart_settings();
  const std::vector<ChartSetting> hard = {
      {"ray_nearest", "nearest face, averaged", "directions", nearest},
      {"ray_averaged", "averaged", "directions", along(RayDirection::averaged)},
      {"ray_face", "face", "directions", along(RayDirection::face)},
      {"cage_auto", "cage auto", "cages", plain, true},
      {"cage_3", "cage 3%", "cages", caged(plain.match.ray.direction)},
      {"cage_3_averaged", "cage 3%, averaged", "cages", caged(RayDirection::averaged)}};
  settings.insert(settings.end(), hard.begin(), hard.end());
  return settings;
}

const std::vector<std::string>& hard_settings() {
  static const std::vector<std::string> names = {
      "ray",    "ray_2x2",         "ray_nearest", "ray_averaged", "ray_face",        "cage_auto",
      "cage_3", "cage_3_averaged", "views_12",    "closest",      "visibility_texel"};
  return names;
}

}  // namespace kiln::cli
