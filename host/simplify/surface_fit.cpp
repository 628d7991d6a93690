#include "simplify/surface_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "base/parallel.h"
#include "base/progress_guard.h"
#include "mesh/quadric.h"
#include "mesh/surface_distance.h"
#include "simplify/curvature_weights.h"
#include "simplify/heightfield_constraint.h"

namespace kiln {
namespace {

/// Number of samples on the high poly: kSamplesPerFace per face of the low poly, but at least kMinSamples.
constexpr std::size_t kSamplesPerFace = 24, kMinSamples = 1 << 15;
constexpr int kFitRounds = 4;
/// Number of samples on the high poly in draft fits: kDraftSamplesPerFace per face of the low poly, but at least
/// kMinDraftSamples.
constexpr std::size_t kDraftSamplesPerFace = 6, kMinDraftSamples = 1 << 11;
constexpr int kDraftFitRounds = 2;
/// A sample only matches a triangle if the cosine between their normals is at least this.
constexpr double kMinMatchCosine = 0.3;
/// Weights relative to distances along the high poly's normal: kTangentialWeight for distances tangential to the
/// surface, kStayWeight for the length of the vertex's step.
constexpr double kTangentialWeight = 0.002, kStayWeight = 0.02;
/// Weight of a step away from a line between labels, relative to distances along normals.
constexpr double kLineStayWeight = 6;
/// Additional weight of a sample at a side of the low-poly triangle, relative to one at its centre. Silhouettes consist
/// of sides. Without this weight, silhouettes of smooth shapes are slightly too wide.
constexpr double kSideWeight = 6;
/// Weight of a vertex's distance from the nearest plane of the high poly, relative to the faces around the vertex.
/// Protruding vertices form silhouettes.
constexpr double kNearestPlaneWeight = 0.05;
/// Weight of a vertex's quadric when the quadric's error equals that of the samples. The weight grows as 1 / (the
/// quadric's error), up to kMaxQuadricFactor times: on planes and creases the quadric's error is only rounding, and
/// noise of few samples must not move vertices off them.
constexpr double kQuadricWeight = 0.003, kMaxQuadricFactor = 1000;
/// Longest step of a vertex in a round, as a share of the shortest side around it.
constexpr double kMaxStepShare = 0.3;
/// Cosine of the largest angle by which a step may turn a triangle's normal.
constexpr double kMinStepTurnCosine = 0.9;
/// Minimum of a triangle's doubled area over its squared longest side. A step of a vertex may not take a triangle below
/// it.
constexpr double kMinStepShape = 1e-3;
/// Bound on the rounding of distances to single precision, at unit size.
constexpr double kSingleRounding = 1e-6;

Vec3d normal_of(const Vec3d& a, const Vec3d& b, const Vec3d& c) { return cross(b - a, c - a); }

/// Barycentric coordinates of the point of a triangle that is nearest to p.
std::array<double, 3> nearest_barycentric(const Vec3d& p, const std::array<Vec3d, 3>& c) {
  const Vec3d n = normal_of(c[0], c[1], c[2]);
  const double squared_normal = dot(n, n);
  std::array<double, 3> share{1, 0, 0};
  if (squared_normal > 0) {
    for (std::size_t k = 0; k < 3; ++k) {
      share[k] = dot(n, normal_of(p, c[(k + 1) % 3], c[(k + 2) % 3])) / squared_normal;
    }
    if (share[0] >= 0 && share[1] >= 0 && share[2] >= 0) return share;
  }
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d &from = c[k], &to = c[(k + 1) % 3];
    const Vec3d edge = to - from;
    const double size = dot(edge, edge);
    const double t = size > 0 ? std::clamp(dot(p - from, edge) / size, 0.0, 1.0) : 0.0;
    const Vec3d rest = p - (from + edge * t);
    if (!(dot(rest, rest) < best)) continue;
    best = dot(rest, rest);
    share = {0, 0, 0};
    share[k] = 1 - t;
    share[(k + 1) % 3] = t;
  }
  return share;
}

/// Sum of outer products of the unit directions that lie across the lines at a vertex.
struct CrossLineTensor {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, count = 0;
  void add(const Vec3d& n, double w) {
    xx += w * n.x * n.x, xy += w * n.x * n.y, xz += w * n.x * n.z;
    yy += w * n.y * n.y, yz += w * n.y * n.z, zz += w * n.z * n.z;
    ++count;
  }
};

/// For each vertex, the directions across the lines between labels that meet there; empty if there are no lines.
std::vector<CrossLineTensor> label_lines_at_vertices(const std::vector<Vec3d>& points,
                                                     const std::vector<Triangle>& low,
                                                     std::span<const std::uint32_t> labels) {
  std::vector<CrossLineTensor> lines(labels.empty() ? 0 : points.size());
  if (labels.empty()) return lines;
  const auto facing = [&](const SideLists::Item& side) {
    const Triangle& t = low[side.index / 3];
    const Vec3d normal = normal_of(points[t[0]], points[t[1]], points[t[2]]);
    return normal * (1 / length(normal));
  };
  double length_of_lines = 0, length_of_all = 0;
  SideLists(low, points.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        const std::uint32_t b = SideLists::higher(sides[0]);
        const Vec3d edge = points[b] - points[a];
        length_of_all += length(edge);
        if (sides.size() != 2 || labels[sides[0].index / 3] == labels[sides[1].index / 3]) return;
        length_of_lines += length(edge);
        const Vec3d one = facing(sides[0]), other = facing(sides[1]);
        const Vec3d across = cross(one + other, edge);
        const double size = length(across);
        if (!(size > 0) || !std::isfinite(size)) return;
        for (const std::uint32_t v : {a, b}) {
          lines[v].add(across * (1 / size), line_weight(one, other));
        }
      });
  const double max_weight = max_line_weight(length_of_lines, length_of_all);
  for (CrossLineTensor& of : lines) {
    const double w = of.count > 0 ? kLineStayWeight * max_weight / of.count : 0;
    for (double* sum : {&of.xx, &of.xy, &of.xz, &of.yy, &of.yz, &of.zz}) *sum *= w;
  }
  return lines;
}

