#include "bake/streaming.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "base/option.h"
#include "detail/hemisphere_rays.h"
#include "detail/registry.h"
#include "match/registry.h"

namespace kiln {
namespace {

/// Joins names: "A", "A and B", "A, B and C".
std::string join_names(const std::vector<std::string_view>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += i == 0 ? "" : i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text;
}

std::string streaming_maps() {
  std::vector<std::string_view> names;
  for (const MapRow& row : map_rows()) {
    if (row.supports_streaming) names.push_back(row.info.kind.name);
  }
  return join_names(names);
}

/// True if a map gathers occlusion by views that show the high poly. Views of other occluders need no high poly.
bool bakes_occlusion_of_high_by_views(const BakeOptions& options) {
  const auto is_by_views = [](MapKind kind, const OcclusionOptions& occlusion) {
    return obeys(map_row(kind).info, "occlusion.by") && occlusion.by_high &&
           may_use_views(occlusion);
  };
  return std::any_of(options.maps.begin(), options.maps.end(),
                     [&](MapKind kind) { return is_by_views(kind, options.occlusion); }) ||
         std::any_of(options.variants.begin(), options.variants.end(), [&](const MapVariant& map) {
           return is_by_views(map.kind, map.occlusion.value_or(options.occlusion));
         });
}

}  // namespace

Message streaming_obstacle(const BakeOptions& options) {
  std::vector<std::string_view> maps;
  for (const MapKind kind : kinds_of(options)) {
    if (!map_row(kind).supports_streaming) maps.push_back(kind.name);
  }
  for (const auto& map : options.transfers) maps.push_back(map.name);
  for (const auto& map : options.own_maps) maps.push_back(map.name);
  if (!maps.empty()) {
    return Message(maps.size() == 1 ? "the map " : "the maps ") + join_names(maps) +
           (maps.size() == 1 ? " needs" : " need") + " the whole high poly in memory: bake only " +
           streaming_maps() + ".";
  }
  const auto needs_whole_high_poly = [](const MatchRow& row) {
    return !row.supports_large_high_poly;
  };
  if (options.match.saved == nullptr && any_match_or_fallback(options, needs_whole_high_poly)) {
    return Message("the match needs the whole high poly in memory: match by ") +
           match_names([](const MatchRow& row) { return row.supports_large_high_poly; }) + ".";
  }
  const auto needs_whole_mesh = [](const Message& what) {
    return what + " needs the whole high poly in memory: leave it out.";
  };
  if (bakes_occlusion_of_high_by_views(options)) {
    return Message("occlusion by views needs the whole high poly in memory: use rays.");
  }
  if (options.color || options.opacity) return needs_whole_mesh("a picture of the high poly");
  if (options.match.saved != nullptr) return needs_whole_mesh(option("match.saved"));
  if (options.match.parts != nullptr) return needs_whole_mesh(option("match.parts"));
  if (options.match.fallback_blend > 0) return needs_whole_mesh(option("match.fallback_blend"));
  if (options.report.keep_match) return needs_whole_mesh(option("report.keep_match"));
  if (options.report.vertex_coverage) return needs_whole_mesh(option("report.vertex_coverage"));
  return {};
}

void refuse_streaming(const BakeOptions& options) {
  const Message obstacle = streaming_obstacle(options);
  if (!obstacle.empty()) {
    throw Error(ErrorCode::usage, Message("The high poly is larger than memory, and ") + obstacle,
                "larger-than-memory");
  }
}

}  // namespace kiln
