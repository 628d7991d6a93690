#include "simplify/simplify_job.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "base/async_task.h"
#include "base/counted.h"
#include "base/formatted.h"
#include "base/percent.h"
#include "base/progress_guard.h"
#include "mesh/charts.h"
#include "mesh/fans.h"
#include "mesh/normals.h"
#include "simplify/collapse_pieces.h"
#include "simplify/inside_out.h"
#include "simplify/presimplify.h"
#include "simplify/rtin.h"
#include "simplify/simplify_uvs.h"
#include "simplify/small_components.h"

namespace kiln {
namespace {

/// High polys with more triangles than kDirectLimit are presimplified to that number, or to fewer (at least
/// kMinDirectLimit) if few faces are requested. Finely curved meshes, which meshoptimizer spoils, are collapsed in
/// pieces instead, unless they have more than kMaxFinelyCurvedTriangles triangles.
constexpr std::size_t kDirectLimit = 100'000, kMinDirectLimit = 50'000,
                      kMaxFinelyCurvedTriangles = 2'500'000;
/// Minimum ratio of presimplified triangles to requested faces: kMinStartRatio if that gives at most kDirectLimit
/// triangles, else kMinStartRatioOfLargeGoals.
constexpr std::size_t kMinStartRatio = 10, kMinStartRatioOfLargeGoals = 4;
/// Smallest number of faces of a closed component: that of a tetrahedron.
constexpr std::uint32_t kMinComponentFaces = 4;
/// Components are removed if the result has more than kMaxFaceExcess times the requested faces, in at most
/// kMaxSurplusRounds rounds.
constexpr double kMaxFaceExcess = 1.1;
constexpr int kMaxSurplusRounds = 3;
/// Number of samples for estimating which components are small.
constexpr std::uint64_t kComponentSamples = 1 << 14;
/// Maximum number of presimplifications.
constexpr int kMaxPresimplifications = 4;
/// Maximum number of presimplifications if the goal is an error instead of a number of faces. Presimplification then
/// causes fewer flaws.
constexpr int kMaxErrorBoundPresimplifications = 2;
/// If there are at most this many flaws, presimplification is repeated and keeps the high poly around them.
constexpr std::size_t kMaxFlawedPlaces = 256;

/// Number of triangles that presimplification leaves.
/// \param faces  requested number of faces; 0 if the goal is an error
std::size_t presimplified_faces(std::size_t faces) {
  if (faces == 0) return kDirectLimit;
  const std::size_t start_faces = std::clamp(kMinStartRatio * faces, kMinDirectLimit, kDirectLimit);
  return std::max(start_faces, kMinStartRatioOfLargeGoals * faces);
}

/// \param place_of  formats the position of the first degenerate triangle (for false) or folded triangle (for true)
void warn_of_flaws(SimplifyReport& report, const std::function<std::string(bool)>& place_of) {
  const auto warn = [&](const char* code, std::uint64_t count, const std::string& what,
                        std::optional<bool> folded = {}) {
    if (count == 0) return;
    const std::string where = folded ? ", one " + place_of(*folded) : "";
    report.warnings.push_back(
        {code, what + where + "; request more faces, or repair the high poly at that place",
         count});
  };
  const auto triangles = [](std::uint64_t count, const char* one, const char* many) {
    return counted(count, "triangle") + " of the low poly " + (count == 1 ? one : many) +
           " and could not be repaired";
  };
  warn("folded-triangles", report.folded,
       triangles(report.folded, "faces away from the high poly", "face away from the high poly"),
       true);
  warn("flat-triangles", report.without_area,
       triangles(report.without_area, "has no area", "have no area"), false);
  warn("new-holes", report.holes,
       counted(report.holes, "hole") + " of the low poly " + (report.holes == 1 ? "is" : "are") +
           " not in the high poly");
}

}  // namespace

/// Repairs folded triangles so that they face the right way again, where possible.
void SimplifyState::turn_back_folds(std::span<const Fold> folds) {
  constexpr int kMaxUnfoldRounds = 3;  // Repeated, since one fold may block the repair of another
  for (int round = 0; round < kMaxUnfoldRounds; ++round) {
    bool any = false;
    for (const Fold& fold : folds) {
      const auto is_bad = [&](const TriangleCorners& p) {
        const Vec3d normal = cross(p[1] - p[0], p[2] - p[0]);
        return !(dot(normal, fold.surface) > 0);
      };
      const Triangle& t = mesh_.triangles[fold.triangle];
      if (mesh_.alive[fold.triangle] == 0) continue;
      if (!is_bad({mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]]})) continue;
      any = collapser_.repair_triangle(fold.triangle, is_bad) || any;
    }
    if (!any) return;
  }
}

