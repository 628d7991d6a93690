#include "simplify/normal_fit.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>

#include "base/formatted.h"
#include "base/parallel.h"
#include "kiln/error.h"
#include "kiln/validate.h"
#include "mesh/barycentric_projection.h"
#include "mesh/kept_triangles.h"
#include "mesh/surface_distance.h"
#include "mesh/triangle_spread.h"
#include "mesh/vector.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"
#include "simplify/normal_fans.h"

namespace kiln {
namespace {

/// Number of samples on the high poly: kNormalSamplesPerFace per face of the low poly, but at least kMinNormalSamples.
/// Draft fits divide both by kDraftDivisor, and use at most as many samples as the high poly has triangles.
constexpr std::size_t kNormalSamplesPerFace = 16, kMinNormalSamples = std::size_t{1} << 15,
                      kDraftDivisor = 4;
constexpr std::size_t kSamplesPerTask = 1024;
constexpr std::uint32_t kNoSide = 0xFFFFFFFFU;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Bound on the relative rounding error of squared distances in double precision.
constexpr double kNormalRounding = 1e-9;
/// If a high poly has no normals and more triangles than this, its face normals are sampled. At that density they do
/// not differ visibly from smooth normals.
constexpr std::size_t kMaxSmoothedTriangles = 200'000;
/// Relative residual at which the linear solver stops: in full fits, and in draft fits.
constexpr double kSolverTolerance = 1e-6, kDraftSolverTolerance = 1e-3;
/// A sample only counts if the cosine between its normal and the normal of the low-poly face is at least this.
constexpr double kMinNormalCosine = 0.2;
/// Range of the weight of the faces' area-weighted normals relative to the samples, for the smoothest and for the
/// roughest surfaces. On rough surfaces, a lower weight would fit normals better for shading without a map, but normals
/// would vary more between faces, which a normal map has to cancel.
constexpr double kMinFaceNormalWeight = 0.001, kMaxFaceNormalWeight = 0.6;
/// Mean squared residual at which the face normals' weight is in the middle of its range: the square of 1.6 degrees in
/// radians.
constexpr double kMidRoughness = 0.0008;

/// Smallest angle between the two fitted normals of a crease, in degrees. Smaller angles are not worth the extra
/// vertices. The limit is lower along hard edges of the high poly, where the angle is no artifact of a small number of
/// faces.
constexpr double kMinFittedCreaseDegrees = 45, kMinHardEdgeDegrees = 20;
/// A hard edge of the high poly belongs to a low-poly edge if their distance is below kMaxHardEdgeDistance times the
/// low-poly edge's length. A low-poly edge is hard if the hard edges that belong to it cover at least
/// kMinHardEdgeCoverage of its length.
constexpr double kMaxHardEdgeDistance = 0.25, kMinHardEdgeCoverage = 0.5;

double cosine_of(double degrees) { return std::cos(degrees * std::numbers::pi / 180); }

}  // namespace

/// A sample of the high poly, and the nearest position on the low poly.
struct NormalFit::SampleMatch {
  std::uint32_t triangle = 0;
  std::array<double, 3> share{};
  Vec3d normal{};  ///< Normal of the high poly; zero if the sample does not count
  bool has_match() const { return dot(normal, normal) > 0; }
};

NormalFit::Samples::Samples() = default;
NormalFit::Samples::~Samples() = default;

NormalFit::NormalFit(const Mesh& high)
    : high_(high), frame_(Frame::of(high)), positions_(frame_.to_frame(high)) {
  if (high.normal_triangles.size() != high.triangles.size() &&
      high.triangles.size() <= kMaxSmoothedTriangles) {
    smooth_ = corner_normals(high, positions_);
  }
  area_sums_.resize(high.triangles.size());
  parallel_for(area_sums_.size(), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const double doubled = length(face_of(positions_, high.triangles[t]));
      area_sums_[t] = std::isfinite(doubled) ? doubled : 0;
    }
  });
  double sum = 0;
  for (double& area : area_sums_) area = sum += area;
  if (!(sum > 0)) {
    throw Error(ErrorCode::input,
                "fit_normals: mesh '" + high.name +
                    "' has no triangle of positive area; check the file it was read from");
  }
  find_hard_edges();
}

