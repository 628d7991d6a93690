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
#include "mesh/surface_distance.h"
#include "mesh/triangle_spread.h"
#include "mesh/vector.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"
#include "simplify/normal_fans.h"

namespace kiln {
namespace {

/// Samples of the high poly for each face, and at least; of what is only looked at, a quarter, and no more than the high
/// poly has triangles.
constexpr std::size_t kNormalSamplesOfFace = 16, kLeastNormalSamples = std::size_t{1} << 15,
                      kRough = 4;
constexpr std::size_t kGrainOfSamples = 1024;
constexpr std::uint32_t kNoSide = 0xFFFFFFFFU;
constexpr double kEndless = std::numeric_limits<double>::infinity();
/// More than double precision loses of squared distances, as a share.
constexpr double kNormalRounding = 1e-9;
/// Without normals of its own, a high poly of more triangles is sampled by its faces' normals: there is no telling
/// them from smooth ones.
constexpr std::size_t kDense = 200'000;
/// Residual at which a solution is taken, as a share of the right side; and of solutions that are only compared.
constexpr double kTolerance = 1e-6, kRoughTolerance = 1e-3;
/// A sample counts where the low poly's face looks the same way, at least so nearly (cosine).
constexpr double kNormalAgreement = 0.2;
/// Weight of the area-weighted normal of the faces around, beside that of the samples: where normals leave nothing of
/// the samples, and at most. With less on rough surfaces, normals are nearer where there is no map, and bend more from
/// face to face, which a map has to undo.
constexpr double kLeastTowardsFaces = 0.001, kMostTowardsFaces = 0.6;
/// The mean square of what normals leave at which half of that is due: that of 1.6 degrees.
constexpr double kRoughness = 0.0008;

/// By how much normals part at creases, degrees: less is not worth vertices. Along hard edges of the high poly that is
/// known to be no chance of few faces.
constexpr double kCreaseParts = 45, kHardParts = 30;
/// A hard edge of the high poly lies along one of the low poly's no farther from it than this share of its length. That
/// one is hard where so much of its length has some along it.
constexpr double kMostBeside = 0.25, kLeastAlong = 0.5;

double cosine_of(double degrees) { return std::cos(degrees * std::numbers::pi / 180); }

}  // namespace

/// A point of the high poly, and where it lies on the low poly.
struct NormalFit::Place {
  std::uint32_t triangle = 0;
  std::array<double, 3> share{};
  Vec3d normal;  ///< Zero: it does not count
  bool counts() const { return dot(normal, normal) > 0; }
};

NormalFit::Samples::Samples() = default;
NormalFit::Samples::~Samples() = default;

NormalFit::NormalFit(const Mesh& high)
    : high_(high), frame_(Frame::of(high)), positions_(frame_.to_frame(high)) {
  if (high.normal_triangles.size() != high.triangles.size() && high.triangles.size() <= kDense) {
    smooth_ = corner_normals(high, positions_);
  }
  area_until_.resize(high.triangles.size());
  parallel_for(area_until_.size(), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const double doubled = length(face_of(positions_, high.triangles[t]));
      area_until_[t] = std::isfinite(doubled) ? doubled : 0;
    }
  });
  double sum = 0;
  for (double& area : area_until_) area = sum += area;
  if (!(sum > 0)) {
    throw Error(ErrorCode::input,
                "fit_normals: mesh '" + high.name +
                    "' has no triangle of positive area; check the file it is from");
  }
}

void NormalFit::find_hard_edges() {
  if (high_.normal_triangles.size() != high_.triangles.size()) return;
  const std::vector<std::uint32_t> first = weld_vertices(positions_);
  std::vector<Triangle> welded = high_.triangles;
  for (Triangle& t : welded) {
    for (std::uint32_t& v : t) v = first[v];
  }
  const auto normal = [&](std::uint32_t triangle, std::uint32_t vertex) {
    const Triangle& t = welded[triangle];
    const std::size_t k = t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
    return Vec3d(high_.normals[high_.normal_triangles[triangle][k]]);
  };
  const double most = cosine_of(kHardParts);
  const auto parts = [&](const Vec3d& a, const Vec3d& b) {
    return dot(a, b) < most * length(a) * length(b);
  };
  SideLists(welded, positions_.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        const std::uint32_t b = SideLists::higher(sides[0]);
        if (sides.size() != 2 || a == b) return;
        const std::uint32_t one = sides[0].index / 3, other = sides[1].index / 3;
        if (!parts(normal(one, a), normal(other, a)) || !parts(normal(one, b), normal(other, b)))
          return;
        const Vec3d from(positions_[a]), to(positions_[b]);
        if (!is_finite(positions_[a]) || !is_finite(positions_[b])) return;
        hard_edges_.push_back({to_float((from + to) * 0.5), length(to - from)});
      });
}