/// Normal equations of a vertex's step, which minimizes a weighted sum of squared distances.
struct StepEquations {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  Vec3d right{};
  /// Sum of all weights, and weighted sum of squared distances at the current position
  double weight = 0, squared_sum = 0;

  void add(const Vec3d& normal, const Vec3d& missing, double share, double w) {
    const double along = dot(normal, missing), square = w * share * share;
    xx += square * normal.x * normal.x, xy += square * normal.x * normal.y;
    xz += square * normal.x * normal.z, yy += square * normal.y * normal.y;
    yz += square * normal.y * normal.z, zz += square * normal.z * normal.z;
    right += normal * (w * share * along) + missing * (w * share * kTangentialWeight);
    weight += square;
    squared_sum += square * along * along;
  }
  /// Pulls the vertex towards a plane, but not along it. A tangential pull would displace vertices that their quadrics
  /// hardly hold in place, as on shallow fillets.
  void add_plane_equation(const Vec3d& normal, const Vec3d& missing, double w) {
    add(normal, normal * dot(normal, missing), 1, w);
  }
  /// Penalizes steps across lines, in proportion to the weight of all equations so far.
  void restrict_to_lines(const CrossLineTensor& lines) {
    xx += weight * lines.xx, xy += weight * lines.xy, xz += weight * lines.xz;
    yy += weight * lines.yy, yz += weight * lines.yz, zz += weight * lines.zz;
  }
  /// Pulls the vertex towards the planes of its quadric.
  /// \param collapsed_position  position of the vertex after the collapses, which lies on those planes
  void add_quadric_equation(const Quadric& planes, const Vec3d& collapsed_position,
                            const Vec3d& p) {
    if (!(squared_sum > 0) || !(planes.area > 0)) return;
    const double plane_error =
        planes.at(collapsed_position) / planes.area + squared_sum / weight / kMaxQuadricFactor;
    const double w = kQuadricWeight * squared_sum / plane_error / planes.area;
    xx += w * planes.xx, xy += w * planes.xy, xz += w * planes.xz;
    yy += w * planes.yy, yz += w * planes.yz, zz += w * planes.zz;
    right += planes.slope(p) * -w;
  }
  Vec3d step() const {
    const double isotropic_weight = (kTangentialWeight + kStayWeight) * weight;
    const Vec3d row0{xx + isotropic_weight, xy, xz}, row1{xy, yy + isotropic_weight, yz},
        row2{xz, yz, zz + isotropic_weight};
    const Vec3d c12 = cross(row1, row2), c20 = cross(row2, row0), c01 = cross(row0, row1);
    return (c12 * right.x + c20 * right.y + c01 * right.z) * (1 / dot(row0, c12));
  }
};

