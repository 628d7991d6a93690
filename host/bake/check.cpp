// Checks of options that do not depend on the meshes.
#include <algorithm>
#include <cmath>

#include "bake/match_stage.h"
#include "base/formatted.h"
#include "base/option.h"
#include "detail/registry.h"
#include "kiln/validate.h"
#include "match/uv.h"
#include "match/views.h"

namespace kiln {
namespace {

constexpr std::uint32_t kMaxViews = 512;
constexpr std::uint32_t kMaxRecallTestPoints = 1U << 20;

constexpr const char* kRangeId = "option-range";
constexpr const char* kContradictionId = "option-contradiction";

[[noreturn]] void throw_usage_error(const Message& message, const char* id = kRangeId) {
  throw Error(ErrorCode::usage, message, id);
}

std::string quote(std::string_view name) { return std::string("'").append(name).append("'"); }

/// Rejects values outside of an enumeration, which come from casts or uninitialized memory.
template <typename Enum>
void check_enum(const char* name, Enum value, Enum last) {
  const auto number = static_cast<long long>(value);
  if (number >= 0 && number <= static_cast<long long>(last)) return;
  throw_usage_error(std::string(name) + " is " + std::to_string(number) +
                        ", which its enumeration does not have: use one of its names.",
                    "option-enum");
}

void check_enums(const BakeOptions& options) {
  check_enum("views.criterion", options.match.views.criterion, ViewCriterion::angle);
  check_enum("visibility.at", options.match.visibility.at, VisibilityAt::texel);
  check_enum("visibility.test", options.match.visibility.test, VisibilityTest::rays);
  check_enum("visibility.likelihood", options.match.visibility.likelihood, ViewLikelihood::list);
  check_enum("ray.rule", options.match.ray.rule, RayRule::nearest);
  check_enum("uv_copies", options.match.uv_copies, UvCopies::first);
  check_enum("ray.direction", options.match.ray.direction, RayDirection::painted);
  check_enum("space", options.encoding.space, NormalMapSpace::face);
  check_enum("miss", options.encoding.miss, MissPolicy::mark);
  check_enum("occlusion.by", options.occlusion.by, OcclusionBy::automatic);
  check_enum("occlusion.falloff", options.occlusion.falloff, OcclusionFalloff::smooth);
}

/// Runs a check of another part of the code, and rethrows its errors as errors of options.
template <typename Check>
void rethrow_as_option_error(const Check& check) {
  try {
    check();
  } catch (const Error& error) {
    throw_usage_error(error.message());
  }
}

/// Runs a look-up of a name, and rethrows its errors as errors of options.
template <typename Find>
void rethrow_as_unknown_name(const Find& find) {
  try {
    find();
  } catch (const Error& error) {
    throw_usage_error(error.message(), "option-name");
  }
}

void check_length(const Message& name, const Length& length, bool may_be_zero) {
  if (!std::isfinite(length.value) || length.value < 0 || (!may_be_zero && length.value == 0)) {
    throw_usage_error(name + " is " + decimal(length.value) + ": it must be a finite length " +
                      (may_be_zero ? "of 0 or more." : "above 0."));
  }
}

void check_views(const ViewOptions& views) {
  if (views.count.value_or(1) > kMaxViews || views.directions.size() > kMaxViews) {
    throw_usage_error("More than " + std::to_string(kMaxViews) +
                      " views are requested: use fewer.");
  }
  if (views.count && *views.count == 0 && views.directions.empty()) {
    throw_usage_error("No view is requested: use at least one.");
  }
  if (views.size > kMaxViewSide) {
    throw_usage_error("The depth views' size is " + std::to_string(views.size) +
                      ": it must be 1 to " + std::to_string(kMaxViewSide) + " pixels.");
  }
}

void check_fallback(const BakeOptions& options) {
  constexpr std::uint32_t kMaxBlendTexels = 256;
  if (options.match.fallback_blend > kMaxBlendTexels) {
    throw_usage_error("The width of blending into the fallback is " +
                      std::to_string(options.match.fallback_blend) + " texels: it must be 0 to " +
                      std::to_string(kMaxBlendTexels) + ".");
  }
  if (options.match.fallback.empty()) {
    if (options.match.fallback_blend == 0) return;
    throw_usage_error(
        "Blending with the fallback is requested, but there is no fallback: choose one.",
        kContradictionId);
  }
  if (options.match.saved != nullptr) {
    throw_usage_error(
        "A fallback is requested, but a saved match is used unchanged: omit one of them.",
        kContradictionId);
  }
  std::vector<MatchMethod> view_count = {options.match.method};
  for (const MatchMethod next : options.match.fallback) {
    if (obeys(match_row(next).info, "match.uv")) {
      throw_usage_error(
          quote(next.name) +
              " cannot be a fallback, since it does not search for points: choose a match that "
              "does, such as " +
              match_names([](const MatchRow& row) { return row.is_good_fallback; }) + ".",
          kContradictionId);
    }
    if (std::find(view_count.begin(), view_count.end(), next) != view_count.end()) {
      throw_usage_error(
          quote(next.name) +
              " is listed twice, but would miss the same samples again: choose another fallback.",
          kContradictionId);
    }
    view_count.push_back(next);
  }
}

void check_size(const BakeOptions& options) {
  constexpr std::uint32_t kMaxSize = 16384;
  if (options.width < 1 || options.width > kMaxSize || options.height < 1 ||
      options.height > kMaxSize) {
    throw_usage_error("The map's size is " + std::to_string(options.width) + "x" +
                      std::to_string(options.height) + ": each side must be 1 to 16384 texels.");
  }
  if (options.samples < 1 || options.samples > 16) {
    throw_usage_error("samples is " + std::to_string(options.samples) +
                      ": it must be 1 to 16 per side.");
  }
}

void check_distances(const BakeOptions& options) {
  if (options.match.max_distance) check_length("max_distance", *options.match.max_distance, false);
  if (options.match.near_distance)
    check_length("near_distance", *options.match.near_distance, false);
  if (options.match.cage) check_length("cage", *options.match.cage, true);
  if (options.match.ray.edge_width)
    check_length(option("match.ray.edge_width"), *options.match.ray.edge_width, false);
  if (options.match.cage && options.match.cage_mesh != nullptr) {
    throw_usage_error("Both a cage distance and a cage mesh were given: choose one.",
                      kContradictionId);
  }
  const bool cage = options.match.cage || options.match.cage_mesh != nullptr;
  if (cage && options.match.saved == nullptr &&
      !any_match_or_fallback(options,
                             [](const MatchRow& row) { return obeys(row.info, "match.cage"); })) {
    throw_usage_error(
        "A cage was given, but " + quote(options.match.method.name) +
            " casts no rays: leave the cage out, or match by " +
            match_names([](const MatchRow& row) { return obeys(row.info, "match.cage"); }) + ".",
        kContradictionId);
  }
}

void check_map(MapKind map, const BakeOptions& options) {
  if (!obeys(map_row(map).info, "match.visibility")) return;
  if (options.match.saved == nullptr &&
      obeys(match_row(options.match.method).info, "match.visibility"))
    return;
  throw_usage_error(
      "The map " + std::string(map.name) +
          " stores directions that only a match by visibility computes: choose the match " +
          match_names([](const MatchRow& row) { return obeys(row.info, "match.visibility"); }) +
          (options.match.saved != nullptr ? " instead of a saved match" : "") +
          ", or leave the map out.",
      kContradictionId);
}

/// Rejects options that depth views do not support, since a view contains only the nearest front
/// faces.
void check_occlusion_views(const OcclusionOptions& occlusion) {
  if (occlusion.by != OcclusionBy::views) return;
  const char* unsupported_option = occlusion.distance                            ? "a distance"
                                   : occlusion.falloff != OcclusionFalloff::none ? "a falloff"
                                   : !occlusion.back_faces   ? "back faces that do not occlude"
                                   : occlusion.max_error > 0 ? "a maximum error"
                                                             : nullptr;
  if (unsupported_option == nullptr) return;
  throw_usage_error(std::string("Occlusion by views is requested with ") + unsupported_option +
                        ", which depth views do not support: use rays, or leave it out.",
                    kContradictionId);
}

/// Checks options of single maps.
void check_map_options(const BakeOptions& options) {
  if (options.occlusion.rays < 1 || options.occlusion.rays > 4096) {
    throw_usage_error(option("occlusion.rays") + " is " + std::to_string(options.occlusion.rays) +
                      ": it must be 1 to 4096.");
  }
  if (options.occlusion.views < 16 || options.occlusion.views > 4096) {
    throw_usage_error(option("occlusion.views") + " is " + std::to_string(options.occlusion.views) +
                      ": it must be 16 to 4096.");
  }
  check_occlusion_views(options.occlusion);
  if (options.occlusion.distance)
    check_length(option("occlusion.distance"), *options.occlusion.distance, false);
  if (!options.occlusion.by_high && !options.occlusion.by_low &&
      options.occlusion.by_others.empty()) {
    throw_usage_error(option("occlusion.by_high") + ", " + option("by_low") + " and " +
                      option("by_others") + " exclude all occluders: include one of them.");
  }
  if (options.occlusion.own_part && options.match.parts == nullptr) {
    throw_usage_error(option("occlusion.own_part") + " is set, but there are no parts: give " +
                          option("match.parts") + ", or leave it out.",
                      kContradictionId);
  }
  for (const Mesh* mesh : options.occlusion.by_others) {
    if (mesh == nullptr)
      throw_usage_error(option("occlusion.by_others") +
                        " contains a null pointer: all pointers must refer to meshes.");
    validate(*mesh);
  }
  const Vec3& light = options.light.direction;
  const double squared =
      double{light.x} * light.x + double{light.y} * light.y + double{light.z} * light.z;
  if (!std::isfinite(squared) || squared == 0) {
    throw_usage_error(option("light.direction") + " must be a finite direction other than 0.");
  }
  if (!(options.light.angle_degrees >= 0 && options.light.angle_degrees <= 90)) {
    throw_usage_error(option("light.angle_degrees") + " is " +
                      decimal(options.light.angle_degrees) + ": it must be 0 to 90.");
  }
  if (!(options.occlusion.max_error >= 0 && options.occlusion.max_error <= 1)) {
    throw_usage_error(option("occlusion.max_error") + " is " +
                      decimal(options.occlusion.max_error) + ": it must be 0 to 1.");
  }
  if (options.encoding.origin &&
      !std::all_of(options.encoding.origin->begin(), options.encoding.origin->end(),
                   [](double x) { return std::isfinite(x); })) {
    throw_usage_error(option("encoding.origin") + " must be finite.");
  }
  if (options.curvature_radius)
    check_length(option("curvature_radius"), *options.curvature_radius, false);
}

/// Throws if a map variant sets options that this kind of map ignores, or has invalid values.
void check_variant(const MapVariant& map, const BakeOptions& options) {
  const MapInfo& info = map_row(map.kind).info;
  const auto check = [&](bool is_set, const char* setting) {
    if (!is_set || obeys(info, setting)) return;
    throw_usage_error("The map " + map.name + " has a setting " + option(setting) + ", which " +
                          std::string(map.kind.name) + " does not use: leave it out.",
                      kContradictionId);
  };
  check(map.occlusion.has_value(), "occlusion");
  check(map.curvature_radius.has_value(), "curvature_radius");
  check(map.light.has_value(), "light");
  check(map.id_by.has_value(), "id_by");
  const BakeOptions variant_options = options_of(map, options);
  check_enums(variant_options);
  check_map_options(variant_options);
}

void check_ranges(const BakeOptions& options) {
  std::vector<std::string_view> seen_maps;
  for (const MapRange& range_option : options.encoding.ranges) {
    const MapKind kind = range_option.kind;
    const ValueRange range = range_option.range;
    const std::string name(kind.name);
    if (!std::isfinite(range.low) || !std::isfinite(range.high) || !(range.low < range.high)) {
      throw_usage_error("The range of " + name + " is " + decimal(range.low) + " to " +
                        decimal(range.high) +
                        ": both values must be finite, and the first below the second.");
    }
    if (std::find(seen_maps.begin(), seen_maps.end(), kind.name) != seen_maps.end()) {
      throw_usage_error("The map " + name + " has two ranges: remove one.", kContradictionId);
    }
    seen_maps.push_back(kind.name);
    const auto is_called = [&](const auto& own) { return own.name == kind.name; };
    if (std::any_of(options.transfers.begin(), options.transfers.end(), is_called) ||
        std::any_of(options.own_maps.begin(), options.own_maps.end(), is_called)) {
      continue;
    }
    const MapVariant* const variant = find_variant(options, kind.name);
    if (variant == nullptr &&
        std::find(options.maps.begin(), options.maps.end(), kind) == options.maps.end()) {
      throw_usage_error("There is a range of '" + name +
                            "', which is not baked: add the map, or remove the range.",
                        kContradictionId);
    }
    const MapType type = map_row(variant != nullptr ? variant->kind : kind).info.type;
    if (type == MapType::unit_vector || type == MapType::id || type == MapType::coverage) {
      throw_usage_error(
          "The map " + name + " takes no range: its values are directions, names or coverage.",
          kContradictionId);
    }
  }
}

void check_two_component(const BakeOptions& options) {
  if (!options.encoding.two_component) return;
  const std::vector<MapKind> kinds = kinds_of(options);
  const bool can_point_below = options.encoding.space == NormalMapSpace::object ||
                               std::any_of(kinds.begin(), kinds.end(), [&](MapKind map) {
                                 return map_row(map).info.space == NormalMapSpace::object;
                               });
  if (!can_point_below) return;
  throw_usage_error(
      "Two components only suffice for normals above the surface: use tangent or face space.",
      kContradictionId);
}

void check_clusters(const BakeOptions& options) {
  if (options.match.visibility.clusters <= 1) return;
  if (!obeys(match_row(options.match.method).info, "match.visibility.clusters") ||
      options.match.saved != nullptr) {
    throw_usage_error(
        "Clusters of directions require a match by visibility: choose that match, or one cluster.",
        kContradictionId);
  }
  if (options.report.keep_match) {
    throw_usage_error(
        "Several clusters have a match each, so that none can be kept: use one cluster, or do not "
        "keep the match.",
        kContradictionId);
  }
}

}  // namespace

void validate(const BakeOptions& options) {
  check_size(options);
  check_enums(options);
  rethrow_as_unknown_name([&] {
    match_row(options.match.method);
    for (const MatchMethod next : options.match.fallback) match_row(next);
    for (const MapKind map : kinds_of(options)) map_row(map);
  });
  if (map_count(options) == 0) {
    throw_usage_error("No map is requested: give at least one, such as normal.");
  }
  if (!(options.own_map_seconds >= 1 && options.own_map_seconds <= 86400)) {
    throw_usage_error("own_map_seconds is " + decimal(options.own_map_seconds) +
                      ": it must be 1 to 86400.");
  }
  check_distances(options);
  check_map_options(options);
  if (options.encoding.gutter < -1 || options.encoding.gutter > 4096) {
    throw_usage_error("gutter (padding) is " + std::to_string(options.encoding.gutter) +
                      ": it must be 0 to 4096 texels, or -1 for unlimited padding.");
  }
  check_two_component(options);
  check_ranges(options);
  if (options.report.recall > kMaxRecallTestPoints) {
    throw_usage_error("recall is " + std::to_string(options.report.recall) +
                      " test points: it must be 0 to " + std::to_string(kMaxRecallTestPoints) +
                      ".");
  }
  for (const MapKind map : kinds_of(options)) check_map(map, options);
  for (const MapVariant& map : options.variants) check_variant(map, options);
  check_views(options.match.views);
  check_fallback(options);
  if (any_match_or_fallback(
          options, [](const MatchRow& row) { return obeys(row.info, "match.visibility"); })) {
    rethrow_as_option_error([&] { check_visibility(options.match.visibility); });
  }
  check_clusters(options);
  rethrow_as_option_error([&] { check_uv(options.match.uv); });
}

void check_options(const BakeOptions& options) { validate(options); }

}  // namespace kiln
