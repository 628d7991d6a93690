#include "simplify/deviation_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "mesh/surface_distance.h"

namespace kiln {
namespace {

/// Maximum number of samples that improved_position() uses.
constexpr std::size_t kMaxMoveSamples = 128;
/// Weights in improved_position(). kZeroDistanceWeight: weight of a sample at distance 0, relative to a sample at the
/// bound. kBoundTangentialWeight: weight of displacement tangential to the surface, relative to displacement along the
/// normal.
constexpr double kZeroDistanceWeight = 0.01, kBoundTangentialWeight = 0.02;

/// Rounds a point to single precision, in which the final deviation is measured.
Vec3d round_to_single(const Vec3d& p) { return to_double(to_float(p)); }

double squared_distance_to_segment_point(const Vec3d& offset, const Vec3d& edge, double edge2,
                                         double& share) {
  const double along = dot(offset, edge);
  share = along > 0 ? (along < edge2 ? along / edge2 : 1.0) : 0.0;
  const Vec3d rest = offset - edge * share;
  return dot(rest, rest);
}

/// Squared distance of a point to a triangle, and barycentric coordinates of the triangle's nearest point.
/// \param best  smallest squared distance so far; the result may be infinity if the distance certainly exceeds it
template <class Face>
double squared_distance_to_face(const Face& f, const Vec3d& p, double best,
                                std::array<double, 3>* share) {
  const Vec3d ap = p - f.a;
  const double along = dot(ap, f.normal);
  if (f.size > 0) {
    if (share == nullptr && along * along > 1.0001 * best * f.size &&
        f.size > 1e-12 * f.ab2 * f.ac2) {
      return std::numeric_limits<double>::infinity();
    }
    const double d20 = dot(ap, f.ab), d21 = dot(ap, f.ac);
    const double v = f.ac2 * d20 - f.ab_ac * d21, w = f.ab2 * d21 - f.ab_ac * d20;
    const double determinant = f.ab2 * f.ac2 - f.ab_ac * f.ab_ac;
    if (v >= 0 && w >= 0 && v + w <= determinant) {
      if (share != nullptr) *share = {1 - (v + w) / determinant, v / determinant, w / determinant};
      return along * along / f.size;
    }
  }
  double s0 = 0, s1 = 0, s2 = 0;
  const Vec3d bc = f.ac - f.ab;
  const double e0 = squared_distance_to_segment_point(ap, f.ab, f.ab2, s0),
               e1 = squared_distance_to_segment_point(ap, f.ac, f.ac2, s1),
               e2 = squared_distance_to_segment_point(ap - f.ab, bc, dot(bc, bc), s2);
  if (share != nullptr) {
    if (e0 <= e1 && e0 <= e2)
      *share = {1 - s0, s0, 0};
    else if (e1 <= e2)
      *share = {1 - s1, 0, s1};
    else
      *share = {0, 1 - s2, s2};
  }
  return std::min({e0, e1, e2});
}

}  // namespace

DeviationSamples::DeviationSamples(std::span<const Vec3> positions, std::span<const Triangle> dense,
                                   std::uint64_t max_samples)
    : surface(positions, dense) {
  const std::uint64_t available = std::uint64_t{dense.size()} * 4;
  const std::uint64_t count = std::min(available, max_samples);
  std::vector<std::uint8_t> is_sampled(positions.size(), 0);
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t sample = distance_sample(i, count, available);
    const auto t = static_cast<std::uint32_t>(sample / 4);
    const Triangle& v = dense[t];
    const std::size_t k = sample % 4;
    if (k < 3) {
      if (is_sampled[v[k]] != 0) continue;
      is_sampled[v[k]] = 1;
    }
    points.push_back(distance_point(positions, v, k));
    triangles.push_back(t);
  }
}

DeviationBound::DeviationBound(const CollapseMesh& mesh, const DeviationSamples& samples,
                               double bound, bool is_high_poly)
    : samples_(samples),
      squared_limits_(samples.points.size(), bound * bound),
      squared_bound_(bound * bound),
      first_sample_(mesh.triangles.size(), kNoVertex),
      count_(mesh.triangles.size(), 0),
      next_sample_(samples.points.size(), kNoVertex) {
  std::vector<std::uint32_t> of = samples.triangles;
  if (!is_high_poly) {
    const std::vector<Vec3> points = to_floats(mesh.points);
    const SurfaceDistance tree(points, mesh.triangles);
    std::vector<double> squared(of.size());
    parallel_for(of.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        of[i] = tree.nearest(samples.points[i]);
        const Triangle& t = mesh.triangles[of[i]];
        const Face face =
            face_of(of[i], round_to_single(mesh.points[t[0]]), round_to_single(mesh.points[t[1]]),
                    round_to_single(mesh.points[t[2]]));
        squared[i] = squared_distance_to_face(face, to_double(samples.points[i]),
                                              std::numeric_limits<double>::infinity(), nullptr);
      }
    });
    was_within_bound_ =
        std::none_of(squared.begin(), squared.end(), [&](double d) { return d > bound * bound; }) &&
        low_to_high_distance(samples.surface, points, mesh.triangles).largest <= bound;
  }
  for (std::size_t i = of.size(); i-- > 0;) {
    next_sample_[i] = first_sample_[of[i]];
    first_sample_[of[i]] = static_cast<std::uint32_t>(i);
    ++count_[of[i]];
  }
}

