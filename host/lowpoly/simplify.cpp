// A light mesh from a dense one: see kiln/lowpoly.h.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "kiln/lowpoly.h"
#include "kiln/validate.h"
#include "lowpoly/collapse.h"
#include "lowpoly/head_start.h"
#include "lowpoly/height_rule.h"
#include "lowpoly/keep_names.h"
#include "lowpoly/simplify_check.h"
#include "lowpoly/simplify_input.h"
#include "mesh/charts.h"
#include "mesh/fans.h"
#include "mesh/normals.h"
#include "mesh/surface_distance.h"

namespace kiln {
namespace {

/// Denser meshes are first brought down to this many faces, or to a few times the goal if that is
/// more.
constexpr std::size_t direct_limit = 100'000;
constexpr std::size_t head_start_share = 4;
/// Samples of the dense mesh that the deviation is measured at, at most.
constexpr std::uint64_t most_samples = 1 << 18;
/// And while looking for the light mesh that meets a bound.
constexpr std::uint64_t guiding_samples = 1 << 14;
/// How often flaws are looked for and mended.
constexpr int mending_rounds = 4;

struct Result {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
  Layout layout;  ///< Empty where none is kept.
  DistanceReport deviation;
};

/// A mesh under simplification, with what must be kept of it.
class Shrinking {
 public:
  Shrinking(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles,
            const Layout* layout, bool height_field, const Scale& scale)
      : mesh_(points, triangles),
        layout_(layout == nullptr ? nullptr : std::make_unique<LayoutRule>(mesh_, *layout)),
        height_(height_field ? std::make_unique<HeightRule>(mesh_) : nullptr),
        collapser_(mesh_, rule(), [scale](const Vec3d& p) { return scale.snap(p); }) {}

  EdgeCollapser& collapser() { return collapser_; }
  std::size_t faces() const { return mesh_.faces; }

  void extract(Result& result) const {
    std::vector<std::uint32_t> sources;
    mesh_.extract(result.points, result.triangles, sources);
    result.layout = {};
    if (!layout_) return;
    const Layout& from = layout_->layout();
    result.layout.uvs = from.uvs;
    for (const std::uint32_t t : sources) {
      result.layout.corners.push_back(from.corners[t]);
      result.layout.charts.push_back(from.charts[t]);
      if (!from.groups.empty()) result.layout.groups.push_back(from.groups[t]);
    }
  }

 private:
  CollapseRule* rule() const {
    if (layout_) return layout_.get();
    return height_.get();
  }
  CollapseMesh mesh_;
  std::unique_ptr<LayoutRule> layout_;
  std::unique_ptr<HeightRule> height_;
  EdgeCollapser collapser_;
};

/// What simplify() knows while it works.
class Job {
 public:
  Job(const Mesh& high, const SimplifyOptions& options, SimplifyReport& report)
      : high_(high),
        options_(options),
        report_(report),
        cleaned_(clean(high, sources_, report.warnings)),
        scale_(high, cleaned_),
        dense_(compact(high, std::move(cleaned_), std::move(sources_), scale_)),
        dense_positions_(to_floats(dense_.points)),
        check_(dense_positions_, dense_.triangles, options.height_field) {
    if (options.keep_uvs) layout_ = layout_of(high, dense_);
  }

  Mesh run(bool with_deviation);

 private:
  DistanceReport measure(const Result& result, std::uint64_t samples) const {
    const SurfaceDistance light(to_floats(result.points), result.triangles);
    return one_sided_distance(dense_positions_, dense_.triangles, light, samples);
  }
  const Layout* layout() const { return options_.keep_uvs ? &layout_ : nullptr; }
  Result unchanged() const { return {dense_.points, dense_.triangles, layout_, {}}; }
  Result to_count(const Work& work) const;
  Result within(double bound, const Work& work) const;
  Result solve();
  std::size_t mend(Result& result);
  bool is_good(const Result& result);
  void warn_of_count(const Result& result);
  Mesh assemble(const Result& result) const;