/// Sides of a low poly's triangles along the high poly's hard edges, 3 * triangle + corner. Empty where there are none.
std::vector<bool> NormalFit::along_hard_edges(const std::vector<Vec3>& positions,
                                              const std::vector<Triangle>& triangles) const {
  if (hard_edges_.empty()) return {};
  std::vector<Triangle> finite;
  std::vector<std::uint32_t> source;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const Triangle& c = triangles[t];
    if (!is_finite(positions[c[0]]) || !is_finite(positions[c[1]]) || !is_finite(positions[c[2]]))
      continue;
    finite.push_back(c);
    source.push_back(t);
  }
  if (finite.empty()) return {};
  const SurfaceDistance surface(positions, finite);
  std::vector<std::uint32_t> side_of(hard_edges_.size(), kNoSide);
  parallel_for(hard_edges_.size(), kGrainOfSamples, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3d at(hard_edges_[i].middle);
      const std::uint32_t t = source[surface.nearest(hard_edges_[i].middle)];
      double least = kMostBeside;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d from(positions[triangles[t][k]]);
        const Vec3d along = Vec3d(positions[triangles[t][(k + 1) % 3]]) - from;
        const double size = length(along);
        if (!(size > 0)) continue;
        const double share = std::clamp(dot(at - from, along) / (size * size), 0.0, 1.0);
        const double beside = length(at - from - along * share) / size;
        if (beside >= least) continue;
        least = beside;
        side_of[i] = static_cast<std::uint32_t>(3 * t + k);
      }
    }
  });
  std::vector<double> along(3 * triangles.size(), 0.0);
  for (std::size_t i = 0; i < side_of.size(); ++i) {
    if (side_of[i] != kNoSide) along[side_of[i]] += hard_edges_[i].length;
  }
  const std::vector<std::uint32_t> first = weld_vertices(positions);
  std::vector<Triangle> welded = triangles;
  for (Triangle& t : welded) {
    for (std::uint32_t& v : t) v = first[v];
  }
  std::vector<bool> result(along.size());
  SideLists(welded, positions.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        double sum = 0;
        for (const SideLists::Item& side : sides) sum += along[side.index];
        const Vec3d edge = Vec3d(positions[SideLists::higher(sides[0])]) - Vec3d(positions[a]);
        if (!(sum > 0) || sum < kLeastAlong * length(edge)) return;
        for (const SideLists::Item& side : sides) result[side.index] = true;
      });
  return result;
}

/// The high poly's normal on a triangle, as it is interpolated: not of unit length.
/// \param face  of the triangle, unit; taken where there is no other
/// \returns false where it has no direction
bool NormalFit::normal_at(std::size_t triangle, const std::array<double, 3>& share,
                          const Vec3d& face, Vec3d& normal) const {
  const bool own = high_.normal_triangles.size() == high_.triangles.size();
  if (!own && smooth_.triangles.empty()) {
    normal = face;
    return true;
  }
  const Triangle& corners = own ? high_.normal_triangles[triangle] : smooth_.triangles[triangle];
  const std::vector<Vec3>& pool = own ? high_.normals : smooth_.normals;
  normal = {};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d at(pool[corners[k]]);
    const double size = length(at);
    if (!(size > 0) || !std::isfinite(size)) continue;
    normal += at * (share[k] / size);
  }
  return length(normal) > 0;
}

