#include <algorithm>

#include "arguments/bake_arguments.h"
#include "arguments/bake_values.h"

namespace kiln::cli {
namespace {

bool asks_occlusion(const BakeArguments& a) {
  return std::any_of(a.maps.begin(), a.maps.end(),
                     [](const std::string& map) { return find_map(map).takes_rays; });
}

bool takes_falloff(const BakeArguments& a) {
  return std::any_of(a.maps.begin(), a.maps.end(),
                     [](const std::string& map) { return find_map(map).takes_falloff; });
}

Json set_sizes_json(const BakeArguments& a) {
  Json json = Json::object();
  for (const SetSize& size : set_sizes(a)) json[size.set] = {size.width, size.height};
  return json;
}

}  // namespace

Json describe(const BakeArguments& a, const BakeReport& report) {
  const auto or_null = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
  return {
      {"size", a.size},
      {"sets", a.sets},
      {"set_sizes", set_sizes_json(a)},
      {"maps", a.maps},
      {"match", a.load_match.empty() ? a.match : "loaded"},
      {"views", chain_has(a, &MatchInfo::takes_views) ? Json(a.views.empty() ? "default" : a.views)
                                                      : Json()},
      {"view", a.view},
      {"view_size", report.views ? Json(report.views->size) : Json()},
      {"view_criterion", report.views ? Json(a.view_criterion) : Json()},
      {"view_refine", report.views ? Json(!a.no_view_refine) : Json()},
      {"visibility_at", by_visibility(a) ? Json(a.visibility_at) : Json()},
      {"visibility_test",
       report.visibility ? Json(report.visibility->by_rays ? "rays" : "views") : Json()},
      {"directions", by_visibility(a) ? Json(a.directions) : Json()},
      {"visibility_size", by_visibility(a) ? Json(a.visibility_size) : Json()},
      {"visibility_smooth", by_visibility(a) ? Json(a.visibility_smooth) : Json()},
      {"visibility_clusters", by_visibility(a) ? Json(a.visibility_clusters) : Json()},
      {"visibility_deviation", by_visibility(a) ? Json(a.visibility_deviation) : Json()},
      {"view_weight", by_visibility(a) ? Json(a.view_weight) : Json()},
      {"fallback", a.load_match.empty() ? Json(a.fallback) : Json()},
      {"fallback_blend", a.fallback_blend},
      {"max_distance", or_null(a.max_distance)},
      {"max_distance_world", report.max_distance},
      {"cage", or_null(a.cage)},
      {"cage_mesh", or_null(a.cage_mesh)},
      {"save_cage", or_null(a.save_cage)},
      {"two_sided", a.two_sided},
      {"ray", a.ray},
      {"direction", a.direction},
      {"edge_width", or_null(a.edge_width)},
      {"match_by", a.match_by},
      {"match_list", or_null(a.match_list)},
      {"part_occlusion", a.match_by == "all" ? Json() : Json(a.part_occlusion)},
      {"up", a.frame.up},
      {"unit", a.frame.unit},
      {"uv_set", a.frame.uv_set},
      {"triangulate", a.low.empty() && is_height_field(a.high) ? Json() : Json(a.triangulate)},
      {"tangents", a.low.empty() ? Json() : Json(a.tangents)},
      {"split_at_seams", a.split_at_seams},
      {"uv_copies", a.uv_copies},
      {"reasons", a.reasons},
      {"low_names", a.match_by == "name" ? Json(a.low_names) : Json()},
      {"high_names", a.match_by == "name" ? Json(a.high_names) : Json()},
      {"recall", report.recall ? Json(a.recall) : Json()},
      {"miss", name_of(miss_values(), miss_policy(a))},
      {"force_uv", a.force_uv},
      {"height", is_height_field(a.high) ? Json(a.heights.height) : Json()},
      {"extent", or_null(a.heights.extent)},
      {"traversal", a.traversal},
      {"space", a.space},
      {"bitangent", a.space == "tangent" ? Json(a.bitangent) : Json()},
      {"flip_y", a.flip_y},
      {"two_component", a.two_component},
      {"format", a.format},
      {"raw", a.raw},
      {"dither", a.dither},
      {"samples", a.samples},
      {"gutter", a.gutter},
      {"mips", a.mips},
      {"ao_by",
       report.occlusion ? Json(name_of(occlusion_by_values(), report.occlusion->by)) : Json()},
      {"ao_views",
       report.occlusion && report.occlusion->views > 0 ? Json(report.occlusion->views) : Json()},
      {"ao_rays", asks_occlusion(a) ? Json(a.ao_rays) : Json()},
      {"ao_distance", or_null(a.ao_distance)},
      {"ao_falloff", takes_falloff(a) ? Json(a.ao_falloff) : Json()},
      {"ao_occluders", asks_occlusion(a) ? Json(a.ao_occluders) : Json()},
      {"ao_back_faces", asks_occlusion(a) ? Json(!a.ao_ignore_back_faces) : Json()},
      {"curvature_radius", or_null(a.curvature_radius)},
      {"range", a.ranges},
      {"ao_error", a.ao_error > 0 ? Json(a.ao_error) : Json()},
      {"alpha_test", a.alpha_test > 0 ? Json(a.alpha_test) : Json()},
      {"transfer", a.transfers},
      {"own_maps", a.own_maps},
      {"pack", a.packs},
      {"layers", a.layers},
      {"id_by", a.id_by},
      {"origin", or_null(a.origin)},
      {"light", a.light},
      {"light_angle", a.light_angle},
      {"report_error", a.report_error},
      {"faces", a.faces == 0 ? Json() : Json(a.faces)},
      {"max_error", or_null(a.max_error)},
      {"max_angle", or_null(a.max_angle)},
      {"screen", or_null(a.screen)},
      {"max_outline", or_null(a.max_outline)},
      {"lod", a.lods == 0 ? Json() : Json(a.lods)},
      {"lod_growth", a.lods == 0 ? Json() : Json(a.lod_growth)},
      {"lod_uvs", a.lods == 0 ? Json() : Json(a.lod_uvs)},
      {"max_missed_percent", a.max_missed_percent},
      {"unwrap", a.unwrap},
      {"unwrap_method", or_null(a.unwrap_method)},
      {"density", a.density},
      {"save_match", or_null(a.save_match)},
      {"load_match", or_null(a.load_match)}};
}

}  // namespace kiln::cli