/// A low poly while it is fitted, and which of its vertices may move.
class MovingMesh {
 public:
  MovingMesh(std::vector<Vec3d>& points, const std::vector<Triangle>& triangles, bool height_field)
      : points_(points),
        triangles_(triangles),
        height_field_(height_field),
        corners_(
            points.size(), triangles.size() * 3,
            [&](std::size_t i) { return triangles[i / 3][i % 3]; },
            [](std::size_t) { return std::uint64_t{0}; }),
        fixed_(points.size(), 0) {
    SideLists(triangles, points.size())
        .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
          if (sides.size() != 2) fixed_[a] = fixed_[SideLists::higher(sides[0])] = 1;
        });
  }

  bool fixed(std::uint32_t vertex) const { return fixed_[vertex] != 0; }
  /// For each triangle, 1 if at least one of its corners may move.
  std::vector<std::uint8_t> is_movable() const {
    std::vector<std::uint8_t> result(triangles_.size());
    std::transform(triangles_.begin(), triangles_.end(), result.begin(), [&](const Triangle& t) {
      return fixed(t[0]) && fixed(t[1]) && fixed(t[2]) ? 0 : 1;
    });
    return result;
  }
  /// The corners at a vertex, as 3 * triangle + corner.
  std::span<const VertexLists::Item> corners(std::uint32_t vertex) const {
    return corners_.of(vertex);
  }
  double longest_step(std::uint32_t vertex) const {
    double shortest = std::numeric_limits<double>::infinity();
    for (const VertexLists::Item& corner : corners(vertex)) {
      const Triangle& t = triangles_[corner.index / 3];
      const Vec3d edge = points_[t[(corner.index + 1) % 3]] - points_[vertex];
      shortest = std::min(shortest, dot(edge, edge));
    }
    return kMaxStepShare * std::sqrt(shortest);
  }
  bool allows_step(std::uint32_t vertex, const Vec3d& target) const {
    for (const VertexLists::Item& corner : corners(vertex)) {
      const Triangle& t = triangles_[corner.index / 3];
      const std::size_t k = corner.index % 3;
      const Vec3d &b = points_[t[(k + 1) % 3]], &c = points_[t[(k + 2) % 3]];
      const Vec3d normal_before = normal_of(points_[vertex], b, c),
                  normal_after = normal_of(target, b, c);
      const double size = length(normal_after);
      const Vec3d ab = b - target, bc = c - b, ca = target - c;
      const double longest = std::max({dot(ab, ab), dot(bc, bc), dot(ca, ca)});
      if (!(size > kMinStepShape * longest)) return false;
      if (!(dot(normal_before, normal_after) > kMinStepTurnCosine * length(normal_before) * size))
        return false;
      if (height_field_ && !(upward_quality(target, b, c) > kMinUpwardQuality)) return false;
    }
    return true;
  }

 private:
  std::vector<Vec3d>& points_;
  const std::vector<Triangle>& triangles_;
  bool height_field_;
  VertexLists corners_;
  std::vector<std::uint8_t> fixed_;
};

}  // namespace

std::size_t SurfaceFit::sample_count_for(std::size_t faces, bool draft) {
  return draft ? std::max(kMinDraftSamples, kDraftSamplesPerFace * faces)
               : std::max(kMinSamples, kSamplesPerFace * faces);
}

/// Sets the weights of samples: by area and, except on height fields, by curvature.
void SurfaceFit::set_weights() {
  triangle_weights_.resize(triangles_.size());
  std::optional<CurvatureWeights> curvature_weights;
  if (!height_field_) curvature_weights.emplace(positions_, triangles_);
  parallel_for(triangle_weights_.size(), std::size_t{1} << 14,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t i = begin; i < end; ++i) {
                   const Triangle& t = triangles_[i];
                   const Vec3d a = to_double(positions_[t[0]]), b = to_double(positions_[t[1]]),
                               c = to_double(positions_[t[2]]);
                   triangle_weights_[i] = length(normal_of(a, b, c)) *
                                          (curvature_weights ? curvature_weights->weight_of(t) : 1);
                 }
               });
}

