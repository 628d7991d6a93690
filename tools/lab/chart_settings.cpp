// What `kiln chart` compares, by name.
#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lab/chart.h"

namespace kiln::cli {
namespace {

BakeOptions rays(std::uint32_t samples) {
  BakeOptions bake;
  bake.samples = samples;
  return bake;
}

/// \param size  pixels a side; 0: by the high poly's density
BakeOptions views(std::uint32_t count, std::uint32_t size = 0) {
  BakeOptions bake;
  bake.method = MatchMethod::views;
  bake.views.count = count;
  bake.views.size = size;
  return bake;
}

BakeOptions automatic_views() {
  BakeOptions bake = views(0);
  bake.views.count.reset();
  bake.views.automatic = true;
  return bake;
}

BakeOptions paper_views(std::uint32_t count) {
  BakeOptions bake = views(count);
  bake.views.criterion = ViewCriterion::depth;
  bake.views.refine = false;
  return bake;
}

BakeOptions views_then_rays(std::uint32_t count) {
  BakeOptions bake = views(count);
  bake.fallback = {MatchMethod::ray};
  return bake;
}

BakeOptions closest() {
  BakeOptions bake;
  bake.method = MatchMethod::closest;
  return bake;
}

BakeOptions visibility(MatchMethod method, VisibilityAt at) {
  BakeOptions bake;
  bake.method = method;
  bake.visibility.at = at;
  return bake;
}

BakeOptions same_uvs() {
  BakeOptions bake;
  bake.method = MatchMethod::uv;
  return bake;
}

}  // namespace

const char* family_name(ChartFamily family) {
  switch (family) {
    case ChartFamily::rays:
      return "rays";
    case ChartFamily::views:
      return "views";
    case ChartFamily::paper:
      return "paper";
    case ChartFamily::views_rays:
      return "views_rays";
    case ChartFamily::closest:
      return "closest";
    case ChartFamily::visibility:
      return "visibility";
    case ChartFamily::cages:
      return "cages";
    case ChartFamily::directions:
      return "directions";
    case ChartFamily::others:
      return "others";
    case ChartFamily::uv:
      break;
  }
  return "uv";
}

std::vector<ChartSetting> chart_settings() {
  using Family = ChartFamily;
  std::vector<ChartSetting> settings = {
      {"ray", "rays", Family::rays, rays(1)},
      {"ray_2x2", "rays, 2×2 samples", Family::rays, rays(2)},
      {"ray_4x4", "rays, 4×4 samples", Family::rays, rays(4)},
      {"views_6", "6 views", Family::views, views(6)},
      {"views_12", "12 views", Family::views, views(12)},
      {"views_24", "24 views", Family::views, views(24)},
      {"views_48", "48 views", Family::views, views(48)},
      {"views_auto", "views chosen", Family::views, automatic_views()},
      {"views_12_512", "12 views, 512²", Family::views, views(12, 512)},
      {"views_12_1024", "12 views, 1024²", Family::views, views(12, 1024)},
      {"views_12_2048", "12 views, 2048²", Family::views, views(12, 2048)},
      {"views_12_4096", "12 views, 4096²", Family::views, views(12, 4096)},
      {"paper_12", "12 views as in the paper", Family::paper, paper_views(12)},
      {"views_12_ray", "12 views, then rays", Family::views_rays, views_then_rays(12)},
      {"closest", "nearest points", Family::closest, closest()},
      {"visibility_texel", "visibility, texels", Family::visibility,
       visibility(MatchMethod::visibility, VisibilityAt::texel)},
      {"visibility_vertex", "visibility, vertices", Family::visibility,
       visibility(MatchMethod::visibility, VisibilityAt::vertex)},
      {"visibility_face", "visibility, faces", Family::visibility,
       visibility(MatchMethod::visibility, VisibilityAt::face)},
      {"hybrid", "hybrid, texels", Family::visibility,
       visibility(MatchMethod::hybrid, VisibilityAt::texel)},
      {"uv", "same UVs", Family::uv, same_uvs()},
  };
  add_other_matches(matches(), settings);
  return settings;
}

void add_other_matches(std::span<const MatchInfo> rows, std::vector<ChartSetting>& settings) {
  for (const MatchInfo& row : rows) {
    const bool used =
        std::any_of(settings.begin(), settings.end(),
                    [&](const ChartSetting& setting) { return setting.bake.method == row.method; });
    if (used || row.needs_direction) continue;
    const std::string name(row.method.name);
    ChartSetting setting{name, name, ChartFamily::others, {}};
    setting.bake.method = row.method;
    settings.push_back(std::move(setting));
  }
}

std::vector<ChartSetting> all_chart_settings() {
  using Family = ChartFamily;
  std::vector<ChartSetting> settings = chart_settings();
  const auto add = [&](const char* name, const char* label, Family family, const auto& change) {
    ChartSetting setting{name, label, family, rays(1)};
    change(setting);
    settings.push_back(std::move(setting));
  };
  constexpr double kCage = 0.03;
  add("ray_nearest", "nearest face, averaged", Family::directions, [](ChartSetting& s) {
    s.bake.ray.rule = RayRule::nearest;
    s.bake.ray.direction = RayDirection::averaged;
  });
  add("ray_averaged", "averaged", Family::directions,
      [](ChartSetting& s) { s.bake.ray.direction = RayDirection::averaged; });
  add("ray_face", "face", Family::directions,
      [](ChartSetting& s) { s.bake.ray.direction = RayDirection::face; });
  add("cage_auto", "cage auto", Family::cages, [](ChartSetting& s) { s.find_cage = true; });
  add("cage_3", "cage 3%", Family::cages,
      [](ChartSetting& s) { s.bake.cage = Length::share(kCage); });
  add("cage_3_averaged", "cage 3%, averaged", Family::cages, [](ChartSetting& s) {
    s.bake.cage = Length::share(kCage);
    s.bake.ray.direction = RayDirection::averaged;
  });
  return settings;
}

const std::vector<std::string>& hard_settings() {
  static const std::vector<std::string> names = {
      "ray",    "ray_2x2",         "ray_nearest", "ray_averaged", "ray_face",        "cage_auto",
      "cage_3", "cage_3_averaged", "views_12",    "closest",      "visibility_texel"};
  return names;
}

}  // namespace kiln::cli