void DeviationBound::tighten_limits(std::span<const Ball> balls) {
  for (std::size_t i = 0; i < squared_limits_.size(); ++i) {
    const Vec3d p = to_double(samples_.points[i]);
    const bool is_inside = std::any_of(balls.begin(), balls.end(), [&](const Ball& ball) {
      const Vec3d offset_from_center = p - ball.center;
      return dot(offset_from_center, offset_from_center) < ball.radius * ball.radius;
    });
    if (is_inside) squared_limits_[i] *= 1.0 / 16;
  }
}

DeviationBound::Face DeviationBound::face_of(std::uint32_t triangle, const Vec3d& a, const Vec3d& b,
                                             const Vec3d& c) {
  Face f;
  f.triangle = triangle;
  f.a = a;
  f.ab = b - a;
  f.ac = c - a;
  f.normal = cross(f.ab, f.ac);
  f.size = dot(f.normal, f.normal);
  f.ab2 = dot(f.ab, f.ab);
  f.ac2 = dot(f.ac, f.ac);
  f.ab_ac = dot(f.ab, f.ac);
  return f;
}

void DeviationBound::add_triangles_around(const CollapseMesh& mesh, std::uint32_t moved,
                                          std::uint32_t other, const Vec3d& target,
                                          bool with_common) {
  for (const std::uint32_t t : mesh.around(moved)) {
    if (mesh.alive[t] == 0) continue;
    const bool is_on_edge = other != kNoVertex && mesh.contains(t, other);
    if (is_on_edge && !with_common) continue;
    reassigned_triangles_.push_back(t);
    star_index_.push_back(is_on_edge ? kNoVertex
                                     : static_cast<std::uint32_t>(new_triangles_.size()));
    if (is_on_edge) continue;
    const Triangle& v = mesh.triangles[t];
    const std::size_t k = v[0] == moved ? 0 : v[1] == moved ? 1 : 2;
    new_triangles_.push_back(face_of(t, target, round_to_single(mesh.points[v[(k + 1) % 3]]),
                                     round_to_single(mesh.points[v[(k + 2) % 3]])));
  }
}

void DeviationBound::gather(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                            Anchor anchor, const Vec3d& target) {
  reassigned_triangles_.clear();
  star_index_.clear();
  new_triangles_.clear();
  const Vec3d position = round_to_single(target);
  // If one of the two vertices does not move, the triangles around it do not change. Only those around the other vertex
  // are added.
  if (anchor != Anchor::first) add_triangles_around(mesh, a, b, position, true);
  if (b != kNoVertex && anchor != Anchor::second) {
    add_triangles_around(mesh, b, a, position, anchor == Anchor::first);
  }
}

/// The nearest of the new triangles to a sample. Tests triangle `first` before the others, since it is the most likely
/// one.
DeviationBound::SampleAssignment DeviationBound::nearest_new_triangle(std::uint32_t sample,
                                                                      std::size_t first) const {
  SampleAssignment result{sample, 0, std::numeric_limits<double>::infinity()};
  const Vec3d p = to_double(samples_.points[sample]);
  const std::size_t count = new_triangles_.size();
  for (std::size_t k = 0, i = first; k < count; ++k, i = i + 1 == count ? 0 : i + 1) {
    const double squared = squared_distance_to_face(new_triangles_[i], p, result.squared, nullptr);
    if (!(squared < result.squared)) continue;
    result.squared = squared;
    result.face = static_cast<std::uint32_t>(i);
  }
  result.squared /= squared_limits_[sample];
  return result;
}

/// Reassigns all samples of the changed triangles. Stops at the first sample that exceeds its limit; the next call
/// tests that sample first.
/// \returns true if all samples are within their limits
bool DeviationBound::assign() {
  new_assignments_.clear();
  for (std::size_t i = 0; i < reassigned_triangles_.size(); ++i) {
    std::uint32_t previous_sample = kNoVertex;
    for (std::uint32_t s = first_sample_[reassigned_triangles_[i]]; s != kNoVertex;
         previous_sample = s, s = next_sample_[s]) {
      new_assignments_.push_back(
          nearest_new_triangle(s, star_index_[i] == kNoVertex ? 0 : star_index_[i]));
      refused_ratio_ = new_assignments_.back().squared;
      if (refused_ratio_ <= 1) continue;
      has_rejected_collapse_ = true;
      if (previous_sample != kNoVertex) {
        next_sample_[previous_sample] = next_sample_[s];
        next_sample_[s] = first_sample_[reassigned_triangles_[i]];
        first_sample_[reassigned_triangles_[i]] = s;
      }
      return false;
    }
  }
  return true;
}