void SimplifyJob::report_progress(double share) {
  if (!reported_progress_) return;
  reported_progress_ = std::max(*reported_progress_, share);
  ProgressGuard::poll_at(*reported_progress_, "simplifying");
}

SimplifyResult SimplifyJob::simplify_to_count(const Work& work) const {
  SimplifyState simplify_state(work, layout(), options_, scale_);
  simplify_state.set_two_sided(two_sided_flags(work));
  simplify_state.collapser().run(options_.faces);
  SimplifyResult result;
  simplify_state.extract(result);
  return result;
}

/// Repairs flawed triangles.
/// \returns the number of repaired triangles
std::size_t SimplifyJob::repair_flaws(SimplifyResult& result) {
  Flaws flaws = flaw_check_.find(result.points, result.triangles);
  const std::size_t found = flaws.count();
  for (int round = 0; round < kMaxRepairRounds && !flaws.none(); ++round) {
    SimplifyState simplify_state(result.points, result.triangles, result.labels,
                                 options_.keep_uvs ? &result.layout : nullptr, options_, scale_);
    const auto is_bad = [&](const TriangleCorners& corners) {
      return flaw_check_.is_flaw(corners);
    };
    bool any = false;
    for (const auto* list : {&flaws.flat, &flaws.facing_down, &flaws.folded}) {
      for (const std::uint32_t t : *list)
        any = simplify_state.collapser().repair_triangle(t, is_bad) || any;
    }
    if (!any) break;
    simplify_state.extract(result);
    flaws = flaw_check_.find(result.points, result.triangles);
  }
  return found - std::min(found, flaws.count());
}

/// True if there are no flaws. Counts the folds and degenerate triangles that remain, and holes that the high poly does
/// not have.
bool SimplifyJob::has_no_flaws(SimplifyResult& result) {
  const Flaws flaws = flaw_check_.find(result.points, result.triangles);
  report_.folded = flaws.folded.size() + flaws.facing_down.size();
  report_.without_area = flaws.flat.size();
  const std::uint64_t rim_count = count_rims(result.triangles, result.points.size());
  const std::uint64_t before =
      rim_count == 0 ? 0 : count_rims(dense_.triangles, dense_.points.size());
  report_.holes = rim_count > before ? rim_count - before : 0;
  result.flawed.clear();
  for (const auto* list : {&flaws.flat, &flaws.facing_down, &flaws.folded}) {
    for (const std::uint32_t t : *list) {
      const Triangle& v = result.triangles[t];
      const Vec3d &a = result.points[v[0]], &b = result.points[v[1]], &c = result.points[v[2]];
      const double longest = std::max({length(b - a), length(c - b), length(a - c)});
      result.flawed.push_back({(a + b + c) * (1.0 / 3), longest + kFlawRadius});
    }
  }
  return flaws.none() && report_.holes == 0;
}

/// True if the high poly is first reduced in pieces: see is_finely_curved().
bool SimplifyJob::is_finely_tessellated() {
  if (!is_finely_tessellated_) {
    const std::size_t count = dense_.triangles.size();
    is_finely_tessellated_ = options_.faces != 0 && count > kDirectLimit &&
                             count <= kMaxFinelyCurvedTriangles && !options_.height_field &&
                             is_finely_curved(dense_);
  }
  return *is_finely_tessellated_;
}

/// The mesh from which collapses start: the high poly, or its presimplification for a number of faces.
/// \param parts  true: none of its components may vanish
/// \param finely_curved  true: reduces in pieces instead of by meshoptimizer
/// \param known_pieces  as for presimplify(); may be null
Work SimplifyJob::start(std::size_t faces, std::span<const Ball> untouched, bool parts,
                        bool finely_curved, PresimplifiedPieces* known_pieces) const {
  const std::size_t near_goal = presimplified_faces(faces);
  const bool dense = dense_.triangles.size() > std::max(kDirectLimit, near_goal) &&
                     !options_.keep_uvs && !options_.hull;
  if (dense && finely_curved) {
    return collapse_in_pieces(dense_, dense_positions_, near_goal, untouched,
                              [this](const Vec3d& p) { return scale_.snap(p); });
  }
  Work work = dense_;
  if (dense) {
    const double error = options_.faces == 0 ? 0.1 * options_.max_error : 1.0;
    if (options_.height_field && untouched.empty() && work.labels.empty() &&
        simplify_to_rtin(work, near_goal, error)) {
      return work;
    }
    presimplify(work, near_goal, error, options_.height_field, untouched, parts, known_pieces);
  }
  return work;
}