/// Draws samples in proportion to the triangles' weights: walks along the cumulated weights in equal steps. A triangle
/// that contains one step is sampled at its centroid, one that contains several at three points. If there are few
/// triangles, each is sampled at three points. Weights by area alone would leave fillets, rims and edges with one or
/// two samples, and faces there would move at random.
void SurfaceFit::draw_samples(std::size_t sample_count) {
  if (requested_samples_ == sample_count) return;
  requested_samples_ = sample_count;
  if (triangle_weights_.empty()) set_weights();
  using BarycentricWeights = std::array<double, 3>;
  constexpr std::array<BarycentricWeights, 3> kThreePoints{
      {{2.0 / 3, 1.0 / 6, 1.0 / 6}, {1.0 / 6, 2.0 / 3, 1.0 / 6}, {1.0 / 6, 1.0 / 6, 2.0 / 3}}};
  constexpr std::array<BarycentricWeights, 1> kCentroid{{{1.0 / 3, 1.0 / 3, 1.0 / 3}}};
  const bool draws_from_all = kThreePoints.size() * triangles_.size() < sample_count;
  const double step = std::accumulate(triangle_weights_.begin(), triangle_weights_.end(), 0.0) /
                      static_cast<double>(sample_count);
  samples_.clear();
  samples_.reserve(draws_from_all ? kThreePoints.size() * triangles_.size()
                                  : sample_count + sample_count / 2);
  double sum = 0;
  for (std::size_t i = 0; i < triangle_weights_.size(); ++i) {
    if (!(triangle_weights_[i] > 0)) continue;
    const double first_index = std::floor(sum / step);
    sum += triangle_weights_[i];
    const double picked_count = std::floor(sum / step) - first_index;
    if (!draws_from_all && picked_count < 1) continue;
    const std::span<const BarycentricWeights> places =
        draws_from_all || picked_count > 1 ? std::span<const BarycentricWeights>(kThreePoints)
                                           : std::span<const BarycentricWeights>(kCentroid);
    const Triangle& t = triangles_[i];
    const Vec3d a = to_double(positions_[t[0]]), b = to_double(positions_[t[1]]),
                c = to_double(positions_[t[2]]);
    const Vec3d normal = normal_of(a, b, c);
    const double size = length(normal);
    for (const BarycentricWeights& corners : places) {
      Sample& sample = samples_.emplace_back();
      sample.point = a * corners[0] + b * corners[1] + c * corners[2];
      sample.normal = normal * (1 / size);
      // A sampled triangle also represents the triangles that were skipped before it.
      sample.weight =
          (draws_from_all ? triangle_weights_[i] : std::max(triangle_weights_[i], step)) /
          static_cast<double>(places.size());
    }
  }
}

/// Position of a sample's match on the current low poly.
Vec3d SurfaceFit::matched_position(const Sample& s, const std::vector<Vec3d>& points,
                                   const std::vector<Triangle>& low) {
  const Triangle& t = low[s.triangle];
  return points[t[0]] * s.share[0] + points[t[1]] * s.share[1] + points[t[2]] * s.share[2];
}

/// Upper bound of the squared distance to the nearest triangle: the distance to the previous match, plus rounding to
/// single precision. Infinity if there was no match.
double SurfaceFit::squared_distance_bound(const Sample& known, const Vec3d& point,
                                          const std::vector<Vec3d>& points,
                                          const std::vector<Triangle>& low) {
  if (known.share == std::array<double, 3>{}) return std::numeric_limits<double>::infinity();
  const double distance = length(point - matched_position(known, points, low)) + kSingleRounding;
  return distance * distance;
}