  const Mesh& high_;
  const SimplifyOptions& options_;
  SimplifyReport& report_;
  std::vector<SourceTriangle> sources_;
  std::vector<Triangle> cleaned_;
  Scale scale_;
  Work dense_;
  std::vector<Vec3> dense_positions_;
  SimplifyCheck check_;
  Layout layout_;
};

Result Job::to_count(const Work& work) const {
  Shrinking shrinking(work.points, work.triangles, layout(), options_.height_field, scale_);
  shrinking.collapser().run(options_.faces);
  Result result;
  shrinking.extract(result);
  return result;
}

/// The last step of ever longer collapses that the samples stay within `bound` of; no triangles where
/// there is none.
Result Job::within(double bound, const Work& work) const {
  // A few samples guide the search. All of them then decide, and narrow the guide's bound if need be.
  double guide = 0.9 * bound;
  for (int attempt = 0; attempt < 4; ++attempt) {
    Shrinking shrinking(work.points, work.triangles, layout(), options_.height_field, scale_);
    Result best;
    std::size_t faces = std::numeric_limits<std::size_t>::max();
    for (double distance = 0.05 * bound; distance < 8 * bound; distance *= 1.2) {
      shrinking.collapser().run(0, distance);
      if (shrinking.faces() == faces) continue;
      faces = shrinking.faces();
      Result next;
      shrinking.extract(next);
      if (measure(next, guiding_samples).largest > guide) break;
      best = std::move(next);
    }
    if (best.triangles.empty()) return best;
    best.deviation = measure(best, most_samples);
    if (best.deviation.largest <= bound) return best;
    guide *= 0.95 * bound / best.deviation.largest;
  }
  return {};
}

/// Mends what it can; returns how many triangles were mended.
std::size_t Job::mend(Result& result) {
  Flaws flaws = check_.find(result.points, result.triangles);
  const std::size_t found = flaws.count();
  for (int round = 0; round < mending_rounds && !flaws.none(); ++round) {
    Shrinking shrinking(result.points, result.triangles,
                        options_.keep_uvs ? &result.layout : nullptr, options_.height_field,
                        scale_);
    const auto bad = [&](const TriangleCorners& corners) { return check_.is_flaw(corners); };
    bool any = false;
    for (const auto* list : {&flaws.flat, &flaws.facing_down, &flaws.folded}) {
      for (const std::uint32_t t : *list) any = shrinking.collapser().mend(t, bad) || any;
    }
    if (!any) break;
    shrinking.extract(result);
    flaws = check_.find(result.points, result.triangles);
  }
  return found - std::min(found, flaws.count());
}

/// Counts what is left: folds, triangles without area, and holes that the dense mesh does not have.
bool Job::is_good(const Result& result) {
  const Flaws flaws = check_.find(result.points, result.triangles);
  report_.folded = flaws.folded.size() + flaws.facing_down.size();
  report_.without_area = flaws.flat.size();
  const std::uint64_t rims = count_rims(result.triangles, result.points.size());
  const std::uint64_t before = rims == 0 ? 0 : count_rims(dense_.triangles, dense_.points.size());
  report_.holes = rims > before ? rims - before : 0;
  return flaws.none() && report_.holes == 0;
}

/// The light mesh, mended; from the dense mesh itself where a head start left what cannot be mended.
Result Job::solve() {
  const bool by_error = options_.faces == 0;
  const std::size_t count = dense_.triangles.size();
  const std::size_t near_goal =
      std::max(direct_limit, head_start_share * std::size_t{options_.faces});
  Work work = dense_;
  if (count > near_goal && !options_.keep_uvs) {
    head_start(work, near_goal, by_error ? 0.1 * options_.max_error : 1.0, options_.height_field);
  }
  const bool started = work.triangles.size() < count;
  for (const Work* from : {&std::as_const(work), &std::as_const(dense_)}) {
    Result result = by_error ? within(options_.max_error, *from) : to_count(*from);
    if (result.triangles.empty() && from == &work && started) continue;
    if (result.triangles.empty()) return unchanged();
    Result mended = result;
    report_.mended = mend(mended);
    if (by_error && report_.mended > 0) mended.deviation = measure(mended, most_samples);
    if (by_error && mended.deviation.largest > options_.max_error) {
      report_.mended = 0;  // The bound comes first.
    } else {
      result = std::move(mended);
    }
    if (is_good(result) || from == &dense_ || !started) return result;
  }
  return unchanged();
}

void Job::warn_of_count(const Result& result) {
  const std::size_t left = result.triangles.size();
  if (options_.faces == 0 || left <= options_.faces) return;
  const std::uint64_t parts = count_components(result.triangles, result.points.size());
  report_.warnings.push_back(
      {"faces-not-reached",
       std::to_string(options_.faces) + " faces were asked for, but " + std::to_string(left) +
           " are needed to keep the shape" + (options_.keep_uvs ? " and the UVs of " : " of ") +
           std::to_string(parts) + (parts == 1 ? " connected part" : " connected parts") +
           ", none of which may vanish or turn over",
       left});
}

Mesh Job::assemble(const Result& result) const {
  Mesh mesh;
  mesh.name = high_.name;
  mesh.origin = high_.origin;
  mesh.triangles = result.triangles;
  mesh.positions.reserve(result.points.size());
  for (const Vec3d& p : result.points) mesh.positions.push_back(scale_.to_mesh(p));
  mesh.normals = vertex_normals(to_floats(result.points), result.triangles);
  mesh.normal_triangles = mesh.triangles;
  if (!options_.keep_uvs) return mesh;
  mesh.groups = result.layout.groups;
  mesh.group_names = high_.group_names;
  std::vector<std::uint32_t> number(result.layout.uvs.size(), no_vertex);
  for (const Triangle& t : result.layout.corners) {
    Triangle& corners = mesh.uv_triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      if (number[t[k]] == no_vertex) {
        number[t[k]] = static_cast<std::uint32_t>(mesh.uvs.size());
        mesh.uvs.push_back(result.layout.uvs[t[k]]);
      }
      corners[k] = number[t[k]];
    }
  }
  return mesh;
}

void warn_of_flaws(SimplifyReport& report) {
  const auto warn = [&](const char* code, std::uint64_t count, const char* what) {
    if (count == 0) return;
    report.warnings.push_back(
        {code,
         std::to_string(count) + what + "; ask for more faces, or repair the dense mesh there",
         count});
  };
  warn("folded-triangles", report.folded,
       " triangles of the light mesh face away from the dense surface and could not be mended");
  warn("flat-triangles", report.without_area,
       " triangles of the light mesh have no area and could not be mended");
  warn("new-holes", report.holes, " holes of the light mesh are not in the dense one");
}

Mesh Job::run(bool with_deviation) {
  const std::size_t count = dense_.triangles.size();
  Result result;
  if (options_.faces == 0 || options_.faces < count) {
    result = solve();
    if (options_.faces != 0 && with_deviation) result.deviation = measure(result, most_samples);
    warn_of_count(result);
    warn_of_flaws(report_);
  } else {
    result = unchanged();
    if (options_.faces > count) {
      report_.warnings.push_back({"faces-above-input",
                                  std::to_string(options_.faces) +
                                      " faces were asked for, but the mesh has " +
                                      std::to_string(count) + " usable ones; all were kept",
                                  count});
    }
  }
  report_.faces = result.triangles.size();
  report_.error = result.deviation.largest;
  report_.mean_error = result.deviation.mean;
  Mesh mesh = assemble(result);
  if (options_.keep_uvs) {
    std::vector<std::uint32_t> charts = uv_charts(mesh);
    report_.charts = *std::max_element(charts.begin(), charts.end()) + 1;
    for (const Triangle& t : mesh.uv_triangles) {
      const Vec2 &a = mesh.uvs[t[0]], &b = mesh.uvs[t[1]], &c = mesh.uvs[t[2]];
      const double area = std::abs((double{b.x} - a.x) * (double{c.y} - a.y) -
                                   (double{b.y} - a.y) * (double{c.x} - a.x));
      if (std::isfinite(area)) report_.coverage += area / 2;
    }
  }
  return mesh;
}

void check(const Mesh& high, const SimplifyOptions& options) {
  if (options.faces == 0 && !(options.max_error > 0 && options.max_error <= 1)) {
    throw Error(ErrorCode::usage,
                "simplify: max_error is " + std::to_string(options.max_error) +
                    "; it must be above 0 and at most 1, a share of the diagonal");
  }
  if (!options.keep_uvs) return;
  if (options.height_field) {
    throw Error(
        ErrorCode::usage,
        "simplify: keep_uvs and height_field exclude each other: a height field's UVs follow "
        "from its rectangle");
  }
  if (high.uv_triangles.size() != high.triangles.size() || high.uvs.empty()) {
    throw Error(ErrorCode::input, "simplify: mesh '" + high.name +
                                      "' has no UVs to keep; give it some, or leave keep_uvs out");
  }
}

}  // namespace

Mesh simplify(const Mesh& high, const SimplifyOptions& options, SimplifyReport* report) {
  const auto start = std::chrono::steady_clock::now();
  validate(high);
  check(high, options);
  SimplifyReport unwanted;
  SimplifyReport& out = report != nullptr ? *report : unwanted;
  out = {};
  out.input_faces = high.triangles.size();
  Mesh mesh = Job(high, options, out).run(report != nullptr);
  keep_names(high, mesh);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return mesh;
}

}  // namespace kiln