void NormalFit::find_hard_edges() {
  if (high_.normal_triangles.size() != high_.triangles.size()) return;
  const std::vector<std::uint32_t> first = weld_vertices(positions_);
  const auto normal_of = [&](std::size_t triangle, std::size_t corner) {
    return to_double(high_.normals[high_.normal_triangles[triangle][corner]]);
  };
  // At both ends of a hard edge, two normals enclose more than kMinHardEdgeDegrees. So at least one of the two differs
  // by more than half of that angle from the vertex's first normal. A high poly without such vertices, such as a scan,
  // has no hard edges, and the search for them ends here.
  const double nearby = cosine_of(0.49 * kMinHardEdgeDegrees);
  std::vector<std::uint32_t> first_corner(positions_.size(), kNoSide);
  std::vector<bool> is_split(positions_.size());
  bool any = false;
  for (std::uint32_t t = 0; t < high_.triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t v = first[high_.triangles[t][k]];
      std::uint32_t& known = first_corner[v];
      if (known == kNoSide) known = 3 * t + k;
      const Vec3d a = normal_of(known / 3, known % 3), b = normal_of(t, k);
      if (dot(a, b) >= nearby * length(a) * length(b)) continue;
      is_split[v] = any = true;
    }
  }
  if (!any) return;
  std::vector<Triangle> welded;
  std::vector<std::uint32_t> source;
  for (std::uint32_t t = 0; t < high_.triangles.size(); ++t) {
    const Triangle& c = high_.triangles[t];
    const Triangle corners{first[c[0]], first[c[1]], first[c[2]]};
    if (is_split[corners[0]] + is_split[corners[1]] + is_split[corners[2]] < 2) continue;
    welded.push_back(corners);
    source.push_back(t);
  }
  const auto normal = [&](std::uint32_t triangle, std::uint32_t vertex) {
    const Triangle& t = welded[triangle];
    return normal_of(source[triangle], t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2);
  };
  const double max_cosine = cosine_of(kMinHardEdgeDegrees);
  const auto parts = [&](const Vec3d& a, const Vec3d& b) {
    return dot(a, b) < max_cosine * length(a) * length(b);
  };
  SideLists(welded, positions_.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        const std::uint32_t b = SideLists::higher(sides[0]);
        if (sides.size() != 2 || a == b) return;
        const std::uint32_t one = sides[0].index / 3, other = sides[1].index / 3;
        if (!parts(normal(one, a), normal(other, a)) || !parts(normal(one, b), normal(other, b)))
          return;
        const Vec3d from = to_double(positions_[a]), to = to_double(positions_[b]);
        if (!is_finite(positions_[a]) || !is_finite(positions_[b])) return;
        hard_edges_.push_back({to_float((from + to) * 0.5), length(to - from)});
      });
}

/// True for each side of a low-poly triangle (3 * triangle + corner) that lies along hard edges of the high poly; empty
/// if there are none.
std::vector<bool> NormalFit::along_hard_edges(const std::vector<Vec3>& positions,
                                              const std::vector<Triangle>& triangles) const {
  if (hard_edges_.empty()) return {};
  std::vector<Triangle> finite_triangles;
  std::vector<std::uint32_t> source;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const Triangle& c = triangles[t];
    if (!is_finite(positions[c[0]]) || !is_finite(positions[c[1]]) || !is_finite(positions[c[2]]))
      continue;
    finite_triangles.push_back(c);
    source.push_back(t);
  }
  if (finite_triangles.empty()) return {};
  const SurfaceDistance surface(positions, finite_triangles);
  std::vector<std::uint32_t> low_side_of_edge(hard_edges_.size(), kNoSide);
  parallel_for(hard_edges_.size(), kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3d at = to_double(hard_edges_[i].middle);
      const std::uint32_t t = source[surface.nearest(hard_edges_[i].middle)];
      double nearest_distance = kMaxHardEdgeDistance;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d from = to_double(positions[triangles[t][k]]);
        const Vec3d hard_length = to_double(positions[triangles[t][(k + 1) % 3]]) - from;
        const double size = length(hard_length);
        if (!(size > 0)) continue;
        const double share = std::clamp(dot(at - from, hard_length) / (size * size), 0.0, 1.0);
        const double distance_beside = length(at - from - hard_length * share) / size;
        if (distance_beside >= nearest_distance) continue;
        nearest_distance = distance_beside;
        low_side_of_edge[i] = static_cast<std::uint32_t>(3 * t + k);
      }
    }
  });
  std::vector<double> hard_length(3 * triangles.size(), 0.0);
  for (std::size_t i = 0; i < low_side_of_edge.size(); ++i) {
    if (low_side_of_edge[i] != kNoSide) hard_length[low_side_of_edge[i]] += hard_edges_[i].length;
  }
  const std::vector<std::uint32_t> first = weld_vertices(positions);
  std::vector<Triangle> welded = triangles;
  for (Triangle& t : welded) {
    for (std::uint32_t& v : t) v = first[v];
  }
  std::vector<bool> result(hard_length.size());
  SideLists(welded, positions.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        double sum = 0;
        for (const SideLists::Item& side : sides) sum += hard_length[side.index];
        const Vec3d edge =
            to_double(positions[SideLists::higher(sides[0])]) - to_double(positions[a]);
        if (!(sum > 0) || sum < kMinHardEdgeCoverage * length(edge)) return;
        for (const SideLists::Item& side : sides) result[side.index] = true;
      });
  return result;
}