std::vector<SimplifyResult> SimplifyJob::levels(std::vector<std::uint32_t>& faces) {
  std::vector<SimplifyResult> results;
  const Work work = start(faces.empty() ? 0 : faces.front(), {}, false, is_finely_tessellated());
  SimplifyState simplify_state(work, layout(), options_, scale_);
  simplify_state.set_two_sided(two_sided_flags(work));
  std::vector<std::uint32_t> found;
  for (const std::uint32_t goal : faces) {
    const std::size_t before = simplify_state.faces();
    // A collapse removes two faces, so the previous level may have this few faces already.
    if (!results.empty() && before <= goal) continue;
    simplify_state.collapser().run(goal);
    if (!results.empty() && simplify_state.faces() == before) break;
    simplify_state.extract(results.emplace_back());
    found.push_back(goal);
  }
  faces = std::move(found);
  return results;
}

bool SimplifyJob::improve(SimplifyResult& result) {
  if (fit(result)) return true;
  report_.mended = repair_flaws(result);
  return has_no_flaws(result);
}

bool SimplifyJob::may_solve() { return dense_.triangles.size() > kDirectLimit; }

DistanceReport SimplifyJob::deviation(const SimplifyResult& result) const {
  return measure(result, kMaxSamples);
}

/// Simplifies `work`, which is the high poly or its presimplification.
/// \param last  true: accepts the result even if it has flaws
/// \returns true if the result is accepted
bool SimplifyJob::simplify_from(const Work& work, bool last, SimplifyResult& result) {
  const bool is_error_goal = options_.faces == 0;
  if (is_error_goal) {
    result = simplify_within_bound(options_.max_error, work);
  } else {
    AsyncTask<bool> fit_task([this] { return prepare_fit(); });
    result = simplify_to_count(work);
    fit_task.get();
  }
  report_progress(0.5);
  if (result.triangles.empty()) {
    if (last) result = unchanged_high_poly();
    result.is_bounded = true;
    return last;
  }
  if (is_error_goal) return has_no_flaws(result) || last;
  const bool fits = fit(result);
  report_progress(0.7);
  if (fits) return true;
  report_.mended = repair_flaws(result);
  return has_no_flaws(result) || last;
}

/// The balls in which the next presimplification keeps the high poly.
std::vector<Ball> SimplifyJob::balls_around_flaws(const SimplifyResult& result,
                                                  const Work& work) const {
  std::vector<Ball> balls = result.flawed;
  if (report_.holes > 0) {
    for (const Vec3d& p : work.torn) balls.push_back({p, kFlawRadius});
  }
  return balls;
}

SimplifyResult SimplifyJob::solve() {
  SimplifyResult result;
  std::vector<Ball> balls;
  PresimplifiedPieces known_pieces;
  const bool finely_curved = is_finely_tessellated();
  const int max_attempts =
      options_.faces == 0 ? kMaxErrorBoundPresimplifications : kMaxPresimplifications;
  for (int attempt = 0; attempt < max_attempts; ++attempt) {
    const Work work = start(options_.faces, balls, true, finely_curved, &known_pieces);
    report_progress(0.2);
    if (work.triangles.size() == dense_.triangles.size()) break;
    if (simplify_from(work, false, result)) return result;
    if (result.triangles.empty()) break;
    const std::vector<Ball> flawed = balls_around_flaws(result, work);
    balls.insert(balls.end(), flawed.begin(), flawed.end());
    if (flawed.empty() || balls.size() > kMaxFlawedPlaces) break;
  }
  simplify_from(dense_, true, result);
  return result;
}

/// Removes components of the high poly, with a warning.
/// \param dropped  for each component, 1 if it is removed
void SimplifyJob::drop_components(const ComponentSizes& parts,
                                  const std::vector<std::uint8_t>& dropped,
                                  const std::string& why) {
  const auto count = static_cast<std::uint64_t>(std::count(dropped.begin(), dropped.end(), 1));
  report_.dropped_parts += count;
  dense_ = parts.without_components(dense_, dropped);
  is_finely_tessellated_.reset();
  fit_.reset();
  dense_positions_ = to_floats(dense_.points);
  flaw_check_ = SimplifyCheck(dense_positions_, dense_.triangles, options_.height_field);
  report_.warnings.push_back({"dropped-parts",
                              counted(count, "part") + " of the high poly " +
                                  (count == 1 ? "is" : "are") + " smaller than " + why +
                                  (count == 1 ? " and was" : " and were") +
                                  " left out: keep the parts, or request more faces",
                              count});
}