/// True if the new triangles are within the bound of the high poly. Tested at the moved vertex, at the triangles'
/// centroids and at the middles of moved edges.
bool DeviationBound::is_near_high_poly(const Vec3d& position) {
  const auto is_too_far = [&](const Vec3d& p) {
    const Vec3 at = to_float(p);
    if (samples_.surface.is_within(at, squared_bound_)) return false;
    refused_ratio_ = samples_.surface.is_within(at, kMaxRecoverableRatio * squared_bound_)
                         ? 1
                         : kMaxRecoverableRatio;
    return true;
  };
  const auto is_face_too_far = [&](const Face& f) {
    if (is_too_far(f.a + (f.ab + f.ac) * (1.0 / 3)) || is_too_far(f.a + f.ab * 0.5)) return true;
    // The triangle's other moved edge is usually tested with the neighbour that shares it. On a border there is no such
    // neighbour, so the edge is tested here.
    const bool is_shared =
        std::any_of(new_triangles_.begin(), new_triangles_.end(), [&](const Face& other) {
          return other.ab.x == f.ac.x && other.ab.y == f.ac.y && other.ab.z == f.ac.z;
        });
    return !is_shared && is_too_far(f.a + f.ac * 0.5);
  };
  if (!is_too_far(position) &&
      std::none_of(new_triangles_.begin(), new_triangles_.end(), is_face_too_far))
    return true;
  has_rejected_collapse_ = true;
  return false;
}

bool DeviationBound::keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                           Anchor anchor, const Vec3d& target) {
  gather(mesh, a, b, anchor, target);
  return assign() && is_near_high_poly(target);
}

void DeviationBound::collapse() {
  for (const std::uint32_t t : reassigned_triangles_) {
    first_sample_[t] = kNoVertex;
    count_[t] = 0;
  }
  for (const SampleAssignment& s : new_assignments_) {
    const std::uint32_t t = new_triangles_[s.face].triangle;
    next_sample_[s.sample] = first_sample_[t];
    first_sample_[t] = s.sample;
    ++count_[t];
  }
}

/// Minimizes the sum of squared distances, each along the direction from its sample. With DistanceNorm::large, each
/// squared distance is weighted by the fourth power of the distance.
Vec3d DeviationBound::improved_position(const Vec3d& target, DistanceNorm which) {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, weight = 0;
  Vec3d right_side{};
  std::size_t count = 0;
  for (const std::uint32_t t : reassigned_triangles_) count += count_[t];
  const std::size_t stride = std::max<std::size_t>(1, count / kMaxMoveSamples);
  for (std::size_t i = 0; i < reassigned_triangles_.size(); ++i) {
    // If there are many samples, only every stride-th sample of each triangle is used. A triangle's first sample is
    // always used, since it is often the farthest.
    std::size_t sample_index = 0;
    for (std::uint32_t s = first_sample_[reassigned_triangles_[i]]; s != kNoVertex;
         s = next_sample_[s]) {
      if (sample_index++ % stride != 0) continue;
      const SampleAssignment found =
          nearest_new_triangle(s, star_index_[i] == kNoVertex ? 0 : star_index_[i]);
      const Face& f = new_triangles_[found.face];
      const Vec3d p = to_double(samples_.points[s]);
      std::array<double, 3> share{};
      squared_distance_to_face(f, p, 0, &share);
      if (!(share[0] > 0)) continue;
      const Vec3d offset = p - f.a - f.ab * share[1] - f.ac * share[2];
      const double size = length(offset), squared_ratio = found.squared;
      Vec3d along = f.size > 0 ? f.normal * (1 / std::sqrt(f.size)) : Vec3d{};
      if (squared_ratio > 1e-6) along = offset * (1 / size);
      const double w = which == DistanceNorm::all
                           ? share[0]
                           : (squared_ratio * squared_ratio + kZeroDistanceWeight) * share[0];
      const double square = w * share[0], pull = w * dot(along, offset);
      xx += square * along.x * along.x, xy += square * along.x * along.y;
      xz += square * along.x * along.z, yy += square * along.y * along.y;
      yz += square * along.y * along.z, zz += square * along.z * along.z;
      right_side += along * pull;
      weight += square;
    }
  }
  if (!(weight > 0)) return target;
  const double tangential_weight = kBoundTangentialWeight * weight;
  const Vec3d row0{xx + tangential_weight, xy, xz}, row1{xy, yy + tangential_weight, yz},
      row2{xz, yz, zz + tangential_weight};
  const Vec3d c12 = cross(row1, row2), c20 = cross(row2, row0), c01 = cross(row0, row1);
  return target +
         (c12 * right_side.x + c20 * right_side.y + c01 * right_side.z) * (1 / dot(row0, c12));
}

double DeviationBound::energy(DistanceNorm which) const {
  double sum = 0;
  for (const SampleAssignment& s : new_assignments_) {
    sum += which == DistanceNorm::all ? s.squared
                                      : s.squared * (s.squared * s.squared + kZeroDistanceWeight);
  }
  return sum;
}

}  // namespace kiln