/// Interpolated normal of the high poly, which is not of unit length.
/// \param face  the triangle's unit normal, used if its corners have no normals
/// \returns false if the normal has no direction
bool NormalFit::normal_at(std::size_t triangle, const std::array<double, 3>& share,
                          const Vec3d& face, Vec3d& normal) const {
  const bool has_own_normals = high_.normal_triangles.size() == high_.triangles.size();
  if (!has_own_normals && smooth_.triangles.empty()) {
    normal = face;
    return true;
  }
  const Triangle& corners =
      has_own_normals ? high_.normal_triangles[triangle] : smooth_.triangles[triangle];
  const std::vector<Vec3>& pool = has_own_normals ? high_.normals : smooth_.normals;
  normal = {};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d at = to_double(pool[corners[k]]);
    const double size = length(at);
    if (!(size > 0) || !std::isfinite(size)) continue;
    normal += at * (share[k] / size);
  }
  return length(normal) > 0;
}

/// Draws samples that represent equal areas, and matches each with the nearest point of the low poly. On two-sided
/// sheets, only points on the same side are matched.
std::vector<NormalFit::SampleMatch> NormalFit::match_samples(std::size_t count, const Mesh& low,
                                                             const TwoSided& sides) const {
  std::vector<SampleMatch> result(count);
  const double total_area = area_sums_.back();
  const std::vector<Vec3> low_points = frame_.to_frame(low);
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> source;
  for (std::uint32_t t = 0; t < low.triangles.size(); ++t) {
    const Triangle& c = low.triangles[t];
    if (!is_finite(low_points[c[0]]) || !is_finite(low_points[c[1]]) ||
        !is_finite(low_points[c[2]]))
      continue;
    triangles.push_back(c);
    source.push_back(t);
  }
  if (triangles.empty()) return result;
  const SurfaceDistance surface(low_points, triangles);
  const KeptTriangles kept(surface.corners());
  // Upper bound of the squared distance to a triangle, which allows for rounding.
  const auto squared_distance_bound = [&](const Vec3& point, std::uint32_t triangle) {
    const Triangle& c = triangles[triangle];
    const std::array<Vec3, 3> corners{low_points[c[0]], low_points[c[1]], low_points[c[2]]};
    const double known = squared_distance_to_triangle(to_double(point), corners.data(), kInfinity);
    return known * (1 + kNormalRounding) + kNormalRounding * kNormalRounding;
  };
  parallel_for(count, kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    std::uint32_t nearest = 0, same = KeptTriangles::kNone;
    std::size_t sampled_triangle = high_.triangles.size();
    for (std::size_t i = begin; i < end; ++i) {
      const double at = total_area * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
      const auto found = std::upper_bound(area_sums_.begin(), area_sums_.end(), at);
      if (found == area_sums_.end()) continue;
      const auto t = static_cast<std::size_t>(found - area_sums_.begin());
      const Triangle& c = high_.triangles[t];
      const Vec3d face = face_of(positions_, c);
      const Vec3d unit = face * (1 / length(face));
      const TriangleSpread point_spread(static_cast<double>(i));
      const std::array<double, 3> share{1 - point_spread.u - point_spread.v, point_spread.u,
                                        point_spread.v};
      Vec3d normal{};
      if (!normal_at(t, share, unit, normal)) continue;
      const Vec3d point = to_double(positions_[c[0]]) * share[0] +
                          to_double(positions_[c[1]]) * share[1] +
                          to_double(positions_[c[2]]) * share[2];
      SampleMatch& match = result[i];
      const Vec3 rounded = to_float(point);
      if (t != sampled_triangle) {
        sampled_triangle = t;
        same = kept.find({positions_[c[0]], positions_[c[1]], positions_[c[2]]});
      }
      // The search is bounded by the distance to the previous match. Samples follow the order of the high poly's
      // triangles, so consecutive matches are usually close.
      nearest = same != KeptTriangles::kNone
                    ? surface.triangle_at(same)
                    : surface.nearest(rounded, squared_distance_bound(rounded, nearest));
      match.triangle = source[nearest];
      Vec3d face_normal = face_of(low_points, low.triangles[match.triangle]);
      if (!sides.empty() && sides.twins[match.triangle] != TwoSided::kNone &&
          dot(face_normal, unit) < 0) {
        match.triangle = sides.twins[match.triangle];
        face_normal = face_normal * -1.0;
      }
      const Triangle& l = low.triangles[match.triangle];
      if (!(dot(face_normal, unit) > kMinNormalCosine * length(face_normal))) continue;
      match.share =
          barycentric_projection(point, to_double(low_points[l[0]]), to_double(low_points[l[1]]),
                                 to_double(low_points[l[2]]));
      match.normal = normal;
    }
  });
  return result;
}