/// Removes the smallest components if the requested faces do not suffice for all. Otherwise removes the components
/// whose diagonal is below the distance by which the simplified largest component deviates from the high poly.
/// \returns true if any was removed
bool SimplifyJob::drop_small_components() {
  if (options_.keep_parts || options_.faces == 0 || !has_free_vertices(options_)) return false;
  AsyncTask<bool> finely_curved([this] {
    return is_finely_tessellated();
  });  // Cached by a second thread while this one finds components; start() below may need it
  const ComponentSizes parts(dense_);
  finely_curved.get();
  if (parts.is_single_component()) return false;
  const std::size_t one_sided_faces = std::max<std::size_t>(
      options_.faces * dense_.triangles.size() / face_count_of_dense_mesh(), 1);
  const std::string faces = counted(options_.faces, "face");
  const std::vector<std::uint8_t> surplus_components =
      parts.surplus_components(one_sided_faces, kMinComponentFaces);
  if (std::find(surplus_components.begin(), surplus_components.end(), 1) !=
      surplus_components.end()) {
    drop_components(parts, surplus_components,
                    "others, which need all of the requested " + faces + ",");
    return true;
  }
  // A low poly never deviates by more than its edge length, so smaller components need no estimate.
  if (parts.count_below(mean_edge(dense_, one_sided_faces)) == 0) return false;
  // Estimates the deviation on the largest component only, since stray components may deviate far.
  const SimplifyResult estimate =
      simplify_to_count(start(options_.faces, {}, true, /*finely_curved=*/false));
  const double size =
      one_sided_distance(dense_positions_, parts.largest_component(dense_),
                         SurfaceDistance(to_floats(estimate.points), estimate.triangles),
                         kComponentSamples)
          .largest;
  const std::vector<std::uint8_t> small_components = parts.components_below(size);
  if (std::find(small_components.begin(), small_components.end(), 1) == small_components.end())
    return false;
  drop_components(
      parts, small_components,
      percent(size, 2) + " of its diagonal, by which a low poly of " + faces + " deviates,");
  return true;
}

/// Removes the smallest components if the result has too many faces. This happens if components need more faces than
/// estimated, for example because holes and handles must be kept.
/// \returns true if any was removed
bool SimplifyJob::drop_surplus(const SimplifyResult& result) {
  const double face_ratio = static_cast<double>(count_faces(result)) / options_.faces;
  if (options_.keep_parts || options_.faces == 0 || !has_free_vertices(options_) ||
      face_ratio <= kMaxFaceExcess) {
    return false;
  }
  const ComponentSizes parts(dense_);
  if (parts.is_single_component()) return false;
  const std::uint64_t count = count_components(result.triangles, result.points.size());
  const auto min_faces = static_cast<std::uint32_t>(result.triangles.size() / count + 1);
  const std::size_t one_sided_faces = std::max<std::size_t>(
      options_.faces * dense_.triangles.size() / face_count_of_dense_mesh(), 1);
  const std::vector<std::uint8_t> surplus_components =
      parts.surplus_components(one_sided_faces, min_faces);
  if (std::find(surplus_components.begin(), surplus_components.end(), 1) ==
      surplus_components.end())
    return false;
  drop_components(
      parts, surplus_components,
      "others, which need all of the requested " + counted(options_.faces, "face") + ",");
  return true;
}

void SimplifyJob::warn_of_count(const SimplifyResult& result) {
  const std::size_t left = count_faces(result);
  if (options_.faces == 0 || left <= options_.faces) return;
  const std::uint64_t parts = count_components(result.triangles, result.points.size());
  report_.warnings.push_back(
      {"faces-not-reached",
       counted(options_.faces, "face") + (options_.faces == 1 ? " was" : " were") +
           " requested, but " + std::to_string(left) + " are needed to keep the shape" +
           (options_.keep_uvs ? " and the UVs of " : " of ") + counted(parts, "connected part") +
           ": no part, hole or handle may vanish, and no face may flip",
       left});
}