/// Samples of even area, each matched with the nearest point of the low poly; on two-sided sheets, with that of its
/// side.
std::vector<NormalFit::Place> NormalFit::places(std::size_t count, const Mesh& low,
                                                const TwoSided& sides) const {
  std::vector<Place> result(count);
  const double whole = area_until_.back();
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
  // A triangle's squared distance, and a bound of its rounding.
  const auto surely_within = [&](const Vec3& point, std::uint32_t triangle) {
    const Triangle& c = triangles[triangle];
    const std::array<Vec3, 3> corners{low_points[c[0]], low_points[c[1]], low_points[c[2]]};
    const double known = squared_to_triangle(Vec3d(point), corners.data(), kEndless);
    return known * (1 + kNormalRounding) + kNormalRounding * kNormalRounding;
  };
  parallel_for(count, kGrainOfSamples, [&](std::size_t begin, std::size_t end) {
    std::uint32_t nearest = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const double at = whole * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
      const auto found = std::upper_bound(area_until_.begin(), area_until_.end(), at);
      if (found == area_until_.end()) continue;
      const auto t = static_cast<std::size_t>(found - area_until_.begin());
      const Triangle& c = high_.triangles[t];
      const Vec3d face = face_of(positions_, c);
      const Vec3d unit = face * (1 / length(face));
      const TriangleSpread spread(static_cast<double>(i));
      const std::array<double, 3> share{1 - spread.u - spread.v, spread.u, spread.v};
      Vec3d normal;
      if (!normal_at(t, share, unit, normal)) continue;
      const Vec3d point = Vec3d(positions_[c[0]]) * share[0] + Vec3d(positions_[c[1]]) * share[1] +
                          Vec3d(positions_[c[2]]) * share[2];
      Place& place = result[i];
      const Vec3 rounded = to_float(point);
      // Samples follow the high poly's triangles, so the last one's is seldom far.
      nearest = surface.nearest(rounded, surely_within(rounded, nearest));
      place.triangle = source[nearest];
      Vec3d below = face_of(low_points, low.triangles[place.triangle]);
      if (!sides.empty() && sides.twins[place.triangle] != TwoSided::kNone &&
          dot(below, unit) < 0) {
        place.triangle = sides.twins[place.triangle];
        below = below * -1.0;
      }
      const Triangle& l = low.triangles[place.triangle];
      if (!(dot(below, unit) > kNormalAgreement * length(below))) continue;
      place.share = barycentric_projection(point, Vec3d(low_points[l[0]]), Vec3d(low_points[l[1]]),
                                           Vec3d(low_points[l[2]]));
      place.normal = normal;
    }
  });
  return result;
}

/// The best normals of given numbers for the samples of a low poly.
class NormalFit::Solver {
 public:
  /// \param sample_area  of each place
  /// \param tolerance    of solutions
  Solver(const std::vector<Place>& places, double sample_area, const std::vector<Vec3>& positions,
         const std::vector<Triangle>& triangles, NormalPurpose purpose, double tolerance)
      : places_(places),
        sample_area_(sample_area),
        purpose_(purpose),
        tolerance_(tolerance),
        positions_(positions),
        triangles_(triangles),
        sums_(triangles.size(), std::array<double, 6>{}),
        left_(triangles.size(), 0.0) {
    for (const Place& place : places) {
      if (!place.counts()) continue;
      const auto& [x, y, z] = place.share;
      const std::array<double, 6> products{x * x, x * y, x * z, y * y, y * z, z * z};
      for (std::size_t i = 0; i < 6; ++i) sums_[place.triangle][i] += sample_area * products[i];
    }
  }

  /// \param slots  of each corner, its normal's number, below `count`
  Normals solve(const std::vector<std::uint32_t>& slots, std::size_t count) const {
    Normals faces = Normals::Zero(static_cast<Eigen::Index>(count), 3), right = faces;
    std::vector<double> weights(count, 1e-12);
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(9 * triangles_.size() + count);
    constexpr std::array<std::array<std::size_t, 3>, 3> kPair{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const Vec3d face = face_of(positions_, triangles_[t]);
      const double doubled = length(face);
      if (!std::isfinite(doubled)) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t slot = slots[3 * t + i];
        if (purpose_ == NormalPurpose::shading) faces.row(slot) += row_of(face);
        weights[slot] += doubled / 3 * towards_faces(left_[t]);
        for (std::size_t k = 0; k < 3; ++k) {
          entries.emplace_back(slot, slots[3 * t + k], sums_[t][kPair[i][k]]);
        }
      }
    }
    if (purpose_ == NormalPurpose::map)
      faces = angle_weighted(positions_, triangles_, slots, count);
    normalize(faces);
    for (const Place& place : places_) {
      if (!place.counts()) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        right.row(slots[3 * std::size_t{place.triangle} + k]) +=
            sample_area_ * place.share[k] * row_of(place.normal);
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
    keep_facing(positions_, triangles_, slots, normals);
    return normals;
  }

  /// Finds how rough the surface is by what normals leave. Where samples are few, as rough as on the whole.
  void find_roughness(const Normals& normals, const std::vector<std::uint32_t>& slots) {
    constexpr double kPrior = 4;  // As many samples.
    std::vector<double> number(left_.size(), 0.0);
    left_.assign(left_.size(), 0.0);
    double all = 0, count = 0;
    for (const Place& place : places_) {
      if (!place.counts()) continue;
      Eigen::RowVector3d left = row_of(place.normal);
      for (std::size_t k = 0; k < 3; ++k) {
        left -= place.share[k] * normals.row(slots[3 * std::size_t{place.triangle} + k]);
      }
      left_[place.triangle] += left.squaredNorm();
      ++number[place.triangle];
      all += left.squaredNorm();
      ++count;
    }
    const double mean = count > 0 ? all / count : 0;
    for (std::size_t t = 0; t < left_.size(); ++t) {
      left_[t] = (left_[t] + kPrior * mean) / (number[t] + kPrior);
    }
  }