/// Matches the samples with the current low poly.
/// \param is_movable   for each triangle, 1 if samples may move it. Which of the fixed triangles is the nearest is not
///   determined exactly: vegetation has many at nearly equal distances, where an exact search is slow
/// \param before  matches of the previous round; empty in the first round
/// \param found   [out] the matched samples
void SurfaceFit::match(const std::vector<std::uint8_t>& is_movable,
                       const std::vector<Sample>& before, const std::vector<Vec3d>& points,
                       const std::vector<Triangle>& low, std::vector<Sample>& found) const {
  std::vector<Vec3> single_positions(points.size());
  std::transform(points.begin(), points.end(), single_positions.begin(), to_float);
  const SurfaceDistance tree(single_positions, low);
  std::vector<Triangle> movable_triangles;
  for (std::size_t t = 0; t < low.size(); ++t) {
    if (is_movable[t] != 0) movable_triangles.push_back(low[t]);
  }
  const bool are_all_movable = movable_triangles.size() == low.size();
  const SurfaceDistance movable_tree(
      single_positions, are_all_movable ? std::span<const Triangle>() : movable_triangles);
  // True if a fixed triangle is nearer to the sample than every movable triangle.
  const auto is_at_rest = [&](const Vec3& point, std::uint32_t triangle) {
    if (is_movable[triangle] != 0) return false;
    const Triangle& t = low[triangle];
    const std::array<Vec3, 3> corners{single_positions[t[0]], single_positions[t[1]],
                                      single_positions[t[2]]};
    const double distance = squared_distance_to_triangle(to_double(point), corners.data(),
                                                         std::numeric_limits<double>::infinity());
    return !movable_tree.is_within(point, distance);
  };
  found.resize(samples_.size());
  parallel_for(found.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Sample& s = found[i] = samples_[i];
      if (s.weight == 0) continue;
      // The previous match of the sample, or that of the sample before it, bounds the search.
      const Sample* known = !before.empty() ? &before[i] : i > begin ? &found[i - 1] : nullptr;
      const double max_squared_distance =
          known == nullptr ? std::numeric_limits<double>::infinity()
                           : squared_distance_bound(*known, s.point, points, low);
      const Vec3 point = to_float(s.point);
      const bool is_sample_at_rest =
          !are_all_movable && known != nullptr && is_at_rest(point, known->triangle);
      s.triangle = is_sample_at_rest ? known->triangle : tree.nearest(point, max_squared_distance);
      const Triangle& t = low[s.triangle];
      const std::array<Vec3d, 3> corners{points[t[0]], points[t[1]], points[t[2]]};
      const Vec3d normal = normal_of(corners[0], corners[1], corners[2]);
      if (!(dot(normal, s.normal) > kMinMatchCosine * length(normal))) s.weight = 0;
      s.share = nearest_barycentric(s.point, corners);
      s.weight *= 1 + kSideWeight * (1 - 27 * s.share[0] * s.share[1] * s.share[2]);
    }
  });
}

void SurfaceFit::run(std::vector<Vec3d>& points, const std::vector<Triangle>& low,
                     std::span<const std::uint32_t> labels, std::span<const Quadric> planes,
                     bool draft) {
  draw_samples(sample_count_for(low.size(), draft));
  std::vector<Sample> found, before;
  const std::vector<Vec3d> collapsed_position = points;
  const MovingMesh moving_mesh(points, low, height_field_);
  const std::vector<std::uint8_t> is_movable = moving_mesh.is_movable();
  if (std::find(is_movable.begin(), is_movable.end(), 1) == is_movable.end()) return;
  const std::vector<CrossLineTensor> lines = label_lines_at_vertices(points, low, labels);
  for (int round = 0; round < (draft ? kDraftFitRounds : kFitRounds); ++round) {
    before.swap(found);
    match(is_movable, before, points, low, found);
    const VertexLists triangle_samples(
        low.size(), found.size(), [&](std::size_t i) { return found[i].triangle; },
        [](std::size_t) { return std::uint64_t{0}; });
    for (std::uint32_t v = 0; v < points.size(); ++v) {
      if (moving_mesh.fixed(v)) continue;
      StepEquations step_equations;
      const Sample* nearest = nullptr;
      double min_squared_length = std::numeric_limits<double>::infinity();
      for (const VertexLists::Item& corner : moving_mesh.corners(v)) {
        for (const VertexLists::Item& item : triangle_samples.of(corner.index / 3)) {
          const Sample& s = found[item.index];
          if (s.weight == 0) continue;
          const Vec3d offset = s.point - points[v];
          if (const double square = dot(offset, offset); square < min_squared_length)
            min_squared_length = square, nearest = &s;
          step_equations.add(s.normal, s.point - matched_position(s, points, low),
                             s.share[corner.index % 3], s.weight);
        }
      }
      if (!(step_equations.weight > 0)) continue;
      const double nearest_plane_weight =
          height_field_ ? 0 : kNearestPlaneWeight * step_equations.weight;
      step_equations.add_plane_equation(nearest->normal, nearest->point - points[v],
                                        nearest_plane_weight);
      if (!planes.empty())
        step_equations.add_quadric_equation(planes[v], collapsed_position[v], points[v]);
      if (!lines.empty()) step_equations.restrict_to_lines(lines[v]);
      Vec3d step = step_equations.step();
      const double size = length(step), longest = moving_mesh.longest_step(v);
      if (!(size > 0)) continue;  // Also skips NaN
      if (size > longest) step = step * (longest / size);
      for (const double step_share : {1.0, 0.5}) {
        const Vec3d target = snap_(points[v] + step * step_share);
        if (!moving_mesh.allows_step(v, target)) continue;
        points[v] = target;
        break;
      }
    }
    ProgressGuard::poll();
  }
}

}  // namespace kiln