std::string SimplifyJob::describe_place(const Vec3d& place) const {
  const Vec3 p = scale_.to_mesh(place);
  return formatted("at (%.5g, %.5g, %.5g)", high_.origin[0] + p.x, high_.origin[1] + p.y,
                   high_.origin[2] + p.z);
}

Mesh SimplifyJob::assemble(const SimplifyResult& result) const {
  Mesh mesh;
  mesh.name = high_.name;
  mesh.origin = high_.origin;
  mesh.triangles = result.triangles;
  std::vector<Vec3d> points = result.points;
  add_backs(result, points, mesh.triangles);
  if (is_reversed_) {
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  }
  mesh.positions.reserve(points.size());
  for (const Vec3d& p : points) mesh.positions.push_back(scale_.to_mesh(p));
  mesh.normals = vertex_normals(to_floats(points), mesh.triangles);
  mesh.normal_triangles = mesh.triangles;
  assign_labels(result, mesh);
  if (!options_.keep_uvs) return mesh;
  std::vector<std::uint32_t> number(result.layout.uvs.size(), kNoVertex);
  for (const Triangle& t : result.layout.corners) {
    Triangle& corners = mesh.uv_triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      if (number[t[k]] == kNoVertex) {
        number[t[k]] = static_cast<std::uint32_t>(mesh.uvs.size());
        mesh.uvs.push_back(result.layout.uvs[t[k]]);
      }
      corners[k] = number[t[k]];
    }
  }
  return mesh;
}

void SimplifyJob::warn_of_uvs_outside(const Mesh& mesh) {
  const std::uint64_t outside = count_outside(mesh);
  if (outside == 0) return;
  const bool before = count_outside(high_) > 0;
  report_.warnings.push_back(
      {"uv-outside",
       std::to_string(outside) + " of " + std::to_string(mesh.triangles.size()) +
           " triangles of the low poly " + (outside == 1 ? "reaches" : "reach") +
           " out of the unit square of UV space" +
           (before ? ", as triangles of the high poly do"
                   : ", although none of the high poly does: seams at the square's border were "
                     "simplified within the requested error") +
           ". A bake leaves out the parts outside of the square, but coverage counts them",
       outside});
}

Mesh SimplifyJob::make_result(const SimplifyResult& result, bool measured) {
  warn_of_count(result);
  warn_of_bound(result);
  warn_of_flaws(report_, [&](bool folded) {
    const Ball& place = result.flawed.at(folded ? report_.without_area : 0);
    return describe_place(place.center);
  });
  report_.faces = count_faces(result);
  report_.error = result.deviation.largest;
  report_.mean_error = result.deviation.mean;
  report_.back_error = result.low_to_high.largest;
  Mesh mesh = assemble(result);
  if (options_.keep_uvs) {
    std::vector<std::uint32_t> charts = uv_charts(mesh);
    report_.charts = *std::max_element(charts.begin(), charts.end()) + 1;
    report_.coverage = uv_area(mesh);
    if (measured) report_.uv_strays = uv_deviation(mesh, high_);
    warn_of_uvs_outside(mesh);
  }
  return mesh;
}

Mesh SimplifyJob::run(bool with_deviation) {
  reported_progress_ = 0;
  report_progress(0.1);
  if (options_.hull) {
    warn_of_inside_out(
        dense_, [&](const Vec3d& p) { return describe_place(p); }, report_.warnings);
  }
  const std::size_t count = face_count_of_dense_mesh();
  if (options_.faces == 0 || options_.faces < count) {
    if (options_.faces < count && drop_small_components() &&
        face_count_of_dense_mesh() <= options_.faces) {
      return make_result(unchanged_high_poly(), with_deviation);
    }
    SimplifyResult result = solve();
    for (int round = 0; round < kMaxSurplusRounds && drop_surplus(result); ++round) {
      if (face_count_of_dense_mesh() <= options_.faces)
        return make_result(unchanged_high_poly(), with_deviation);
      result = solve();
    }
    report_progress(0.8);
    if (options_.faces != 0 && with_deviation) result.deviation = measure(result, kMaxSamples);
    return make_result(result, with_deviation);
  }
  if (options_.faces > count) {
    report_.warnings.push_back({"faces-above-input",
                                std::to_string(options_.faces) +
                                    " faces were requested, but the mesh has " +
                                    std::to_string(count) + " that can be used; all were kept",
                                count});
  }
  return make_result(unchanged_high_poly(), with_deviation);
}

}  // namespace kiln