 private:
  static Eigen::RowVector3d row_of(const Vec3d& v) { return {v.x, v.y, v.z}; }
  static double towards_faces(double left) {
    return kLeastTowardsFaces +
           (kMostTowardsFaces - kLeastTowardsFaces) * left / (left + kRoughness);
  }

  const std::vector<Place>& places_;
  double sample_area_;
  NormalPurpose purpose_;  ///< Not by_uvs
  double tolerance_;
  const std::vector<Vec3>& positions_;
  const std::vector<Triangle>& triangles_;
  std::vector<std::array<double, 6>>
      sums_;                  ///< Sums of products of barycentric weights, by triangle
  std::vector<double> left_;  ///< Mean square residual of each triangle's samples
};

const std::vector<NormalFit::Place>& NormalFit::taken(const Mesh& low, const TwoSided& sides,
                                                      Samples& last) const {
  const bool known = !last.places_.empty() && last.triangles_ == low.triangles;
  if (known && last.positions_ == low.positions) return last.places_;
  const std::size_t wanted =
      std::max(kLeastNormalSamples, kNormalSamplesOfFace * low.triangles.size());
  last.places_ = places(wanted, low, sides);
  last.positions_ = low.positions;
  last.triangles_ = low.triangles;
  return last.places_;
}

void NormalFit::run(Mesh& low, const FitNormalsOptions& options, FitNormalsReport* report,
                    Samples* last) const {
  NormalPurpose purpose = options.purpose;
  if (purpose == NormalPurpose::by_uvs) {
    purpose = low.uv_triangles.empty() ? NormalPurpose::shading : NormalPurpose::map;
  }
  const TwoSided sides = TwoSided::of(low);
  Samples none;
  fit(low, sides, taken(low, sides, last != nullptr ? *last : none), purpose, options, kTolerance,
      report);
}

std::array<Mesh, 2> NormalFit::run_roughly(const Mesh& low,
                                           const FitNormalsOptions& options) const {
  const std::size_t wanted =
      std::max(kLeastNormalSamples, kNormalSamplesOfFace * low.triangles.size());
  const TwoSided sides = TwoSided::of(low);
  const std::size_t rough =
      std::min(wanted / kRough, std::max(kLeastNormalSamples / kRough, high_.triangles.size()));
  const std::vector<Place> found = places(rough, low, sides);
  std::array<Mesh, 2> result{low, low};
  fit(result[0], sides, found, NormalPurpose::shading, options, kRoughTolerance, nullptr);
  fit(result[1], sides, found, NormalPurpose::map, options, kRoughTolerance, nullptr);
  return result;
}

void NormalFit::fit(Mesh& low, const TwoSided& sides, const std::vector<Place>& found,
                    NormalPurpose purpose, const FitNormalsOptions& options, double tolerance,
                    FitNormalsReport* report) const {
  const std::vector<Vec3> positions = frame_.to_frame(low);
  const double sample_area = area_until_.back() / static_cast<double>(found.size());
  Solver solver(found, sample_area, positions, low.triangles, purpose, tolerance);
  // A map undoes what normals turn too far: there a crease is not worth a seam's vertices, but for the high poly's own,
  // which normals that are smooth over them leave as a step within each texel.
  const bool shaded = purpose == NormalPurpose::shading || low.uv_triangles.empty();
  const bool creased = shaded && options.crease_degrees < 180;
  const std::vector<bool> hard = along_hard_edges(positions, low.triangles);
  NormalFans fans(low, sides, creased ? cosine_of(options.crease_degrees) : -1, hard);
  std::vector<std::uint32_t> slots = fans.slots();
  Normals normals = solver.solve(slots, fans.count());
  solver.find_roughness(normals, slots);
  fans.soften(normals, slots, cosine_of(options.hard_degrees),
              cosine_of(hard.empty() ? kCreaseParts : kHardParts));
  slots = fans.slots();
  normals = solver.solve(slots, fans.count());
  low.normals.resize(fans.count());
  for (std::size_t i = 0; i < low.normals.size(); ++i) {
    const Eigen::RowVector3d n = normals.row(static_cast<Eigen::Index>(i));
    low.normals[i] = {static_cast<float>(n.x()), static_cast<float>(n.y()),
                      static_cast<float>(n.z())};
  }
  low.normal_triangles.resize(low.triangles.size());
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    low.normal_triangles[t] = {slots[3 * t], slots[3 * t + 1], slots[3 * t + 2]};
  }
  low.tangents.clear();  // Those of other normals.
  if (report == nullptr) return;
  report->normals = fans.count();
  report->hard_edges = fans.hard();
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