/// Finds the normals of a low poly that fit the samples best, for a given choice of corners that share a normal.
class NormalFit::Solver {
 public:
  /// \param sample_area  area that each sample represents
  /// \param tolerance    relative residual at which the solver stops
  Solver(const std::vector<SampleMatch>& places, double sample_area,
         const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
         NormalPurpose purpose, double tolerance)
      : matches_(places),
        sample_area_(sample_area),
        purpose_(purpose),
        tolerance_(tolerance),
        positions_(positions),
        triangles_(triangles),
        product_sums_(triangles.size(), std::array<double, 6>{}),
        residuals_(triangles.size(), 0.0) {
    for (const SampleMatch& match : places) {
      if (!match.has_match()) continue;
      const auto& [x, y, z] = match.share;
      const std::array<double, 6> coordinate_products{x * x, x * y, x * z, y * y, y * z, z * z};
      for (std::size_t i = 0; i < 6; ++i)
        product_sums_[match.triangle][i] += sample_area * coordinate_products[i];
    }
  }

  /// \param normal_of_corner  for each corner, the index of its normal, below `count`
  Normals solve(const std::vector<std::uint32_t>& normal_of_corner, std::size_t count) const {
    Normals faces = Normals::Zero(static_cast<Eigen::Index>(count), 3), right = faces;
    std::vector<double> weights(count, 1e-12);
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(9 * triangles_.size() + count);
    constexpr std::array<std::array<std::size_t, 3>, 3> kPairIndex{
        {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const Vec3d face = face_of(positions_, triangles_[t]);
      const double doubled = length(face);
      if (!std::isfinite(doubled)) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t slot = normal_of_corner[3 * t + i];
        if (purpose_ == NormalPurpose::shading) faces.row(slot) += row_of(face);
        weights[slot] += doubled / 3 * face_normal_weight(residuals_[t]);
        for (std::size_t k = 0; k < 3; ++k) {
          entries.emplace_back(slot, normal_of_corner[3 * t + k],
                               product_sums_[t][kPairIndex[i][k]]);
        }
      }
    }
    if (purpose_ == NormalPurpose::map)
      faces = angle_weighted(positions_, triangles_, normal_of_corner, count);
    normalize(faces);
    for (const SampleMatch& match : matches_) {
      if (!match.has_match()) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        right.row(normal_of_corner[3 * std::size_t{match.triangle} + k]) +=
            sample_area_ * match.share[k] * row_of(match.normal);
      }
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      entries.emplace_back(i, i, weights[i]);
      right.row(i) += weights[i] * faces.row(i);
    }
    Eigen::SparseMatrix<double> matrix(faces.rows(), faces.rows());
    matrix.setFromTriplets(entries.begin(), entries.end());
    Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
    solver.setTolerance(tolerance_);
    solver.setMaxIterations(100);
    solver.compute(matrix);
    Normals normals = solver.solveWithGuess(right, faces);
    normalize(normals);
    keep_facing_forward(positions_, triangles_, normal_of_corner, normals);
    return normals;
  }

  /// Estimates the roughness of the surface at each triangle from the squared residuals of its samples. Where samples
  /// are few, the mean of all triangles is blended in.
  void estimate_roughness(const Normals& normals,
                          const std::vector<std::uint32_t>& normal_of_corner) {
    constexpr double kPriorSamples =
        4;  // Weight of the mean of all triangles, as a number of samples
    std::vector<double> number(residuals_.size(), 0.0);
    residuals_.assign(residuals_.size(), 0.0);
    double residual_sum = 0, count = 0;
    for (const SampleMatch& match : matches_) {
      if (!match.has_match()) continue;
      Eigen::RowVector3d residual = row_of(match.normal);
      for (std::size_t k = 0; k < 3; ++k) {
        residual -=
            match.share[k] * normals.row(normal_of_corner[3 * std::size_t{match.triangle} + k]);
      }
      residuals_[match.triangle] += residual.squaredNorm();
      ++number[match.triangle];
      residual_sum += residual.squaredNorm();
      ++count;
    }
    const double mean = count > 0 ? residual_sum / count : 0;
    for (std::size_t t = 0; t < residuals_.size(); ++t) {
      residuals_[t] = (residuals_[t] + kPriorSamples * mean) / (number[t] + kPriorSamples);
    }
  }

 private:
  static Eigen::RowVector3d row_of(const Vec3d& v) { return {v.x, v.y, v.z}; }
  static double face_normal_weight(double residual) {
    return kMinFaceNormalWeight +
           (kMaxFaceNormalWeight - kMinFaceNormalWeight) * residual / (residual + kMidRoughness);
  }

  const std::vector<SampleMatch>& matches_;
  double sample_area_;
  NormalPurpose purpose_;  ///< Plain shading or a normal map, never NormalPurpose::by_uvs
  double tolerance_;
  const std::vector<Vec3>& positions_;
  const std::vector<Triangle>& triangles_;
  /// For each triangle, sums of products of its samples' barycentric coordinates
  std::vector<std::array<double, 6>> product_sums_;
  std::vector<double> residuals_;  ///< For each triangle, the mean squared residual of its samples
};

