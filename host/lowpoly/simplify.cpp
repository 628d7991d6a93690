// A light mesh from a dense one: see kiln/lowpoly.h.
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "kiln/lowpoly.h"
#include "kiln/validate.h"
#include "lowpoly/collapse.h"
#include "lowpoly/pairing.h"
#include "mesh/fans.h"
#include "mesh/normals.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Denser meshes are first brought down to this many faces, or to a few times the goal if that is
/// more, by meshoptimizer: it places vertices less well but is ten times as fast.
constexpr std::size_t direct_limit = 100'000;
constexpr std::size_t head_start = 4;
/// And height fields brought down to this share of their heights for that.
constexpr double flattened = 0.1;
/// Samples of the dense mesh that the deviation is measured at, at most.
constexpr std::uint64_t most_samples = 1 << 18;
/// And while looking for the light mesh that meets a bound.
constexpr std::uint64_t guiding_samples = 1 << 14;

/// A mesh as the collapser takes it: centred, its bounding box's diagonal 1.
struct Work {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
};

std::vector<Vec3> floats(const std::vector<Vec3d>& points) {
  std::vector<Vec3> result(points.size());
  std::transform(points.begin(), points.end(), result.begin(), to_float);
  return result;
}

/// Counts what is left out, and remembers the first of each kind.
struct Dropped {
  std::uint64_t count = 0;
  std::size_t first = 0;
  void add(std::size_t triangle) {
    if (count++ == 0) first = triangle;
  }
  void report(const char* code, const char* what, std::vector<Warning>& warnings) const {
    if (count == 0) return;
    warnings.push_back({code,
                        std::to_string(count) + " triangles " + what + " (the first is " +
                            std::to_string(first) + "); they were left out",
                        count});
  }
};

/// Triangles over welded vertices, without those that have no area or a twin.
std::vector<Triangle> clean(const Mesh& mesh, std::vector<Warning>& warnings) {
  const std::vector<std::uint32_t> welded = weld_vertices(mesh.positions);
  Dropped not_finite, degenerate, duplicate;
  struct Candidate {
    Triangle sorted_by_turning;  // The lowest vertex first, in the same sense.
    std::uint32_t index;
  };
  std::vector<Candidate> candidates;
  candidates.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Triangle v = mesh.triangles[t];
    for (std::uint32_t& vertex : v) {
      if (vertex >= mesh.positions.size()) {
        throw Error(ErrorCode::input, "simplify: triangle " + std::to_string(t) + " of mesh '" +
                                          mesh.name + "' has vertex " + std::to_string(vertex) +
                                          " of " + std::to_string(mesh.positions.size()) +
                                          "; check the program that wrote it");
      }
      vertex = welded[vertex];
    }
    const Vec3 &a = mesh.positions[v[0]], &b = mesh.positions[v[1]], &c = mesh.positions[v[2]];
    if (!is_finite(a) || !is_finite(b) || !is_finite(c)) {
      not_finite.add(t);
    } else if (!(triangle_shape(a, b, c).area > 0)) {
      degenerate.add(t);
    } else {
      std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
      candidates.push_back({v, static_cast<std::uint32_t>(t)});
    }
  }
  std::vector<std::uint32_t> order(candidates.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t x, std::uint32_t y) {
    return std::pair(candidates[x].sorted_by_turning, x) <
           std::pair(candidates[y].sorted_by_turning, y);
  });
  std::vector<std::uint8_t> twin(candidates.size(), 0);
  for (std::size_t i = 1; i < order.size(); ++i) {
    twin[order[i]] =
        candidates[order[i]].sorted_by_turning == candidates[order[i - 1]].sorted_by_turning;
  }
  std::vector<Triangle> result;
  result.reserve(candidates.size());
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (twin[i]) {
      duplicate.add(candidates[i].index);
    } else {
      result.push_back(candidates[i].sorted_by_turning);
    }
  }
  not_finite.report("non-finite-triangles", "have a corner that is not finite", warnings);
  degenerate.report("degenerate-triangles", "have no area", warnings);
  duplicate.report("duplicate-triangles", "repeat an earlier one", warnings);
  if (result.empty()) {
    throw Error(ErrorCode::input,
                "simplify: mesh '" + mesh.name + "' has no usable triangle among " +
                    std::to_string(mesh.triangles.size()) + "; check the program that wrote it");
  }
  return result;
}

