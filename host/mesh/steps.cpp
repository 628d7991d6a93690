#include "mesh/steps.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <vector>

#include "base/formatted.h"
#include "base/parallel.h"
#include "mesh/usable.h"

namespace kiln {
namespace {

/// Minimum length of an edge in quantization steps. Vertices have errors of up to half a step, on average 0.3 steps per
/// axis, so normals at edges of this length have errors of about 0.4 / 256 radians = 0.1 degrees.
constexpr double kMinStepsPerEdge = 256;
constexpr double kRadiansPerStep = 0.4;
/// Take the radius around the centre that contains three quarters of all vertices. A vertex is an outlier if its
/// distance from the centre exceeds this multiple of that radius: kOutlierRatio in meshes with coarse steps,
/// kExtremeOutlierRatio in all meshes.
constexpr double kOutlierRatio = 16, kExtremeOutlierRatio = 1e5;

/// Calls take(t) for evenly spaced triangle indices t.
template <typename Take>
void for_sample(std::size_t count, const Take& take) {
  const std::size_t triangle_stride = count / kSampledTriangles + 1;
  for (std::size_t t = 0; t < count; t += triangle_stride) take(t);
}

std::array<double, 3> axes(const Vec3d& p) { return {p.x, p.y, p.z}; }

/// Spacing of single-precision numbers at a value.
double float_step(double at) { return at == 0 ? 0 : std::ldexp(1.0, std::ilogb(at) - 23); }

template <typename T, typename Less = std::less<>>
T quantile(std::vector<T>& values, double share, const Less& less = {}) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end(), less);
  return *at;
}

std::string position_text(const Vec3d& p) { return place_text(p.x, p.y, p.z); }

/// A sphere around the median position that contains three quarters of the vertices.
struct Bulk {
  Vec3d center{};
  double radius = 0;

  Bulk(const SteppedMesh& mesh, std::span<const std::uint32_t> vertices) {
    std::array<double, 3> median{};
    std::vector<double> coordinates(vertices.size());
    const auto each = [&](const auto& number) {
      std::transform(vertices.begin(), vertices.end(), coordinates.begin(), number);
    };
    for (std::size_t k = 0; k < 3; ++k) {
      each([&](std::uint32_t v) { return axes(mesh.position(v))[k]; });
      median[k] = quantile(coordinates, 0.5);
    }
    center = {median[0], median[1], median[2]};
    each([&](std::uint32_t v) { return distance(mesh, v); });
    radius = quantile(coordinates, 0.75);
  }
  double distance(const SteppedMesh& mesh, std::uint32_t v) const {
    return length(mesh.position(v) - center);
  }
};

/// The vertices of usable triangles, without duplicates.
std::vector<std::uint32_t> used_vertices(const SteppedMesh& mesh) {
  std::vector<std::uint32_t> used;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.is_usable(t))
      used.insert(used.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
  }
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  return used;
}

/// The corners of a sample of usable triangles.
std::vector<std::uint32_t> sample_vertices(const SteppedMesh& mesh) {
  std::vector<std::uint32_t> sampled_corners;
  for_sample(mesh.triangles.size(), [&](std::size_t t) {
    if (mesh.is_usable(t))
      sampled_corners.insert(sampled_corners.end(), mesh.triangles[t].begin(),
                             mesh.triangles[t].end());
  });
  return sampled_corners;
}

/// Distance of the farthest vertex from the centre, divided by the radius of the bulk; 0 if it is below
/// kExtremeOutlierRatio.
double outlier_reach(const SteppedMesh& mesh, const Bulk& bulk) {
  const double min_outlier_distance = kExtremeOutlierRatio * bulk.radius;
  double farthest_distance = min_outlier_distance;
  std::mutex mutex;
  parallel_for(mesh.triangles.size(), std::size_t{1} << 15,
               [&](std::size_t begin, std::size_t end) {
                 double part = min_outlier_distance;
                 for (std::size_t t = begin; t < end; ++t) {
                   double vertex_distance = 0;
                   for (const std::uint32_t v : mesh.triangles[t]) {
                     vertex_distance = std::max(vertex_distance, bulk.distance(mesh, v));
                   }
                   if (vertex_distance > part && mesh.is_usable(t))
                     // Tests the distance first, so that `is_usable` is called for few triangles
                     part = vertex_distance;
                 }
                 const std::scoped_lock lock(mutex);
                 farthest_distance = std::max(farthest_distance, part);
               });
  return farthest_distance > min_outlier_distance ? farthest_distance / bulk.radius : 0;
}