const std::vector<NormalFit::SampleMatch>& NormalFit::sampled_positions(const Mesh& low,
                                                                        const TwoSided& sides,
                                                                        Samples& last) const {
  const bool are_samples_known = !last.matches_.empty() && last.triangles_ == low.triangles;
  if (are_samples_known && last.positions_ == low.positions) return last.matches_;
  const std::size_t sample_count =
      std::max(kMinNormalSamples, kNormalSamplesPerFace * low.triangles.size());
  last.matches_ = match_samples(sample_count, low, sides);
  last.positions_ = low.positions;
  last.triangles_ = low.triangles;
  return last.matches_;
}

void NormalFit::run(Mesh& low, const FitNormalsOptions& options, FitNormalsReport* report,
                    Samples* last, EdgesUnderMap edges) const {
  NormalPurpose purpose = options.purpose;
  if (purpose == NormalPurpose::by_uvs) {
    purpose = low.uv_triangles.empty() ? NormalPurpose::shading : NormalPurpose::map;
  }
  const TwoSided sides = TwoSided::of(low);
  Samples none;
  fit(low, sides, sampled_positions(low, sides, last != nullptr ? *last : none), purpose, options,
      kSolverTolerance, report, edges);
}

std::array<Mesh, 2> NormalFit::run_draft(const Mesh& low, const FitNormalsOptions& options,
                                         EdgesUnderMap edges) const {
  const std::size_t sample_count =
      std::max(kMinNormalSamples, kNormalSamplesPerFace * low.triangles.size());
  const TwoSided sides = TwoSided::of(low);
  const std::size_t draft_samples =
      std::min(sample_count / kDraftDivisor,
               std::max(kMinNormalSamples / kDraftDivisor, high_.triangles.size()));
  const std::vector<SampleMatch> found = match_samples(draft_samples, low, sides);
  std::array<Mesh, 2> result{low, low};
  fit(result[0], sides, found, NormalPurpose::shading, options, kDraftSolverTolerance, nullptr,
      edges);
  fit(result[1], sides, found, NormalPurpose::map, options, kDraftSolverTolerance, nullptr, edges);
  return result;
}