/// Between the mesh's own coordinates and the collapser's.
class Scale {
 public:
  Scale(const Mesh& mesh, const std::vector<Triangle>& triangles) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    Vec3d low{inf, inf, inf}, high{-inf, -inf, -inf};
    for (const Triangle& t : triangles) {
      for (const std::uint32_t vertex : t) {
        const Vec3& p = mesh.positions[vertex];
        low = {std::min<double>(low.x, p.x), std::min<double>(low.y, p.y),
               std::min<double>(low.z, p.z)};
        high = {std::max<double>(high.x, p.x), std::max<double>(high.y, p.y),
                std::max<double>(high.z, p.z)};
      }
    }
    center_ = (low + high) * 0.5;
    diagonal_ = length(high - low);
  }
  Vec3d to_work(const Vec3& p) const {
    const Vec3d offset = Vec3d(p) - center_;
    return {offset.x / diagonal_, offset.y / diagonal_, offset.z / diagonal_};
  }
  Vec3 to_mesh(const Vec3d& p) const { return to_float(p * diagonal_ + center_); }

 private:
  Vec3d center_;
  double diagonal_ = 1;
};

/// Renumbers to the vertices in use.
Work compact(const Mesh& mesh, std::vector<Triangle> triangles, const Scale& scale) {
  Work work;
  std::vector<std::uint32_t> number(mesh.positions.size(), no_index);
  for (Triangle& t : triangles) {
    for (std::uint32_t& vertex : t) {
      if (number[vertex] == no_index) {
        number[vertex] = static_cast<std::uint32_t>(work.points.size());
        work.points.push_back(scale.to_work(mesh.positions[vertex]));
      }
      vertex = number[vertex];
    }
  }
  work.triangles = std::move(triangles);
  return work;
}

/// Brings a very dense mesh near `faces`, or less near if that would deviate by more than `error`.
/// Nothing is done where it would not help. meshoptimizer leaves pairs of triangles back to back, and
/// edges with four triangles, where the dense mesh had none: the former are removed, the latter cut.
/// It also lets no triangle turn over, but as seen from the side: height fields are made flat for it, so
/// that this is nearly as seen from above.
void approach(Work& work, std::size_t faces, double error, bool height_field) {
  static_assert(sizeof(Triangle) == 3 * sizeof(unsigned int) && sizeof(Vec3) == 3 * sizeof(float));
  std::vector<Vec3> positions = floats(work.points);
  if (height_field) {
    for (Vec3& p : positions) p.z *= static_cast<float>(flattened);
    error *= flattened;
  }
  std::vector<Triangle> triangles(work.triangles.size());
  const std::size_t indices =
      meshopt_simplify(triangles.data()->data(), work.triangles.data()->data(),
                       work.triangles.size() * 3, &positions.data()->x, positions.size(),
                       sizeof(Vec3), faces * 3, static_cast<float>(error), 0, nullptr);
  if (indices == 0) return;
  triangles.resize(indices / 3);
  if (!has_repeated_sides(work.triangles)) {
    remove_back_to_back(triangles);
    if (triangles.empty()) return;
    if (has_repeated_sides(triangles)) {
      for (const std::uint32_t original : split_into_fans(triangles, work.points.size())) {
        work.points.push_back(work.points[original]);
      }
    }
  }
  work.triangles = std::move(triangles);
}

struct Result {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
  DistanceReport deviation;
};

