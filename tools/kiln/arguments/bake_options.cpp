#include <algorithm>
#include <charconv>
#include <limits>
#include <string>
#include <tuple>

#include "arguments/bake_arguments.h"
#include "arguments/bake_values.h"
#include "arguments/likelihoods.h"
#include "arguments/parse.h"
#include "arguments/transfers.h"

namespace kiln::cli {
namespace {

/// "height=-0.2,0.2" of a map of this bake. The name lives as long as the arguments.
MapRange parse_range(const BakeArguments& a, const std::string& text) {
  const std::size_t equals = text.find('='), comma = text.find(',', equals);
  MapRange range;
  const auto number = [&](std::size_t begin, std::size_t end, float& value) {
    const char* const last = text.data() + end;
    const auto [stop, status] = std::from_chars(text.data() + begin, last, value);
    return status == std::errc() && stop == last;
  };
  if (equals == std::string::npos || comma == std::string::npos ||
      !number(equals + 1, comma, range.range.low) ||
      !number(comma + 1, text.size(), range.range.high)) {
    fail_usage("--range '" + text + "': write MAP=LO,HI, two numbers, such as height=-0.2,0.2.");
  }
  const std::string_view name = std::string_view(text).substr(0, equals);
  const std::vector<std::string> own = own_map_names(a);
  const bool is_own = std::find(own.begin(), own.end(), name) != own.end();
  range.kind = is_own ? MapKind{name} : find_map(name).kind;
  return range;
}

}  // namespace

BakeOptions bake_options(const BakeArguments& a) {
  BakeOptions options;
  std::tie(options.width, options.height) = parse_size(a.size);
  options.samples = a.samples;
  options.maps.clear();
  for (const std::string& name : maps_asked(a)) {
    const MapKind kind = find_map(name).kind;
    if (std::find(options.maps.begin(), options.maps.end(), kind) == options.maps.end()) {
      options.maps.push_back(kind);
    }
  }
  if (a.match != kAutomatic) options.match.method = find_match(a.match).method;
  options.match.views.criterion = criterion_values().at(a.view_criterion);
  options.match.fallback = fallback_methods(a);
  options.match.fallback_blend = a.fallback_blend;
  options.match.visibility.at = visibility_at_values().at(a.visibility_at);
  options.match.visibility.test = visibility_test_values().at(a.visibility_test);
  options.match.visibility.directions = a.directions;
  options.match.visibility.view_size = a.visibility_size;
  options.match.visibility.smoothing = a.visibility_smooth;
  options.match.visibility.clusters = a.visibility_clusters;
  options.match.visibility.cluster_deviation = a.visibility_deviation;
  if (const ViewLikelihood* const known = likelihood_values().find(a.view_weight)) {
    options.match.visibility.likelihood = *known;
  } else {
    options.match.visibility.likelihood = ViewLikelihood::list;
    options.match.visibility.likelihoods = load_likelihoods(a.view_weight);
  }
  options.match.views.size = a.view_size;
  options.match.views.refine = !a.no_view_refine;
  for (const std::string& view : a.view)
    options.match.views.directions.push_back(parse_direction("--view", view));
  if (a.views == "auto") {
    options.match.views.automatic = true;
  } else if (!a.views.empty()) {
    options.match.views.count = parse_views(a.views);
  }
  options.match.max_distance = optional_length("--max-distance", a.max_distance);
  if (a.force_uv) {
    options.match.uv.max_overlap = options.match.uv.max_distance =
        std::numeric_limits<double>::infinity();
  }
  if (!a.cage.empty() && a.cage != kAutomatic) options.match.cage = parse_cage(a.cage);
  options.match.two_sided = a.two_sided;
  options.match.ray.rule = ray_rule_values().at(a.ray);
  options.match.ray.direction = ray_direction_values().at(a.direction);
  options.match.ray.edge_width = optional_length("--edge-width", a.edge_width);
  options.match.uv_copies = uv_copies_values().at(a.uv_copies);
  options.report.recall = a.recall;
  options.encoding.space = space_values().at(a.space);
  options.encoding.bitangent = bitangent_values().at(a.bitangent);
  options.encoding.flip_y = a.flip_y;
  options.encoding.two_component = a.two_component;
  options.encoding.raw = a.raw;
  options.occlusion.by = occlusion_by_values().at(a.ao_by);
  options.occlusion.views = a.ao_views;
  options.occlusion.rays = a.ao_rays;
  options.occlusion.back_faces = !a.ao_ignore_back_faces;
  const auto named = [&](const char* name) {
    return std::find(a.ao_occluders.begin(), a.ao_occluders.end(), name) != a.ao_occluders.end();
  };
  options.occlusion.by_high = named("high");
  options.occlusion.by_low = named("low");
  options.occlusion.own_part = a.part_occlusion == "own";
  options.occlusion.distance = optional_length("--ao-distance", a.ao_distance);
  options.occlusion.falloff = occlusion_falloff_values().at(a.ao_falloff);
  options.curvature_radius = optional_length("--curvature-radius", a.curvature_radius);
  for (const std::string& text : a.ranges) options.encoding.ranges.push_back(parse_range(a, text));
  options.occlusion.max_error = a.ao_error;
  options.own_maps = load_own_maps(a);
  options.id_by = id_by_values().at(a.id_by);
  if (!a.origin.empty()) options.encoding.origin = parse_place("--origin", a.origin);
  options.light = {parse_direction("--light", a.light), a.light_angle};
  options.report.errors = a.report_error;
  options.encoding.miss = miss_policy(a);
  options.encoding.gutter = parse_gutter(a.gutter);
  options.encoding.mips = a.mips;
  options.report.keep_match = !a.save_match.empty() || a.reasons;
  return options;
}

std::vector<std::string> occluder_files(const BakeArguments& a) {
  std::vector<std::string> files;
  for (const std::string& name : a.ao_occluders) {
    if (name != "high" && name != "low") files.push_back(name);
  }
  return files;
}

LoadMeshOptions load_options(const BakeArguments& a, MeshSide side) {
  LoadMeshOptions options = load_options(a.frame, side);
  options.triangulation = triangulation_values().at(a.triangulate);
  return options;
}

SaveImageOptions image_options(const BakeArguments& a) {
  SaveImageOptions options;
  options.format = format_values().at(a.format);
  options.dither = a.dither;
  return options;
}

RayTraversal traversal(const BakeArguments& a) { return traversal_values().at(a.traversal); }

}  // namespace kiln::cli
