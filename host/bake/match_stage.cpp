#include "bake/match_stage.h"

#include <algorithm>
#include <utility>

#include "base/counted.h"
#include "base/formatted.h"
#include "base/option.h"
#include "match/bevel.h"
#include "match/fallback.h"
#include "match/part_matcher.h"
#include "match/saved.h"
#include "mesh/length.h"

namespace kiln {
namespace {

/// The search distance in units of the meshes' local frame (mesh/frame.h); see
/// MatchOptions::max_distance for the default.
double match_distance(const BakeOptions& options, const LowSurface& surface, const Frame& frame) {
  // A larger search distance would not find more points.
  constexpr double kMaxSearchDistance = 1048576;
  if (options.match.max_distance)
    return std::min(to_frame(*options.match.max_distance, frame), kMaxSearchDistance);
  double distance = 0;
  if (options.match.cage) distance = 2 * to_frame(*options.match.cage, frame);
  if (options.match.cage_mesh != nullptr) distance = surface.cage_length;
  return distance > 0 ? distance : to_frame(Length::share(kSearchDistance), frame);
}

/// Warns about a length as large as the high poly, which is likely a wrong unit or a missing % sign.
void warn_about_length(const Message& name, const std::optional<Length>& length, const Frame& frame,
                       std::vector<Warning>& warnings) {
  if (!length) return;
  const double diagonals = to_frame(*length, frame) / (frame.diagonal * frame.scale);
  if (!(diagonals > 1)) return;
  const std::string text = formatted(
      " is %.3g times as long as the high poly's diagonal of %.4g: rays of that length hit the far "
      "side and other parts. 1%% to 5%% is typical: check whether a percentage was meant.",
      diagonals, frame.diagonal);
  warnings.push_back({"far-rays", name + text, 1});
}

/// True if rays follow the offsets from the low poly to a cage mesh.
bool has_offsets(const LowSurface& surface) {
  return surface.has_cage_mesh && surface.cage_kind == CageKind::offsets;
}

/// Bevels of the high poly, cached as long as it does not change.
struct CachedBevels {
  double distance = 0;  ///< Largest search distance for which the bevels were computed
  Bevels bevels;
};

EdgeReport edge_report(const Bevels& bevels, double unit) {
  std::vector<float> widths = bevels.widths;
  std::sort(widths.begin(), widths.end());
  return {widths.size(), bevels.found, double{widths.front()} * unit,
          double{widths[widths.size() / 2]} * unit, double{widths.back()} * unit};
}

/// Makes one matcher for the whole mesh, or one for each part.
std::unique_ptr<Matcher> matcher_of(const MatchRow& row, const MatchRequest& request,
                                    const Parts* parts, MatchNotes& notes) {
  return parts != nullptr ? part_matcher(row, request, *parts, notes) : row.make(request, notes);
}

}  // namespace

MatchRequest match_request(const BakeOptions& options, const Source::Impl& source,
                           const LowSurface& surface) {
  MatchRequest request{.source = source, .surface = surface};
  request.width = options.width;
  request.height = options.height;
  request.samples = options.samples;
  request.distance = match_distance(options, surface, source.frame);
  if (options.match.near_distance) {
    request.near_distance = to_frame(*options.match.near_distance, source.frame);
  }
  if (options.match.cage) request.cage = to_frame(*options.match.cage, source.frame);
  request.cage_mesh = options.match.cage_mesh != nullptr;
  request.two_sided = options.match.two_sided;
  request.views = options.match.views;
  request.visibility = options.match.visibility;
  request.uv = options.match.uv;
  request.ray = options.match.ray;
  return request;
}

SampleDirections make_sample_directions(const BakeOptions& options, const Source::Impl& source,
                                        const LowSurface& surface, EdgeReport* report) {
  const RayDirection direction = options.match.ray.direction;
  if (options.match.saved != nullptr ||
      !obeys(match_row(options.match.method).info, "match.ray.direction") ||
      direction == RayDirection::averaged || has_offsets(surface)) {
    return {};
  }
  cl::Context& context = context_of(source.device);
  if (direction == RayDirection::painted) return {context, surface};
  const std::shared_ptr<const HardEdges> found =
      surface.made->get<HardEdges>([&] { return HardEdges::of(surface); });
  const HardEdges& hard_edges = *found;
  if (hard_edges.edges.empty()) return {};
  if (direction == RayDirection::face) return {context, surface, hard_edges, {}};
  Bevels bevels;
  if (options.match.ray.edge_width) {
    const double width = to_frame(*options.match.ray.edge_width, source.frame);
    bevels.widths.assign(hard_edges.edges.size(), static_cast<float>(width));
    bevels.median = bevels.widths.front();
  } else {
    const double distance = match_distance(options, surface, source.frame);
    const auto find = [&] {
      return CachedBevels{distance,
                          find_bevels(source, surface, hard_edges, distance, options.match.parts)};
    };
    const bool is_cacheable = options.match.parts == nullptr && !source.will_move;
    const auto cached = is_cacheable ? surface.made->get<CachedBevels>(find) : nullptr;
    bevels = cached != nullptr && cached->distance == distance ? cached->bevels : find().bevels;
  }
  if (report != nullptr) *report = edge_report(bevels, 1 / source.frame.scale);
  return {context, surface, hard_edges, bevels.widths};
}

bool directions_depend_on_high(const BakeOptions& options) {
  return obeys(match_row(options.match.method).info, "match.ray.direction") &&
         !options.match.ray.edge_width && options.match.ray.direction == RayDirection::automatic;
}

SheetDistances sheet_distances(const BakeOptions& options, const LowSurface& surface) {
  const bool is_distance_given =
      options.match.max_distance || options.match.cage || options.match.cage_mesh != nullptr;
  const bool uses_sheet_distance =
      any_match_or_fallback(options, [](const MatchRow& row) { return row.uses_sheet_distance; });
  if (is_distance_given || options.match.saved != nullptr || !uses_sheet_distance) return {};
  return *surface.made->get<SheetDistances>([&] { return SheetDistances(surface); });
}

void add_notes(MatchNotes notes, BakeReport& report) {
  if (notes.views) report.views = std::move(notes.views);
  if (notes.visibility) report.visibility = notes.visibility;
  if (notes.uv) report.uv = notes.uv;
  report.warnings.insert(report.warnings.end(), notes.warnings.begin(), notes.warnings.end());
}

// The warning may only depend on the options, not on structures of the source that an earlier bake has built.
void warn_about_duplicates(const Source::Impl& source, const BakeOptions& options,
                           BakeReport& report) {
  const bool searches_bvh =
      any_match_or_fallback(options, [](const MatchRow& row) { return row.is_refittable; }) &&
      (options.match.saved == nullptr || !options.match.fallback.empty());
  const std::uint64_t count = searches_bvh ? source.duplicates() : 0;
  if (count == 0) return;
  report.warnings.push_back(
      {"duplicate-triangles",
       counted(count, "triangle") + " of the high poly " +
           (count == 1 ? "is an exact duplicate of another" : "are exact duplicates of others") +
           "; only the first of each is used. Weld the mesh, or remove duplicate parts.",
       count});
}

std::unique_ptr<Matcher> make_matcher(const Source::Impl& source, const LowSurface& surface,
                                      const BakeOptions& options, BakeReport& report,
                                      Clusters& clusters, const BakeProgress& progress,
                                      bool blends_directions) {
  const double unit = 1 / source.frame.scale;
  MatchRequest request = match_request(options, source, surface);
  request.cluster = clusters.cluster;
  request.field = &clusters.field;
  request.max_sheet_distance = double{sheet_distances(options, surface).max_search_distance()};
  if (progress) {
    request.progress = [preparing = progress.part(0, kPreparingShare)](double done,
                                                                       std::string_view doing) {
      return preparing.report(done, doing);
    };
  }
  report.max_distance = options.match.saved == nullptr ? request.distance * unit : 0;
  if (options.match.saved == nullptr && request.cage && request.distance <= *request.cage) {
    report.warnings.push_back({"short-rays",
                               "Rays start at the cage and end before they reach the low poly: " +
                                   option("match.max_distance") + " should be about twice " +
                                   option("match.cage") + ".",
                               1});
  }
  if (options.match.saved == nullptr &&
      obeys(match_row(options.match.method).info, "match.max_distance")) {
    warn_about_length(option("match.cage"), options.match.cage, source.frame, report.warnings);
    warn_about_length(option("match.max_distance"), options.match.max_distance, source.frame,
                      report.warnings);
    if (report.cage_mesh) {
      warn_about_length("The distance from the cage to the low poly",
                        Length::absolute(report.cage_mesh->max_outward), source.frame,
                        report.warnings);
    }
  }
  const double build_seconds_before = source.stats().build_seconds;
  MatchNotes notes;
  std::unique_ptr<Matcher> matcher;
  if (options.match.saved != nullptr) {
    matcher = saved_matcher(context_of(source.device), *options.match.saved, unit);
  } else {
    const MatchRow& row = match_row(options.match.method);
    if (!obeys(row.info, "match.max_distance") && options.match.fallback.empty())
      report.max_distance = 0;
    request.blends_directions =
        blends_directions && options.match.ray.direction == RayDirection::automatic;
    matcher = matcher_of(row, request, options.match.parts, notes);
    request.blends_directions = false;
  }
  if (!options.match.fallback.empty()) {
    std::vector<std::unique_ptr<Matcher>> fallbacks;
    for (const MatchMethod next : options.match.fallback) {
      fallbacks.push_back(matcher_of(match_row(next), request, options.match.parts, notes));
    }
    matcher = with_fallbacks(context_of(source.device), std::move(matcher), std::move(fallbacks));
  }
  add_notes(std::move(notes), report);
  warn_about_duplicates(source, options, report);
  report.seconds_build += source.stats().build_seconds - build_seconds_before;
  return matcher;
}

}  // namespace kiln