/// Describes the vertices that extend the box. Empty if no vertex is `far` times the radius from the centre or farther.
std::string describe_outliers(const SteppedMesh& mesh, double far) {
  const std::vector<std::uint32_t> used = used_vertices(mesh);
  const Bulk bulk(mesh, used);
  const auto count =
      static_cast<std::uint64_t>(std::count_if(used.begin(), used.end(), [&](std::uint32_t v) {
        return bulk.distance(mesh, v) > far * bulk.radius;
      }));
  if (count == 0) return {};
  const std::uint32_t farthest_vertex = *std::max_element(
      used.begin(), used.end(),
      [&](auto a, auto b) { return bulk.distance(mesh, a) < bulk.distance(mesh, b); });
  const std::string within_text = formatted(" within %.3g of ", bulk.radius);
  return "Vertex " + std::to_string(farthest_vertex) + " at " +
         position_text(mesh.position(farthest_vertex)) +
         (count > 1 ? " and " + std::to_string(count - 1) + " more lie" : " lies") +
         " far from the others, most of them" + within_text + position_text(bulk.center) +
         ": move or remove " + (count > 1 ? "them." : "it.");
}

}  // namespace

FloatGrid::FloatGrid(std::span<const Triangle> triangles,
                     const std::function<Vec3d(std::uint32_t vertex)>& position) {
  std::array<double, 3> largest{};
  const auto each = [&](const auto& take) {
    for_sample(triangles.size(), [&](std::size_t t) {
      for (const std::uint32_t v : triangles[t]) {
        const std::array<double, 3> p = axes(position(v));
        for (std::size_t k = 0; k < 3; ++k) {
          if (std::isfinite(p[k])) take(k, p[k]);
        }
      }
    });
  };
  each([&](std::size_t k, double x) { largest[k] = std::max(largest[k], std::abs(x)); });
  // Compares numbers in the largest binade, where rounded values are both even and odd multiples of the step. The
  // tolerance is a share of a step, since text files may hold floats with nine digits.
  constexpr double kStepTolerance = 1.0 / 16;
  std::array<bool, 3> is_off_grid{}, has_even{}, has_odd{};
  each([&](std::size_t k, double x) {
    if (largest[k] == 0 || std::ilogb(x) != std::ilogb(largest[k])) return;
    const double steps = std::abs(x) / float_step(largest[k]), whole_steps = std::nearbyint(steps);
    is_off_grid[k] = is_off_grid[k] || std::abs(steps - whole_steps) > kStepTolerance;
    (std::fmod(whole_steps, 2) == 0 ? has_even : has_odd)[k] = true;
  });
  for (std::size_t k = 0; k < 3; ++k) on_grid_[k] = !is_off_grid[k] && has_even[k] && has_odd[k];
}

Step FloatGrid::step(const Vec3d& p) const {
  Step coarsest_step;
  for (std::size_t k = 0; k < 3; ++k) {
    const double size = on_grid_[k] ? float_step(axes(p)[k]) : 0;
    if (size > coarsest_step.size) coarsest_step = {size, k};
  }
  return coarsest_step;
}

std::string coarse_steps(const SteppedMesh& mesh, const char* how) {
  struct EdgeStep {
    double length = 0, at = 0;
    Step step;
    double share() const { return step.size / length; }
  };
  std::vector<EdgeStep> edges;
  for_sample(mesh.triangles.size(), [&](std::size_t t) {
    if (!mesh.is_usable(t)) return;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      const Step step_a = mesh.step(a), step_b = mesh.step(b);
      const Step step = step_a.size > step_b.size ? step_a : step_b;
      const Vec3d from = mesh.position(a), to = mesh.position(b);
      const double size = length(to - from),
                   at = axes(step_a.size > step_b.size ? from : to)[step.axis];
      if (size > 0) edges.push_back({size, at, step});
    }
  });
  if (edges.empty()) return {};
  const EdgeStep coarse_step = quantile(
      edges, 0.75, [](const EdgeStep& a, const EdgeStep& b) { return a.share() < b.share(); });
  if (!(coarse_step.share() > 1 / kMinStepsPerEdge)) return {};
  constexpr double kDegreesPerRadian = 57.29577951308232;
  const std::string text = formatted(
      "coordinates near %.7g are %s in steps of %.2g, where edges are %.2g long: normals "
      "are off by about %.2g degrees. ",
      coarse_step.at, how, coarse_step.step.size, coarse_step.length,
      kDegreesPerRadian * std::atan(kRadiansPerStep * coarse_step.share()));
  const std::string outliers = describe_outliers(mesh, kOutlierRatio);
  return text + (!outliers.empty()
                     ? outliers
                     : "Export it in double precision, or moved to the world's origin; or "
                       "split it into parts.");
}