void NormalFit::fit(Mesh& low, const TwoSided& sides, const std::vector<SampleMatch>& found,
                    NormalPurpose purpose, const FitNormalsOptions& options, double tolerance,
                    FitNormalsReport* report, EdgesUnderMap edges) const {
  const std::vector<Vec3> positions = frame_.to_frame(low);
  const double sample_area = area_sums_.back() / static_cast<double>(found.size());
  Solver solver(found, sample_area, positions, low.triangles, purpose, tolerance);
  // With a normal map, which corrects normals, a crease is not worth the extra vertices. Along hard edges of the high
  // poly it is: smooth normals across such an edge would leave a step within a texel. The charts need no seam there:
  // normals on both sides are near the high poly's, so the texels on both sides store nearly the same vector.
  const bool shaded = purpose == NormalPurpose::shading || low.uv_triangles.empty();
  const bool with_creases = shaded && options.crease_degrees < 180;
  std::vector<bool> hard;
  if (options.hard_degrees < 180 && (shaded || edges == EdgesUnderMap::hard))
    hard = along_hard_edges(positions, low.triangles);
  NormalFans fans(low, sides, with_creases ? cosine_of(options.crease_degrees) : -1, hard);
  std::vector<std::uint32_t> normal_of_corner = fans.normal_of_corner();
  Normals normals = solver.solve(normal_of_corner, fans.count());
  solver.estimate_roughness(normals, normal_of_corner);
  fans.soften(normals, normal_of_corner, cosine_of(options.hard_degrees),
              cosine_of(hard.empty() ? kMinFittedCreaseDegrees : kMinHardEdgeDegrees));
  normal_of_corner = fans.normal_of_corner();
  normals = solver.solve(normal_of_corner, fans.count());
  low.normals.resize(fans.count());
  for (std::size_t i = 0; i < low.normals.size(); ++i) {
    const Eigen::RowVector3d n = normals.row(static_cast<Eigen::Index>(i));
    low.normals[i] = {static_cast<float>(n.x()), static_cast<float>(n.y()),
                      static_cast<float>(n.z())};
  }
  low.normal_triangles.resize(low.triangles.size());
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    low.normal_triangles[t] = {normal_of_corner[3 * t], normal_of_corner[3 * t + 1],
                               normal_of_corner[3 * t + 2]};
  }
  low.tangents.clear();  // Tangents depend on the normals, so the old ones are invalid
  if (report == nullptr) return;
  report->normals = fans.count();
  report->hard_edges = fans.count_split_edges();
}

Mesh fit_normals(const Mesh& low, const Mesh& high, const FitNormalsOptions& options,
                 FitNormalsReport* report) {
  if (!(options.hard_degrees >= 0 && options.hard_degrees <= 180)) {
    throw Error(ErrorCode::usage, "fit_normals: hard_degrees is " + decimal(options.hard_degrees) +
                                      "; it must be between 0 and 180");
  }
  if (!(options.crease_degrees >= 0 && options.crease_degrees <= 180)) {
    throw Error(ErrorCode::usage, "fit_normals: crease_degrees is " +
                                      decimal(options.crease_degrees) +
                                      "; it must be between 0 and 180");
  }
  validate(low);
  validate(high);
  Mesh result = low;
  if (report != nullptr) *report = {};
  NormalFit(high).run(result, options, report);
  return result;
}

}  // namespace kiln