/// The last step of ever longer collapses that the samples stay within `bound` of; no triangles where
/// there is none.
Result longest_within(double bound, const Work& work, bool height_field, const auto& measure) {
  // A few samples guide the search. All of them then decide, and narrow the guide's bound if need be.
  double guide = 0.9 * bound;
  for (int attempt = 0; attempt < 4; ++attempt) {
    EdgeCollapser collapser(work.points, work.triangles, height_field);
    Result best;
    std::size_t faces = std::numeric_limits<std::size_t>::max();
    for (double distance = 0.05 * bound; distance < 8 * bound; distance *= 1.2) {
      collapser.run(0, distance);
      if (collapser.faces() == faces) continue;
      faces = collapser.faces();
      Result next;
      collapser.extract(next.points, next.triangles);
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

void check(const SimplifyOptions& options) {
  if (options.faces == 0 && !(options.max_error > 0 && options.max_error <= 1)) {
    throw Error(ErrorCode::usage,
                "simplify: max_error is " + std::to_string(options.max_error) +
                    "; it must be above 0 and at most 1, a share of the diagonal");
  }
}

}  // namespace

Mesh simplify(const Mesh& high, const SimplifyOptions& options, SimplifyReport* report) {
  const auto start = std::chrono::steady_clock::now();
  check(options);
  validate(high);
  SimplifyReport unwanted;
  SimplifyReport& out = report != nullptr ? *report : unwanted;
  out = {};
  out.input_faces = high.triangles.size();

  std::vector<Triangle> cleaned = clean(high, out.warnings);
  const Scale scale(high, cleaned);
  const Work dense = compact(high, std::move(cleaned), scale);
  const std::vector<Vec3> dense_positions = floats(dense.points);
  const auto measure = [&](const Result& result, std::uint64_t samples) {
    const SurfaceDistance light(floats(result.points), result.triangles);
    return one_sided_distance(dense_positions, dense.triangles, light, samples);
  };

  Result result{dense.points, dense.triangles, {}};
  const std::size_t count = dense.triangles.size();
  const bool by_error = options.faces == 0;
  if (by_error || options.faces < count) {
    Work work = dense;
    const std::size_t near_goal = std::max(direct_limit, head_start * options.faces);
    if (count > near_goal) {
      approach(work, near_goal, by_error ? 0.1 * options.max_error : 1.0, options.height_field);
    }
    if (by_error) {
      Result found = longest_within(options.max_error, work, options.height_field, measure);
      // Where the head start went too far, from the dense mesh itself.
      if (found.triangles.empty() && work.triangles.size() < count) {
        found = longest_within(options.max_error, dense, options.height_field, measure);
      }
      if (!found.triangles.empty()) result = std::move(found);
    } else {
      EdgeCollapser collapser(work.points, work.triangles, options.height_field);
      collapser.run(options.faces);
      collapser.extract(result.points, result.triangles);
      if (report != nullptr) result.deviation = measure(result, most_samples);
      if (result.triangles.size() > options.faces) {
        const std::uint64_t parts = count_components(result.triangles, result.points.size());
        out.warnings.push_back({"faces-not-reached",
                                std::to_string(options.faces) + " faces were asked for, but " +
                                    std::to_string(result.triangles.size()) +
                                    " are needed to keep the shape of " + std::to_string(parts) +
                                    (parts == 1 ? " connected part" : " connected parts") +
                                    ", none of which may vanish or turn over",
                                result.triangles.size()});
      }
    }
  } else if (options.faces > count) {
    out.warnings.push_back({"faces-above-input",
                            std::to_string(options.faces) +
                                " faces were asked for, but the mesh has " + std::to_string(count) +
                                " usable ones; all were kept",
                            count});
  }

  Mesh mesh;
  mesh.name = high.name;
  mesh.origin = high.origin;
  mesh.triangles = result.triangles;
  mesh.positions.reserve(result.points.size());
  for (const Vec3d& p : result.points) mesh.positions.push_back(scale.to_mesh(p));
  mesh.normals = vertex_normals(floats(result.points), result.triangles);
  mesh.normal_triangles = mesh.triangles;
  out.faces = mesh.triangles.size();
  out.error = result.deviation.largest;
  out.mean_error = result.deviation.mean;
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return mesh;
}

}  // namespace kiln