std::string describe_stretched_box(const SteppedMesh& mesh) {
  const std::vector<std::uint32_t> sampled_corners = sample_vertices(mesh);
  if (sampled_corners.empty()) return {};
  const Bulk bulk(mesh, sampled_corners);
  if (bulk.radius == 0) return {};
  const double outlier_ratio = outlier_reach(mesh, bulk);
  const std::string outliers =
      outlier_ratio > 0 ? describe_outliers(mesh, kExtremeOutlierRatio) : std::string();
  if (outliers.empty()) return {};
  const std::string text =
      formatted("it reaches %.2g times as far as most of its vertices. ", outlier_ratio);
  return text + outliers;
}

namespace {

SteppedMesh stored_steps(const Mesh& mesh) {
  return {mesh.triangles,
          [&](std::size_t t) { return has_area(mesh.positions, mesh.triangles[t]); },
          [&](std::uint32_t v) { return to_double(mesh.positions[v]); },
          {}};
}

/// True if the box extends so far beyond the bulk that some vertices may be outliers.
bool reaches_beyond(const Bulk& bulk, const Bounds& all) {
  constexpr double kMaxOutlierRatio = 0x1p40;
  const Vec3d low(all.low[0], all.low[1], all.low[2]), high(all.high[0], all.high[1], all.high[2]);
  const double box_distance = std::max(length(low - bulk.center), length(high - bulk.center));
  return box_distance > kExtremeOutlierRatio * bulk.radius &&
         box_distance < kMaxOutlierRatio * bulk.radius;
}

}  // namespace

bool may_have_outliers(const Mesh& sample, const Bounds& all) {
  const SteppedMesh stored = stored_steps(sample);
  const std::vector<std::uint32_t> sampled_corners = sample_vertices(stored);
  return sampled_corners.empty() || reaches_beyond(Bulk(stored, sampled_corners), all);
}

Bounds bulk_bounds(const Mesh& mesh, const Bounds& all) {
  const SteppedMesh stored = stored_steps(mesh);
  const std::vector<std::uint32_t> sampled_corners = sample_vertices(stored);
  if (sampled_corners.empty()) return all;
  const Bulk bulk(stored, sampled_corners);
  if (!reaches_beyond(bulk, all)) return all;
  if (outlier_reach(stored, bulk) == 0) return all;
  const std::vector<std::uint32_t> used = used_vertices(stored);
  const Bulk vertex_bulk(stored, used);
  Bounds bounds{all.high, all.low};
  for (const std::uint32_t v : used) {
    if (vertex_bulk.distance(stored, v) > kExtremeOutlierRatio * vertex_bulk.radius) continue;
    const std::array<double, 3> p = axes(stored.position(v));
    for (std::size_t k = 0; k < 3; ++k) {
      bounds.low[k] = std::min(bounds.low[k], p[k] + 0.0);  // Adding 0 turns -0 into +0
      bounds.high[k] = std::max(bounds.high[k], p[k] + 0.0);
    }
  }
  return bounds;
}

std::string coarse_steps(const Mesh& mesh, const Frame& frame) {
  const auto own_position = [&](std::uint32_t v) { return to_double(mesh.positions[v]); };
  const Vec3d origin(mesh.origin[0], mesh.origin[1], mesh.origin[2]);
  const FloatGrid grid(mesh.triangles, own_position);
  const auto step = [&](std::uint32_t v) {
    Step coarsest_step = grid.step(own_position(v));
    const std::array<double, 3> p = axes(own_position(v)),
                                in_frame = axes(to_double(frame.to_frame(mesh, v)));
    for (std::size_t k = 0; k < 3; ++k) {
      const double rounded_position =
          in_frame[k] / frame.scale + (frame.center[k] - mesh.origin[k]);
      const double size = 2 * std::abs(rounded_position - p[k]);
      if (size > coarsest_step.size) coarsest_step = {size, k};
    }
    return coarsest_step;
  };
  const SteppedMesh rounded_mesh{
      mesh.triangles, [&](std::size_t t) { return has_area(mesh.positions, mesh.triangles[t]); },
      [&](std::uint32_t v) { return own_position(v) + origin; }, step};
  const std::string coarse_step = coarse_steps(rounded_mesh, "rounded");
  return coarse_step.empty() ? describe_stretched_box(rounded_mesh) : coarse_step;
}

}  // namespace kiln
