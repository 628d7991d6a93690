#include "lowpoly/normal_fit.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "kiln/error.h"
#include "kiln/validate.h"
#include "lowpoly/point_shares.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"
#include "mesh/vertex_lists.h"

namespace kiln {
namespace {

using Normals = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// Samples of the high poly for each face, and at least; of what is only looked at, a quarter.
constexpr std::size_t kSamplesOfFace = 16, kLeastSamples = std::size_t{1} << 15, kRough = 4;
constexpr std::size_t kGrainOfSamples = 1024;
/// Without normals of its own, a high poly of more triangles is sampled by its faces' normals: there is no telling
/// them from smooth ones.
constexpr std::size_t kDense = 200'000;
/// A sample counts where the low poly's face looks the same way, at least so nearly (cosine).
constexpr double kAgreement = 0.2;
/// Weight of the area-weighted normal of the faces around, beside that of the samples. Where these are few, it decides.
/// With less, normals are nearer where there is no map, and bend more from face to face, which a map has to undo.
constexpr double kTowardsFaces = 0.6;
/// Cosine of the angle between a normal and each face around it: tangent space reaches no farther than 90 degrees.
constexpr double kLeastFacing = 0.05;

double fraction(double x) { return x - std::floor(x); }

/// Places on triangles, evenly spread: the sequence that follows from the plastic number (Roberts 2018).
std::array<double, 3> spread_shares(std::size_t i) {
  double u = fraction(0.5 + 0.7548776662466927 * static_cast<double>(i));
  double v = fraction(0.5 + 0.5698402909980532 * static_cast<double>(i));
  if (u + v > 1) u = 1 - u, v = 1 - v;
  return {1 - u - v, u, v};
}

Vec3d face_of(const std::vector<Vec3>& p, const Triangle& t) {
  const Vec3d a(p[t[0]]);
  return cross(Vec3d(p[t[1]]) - a, Vec3d(p[t[2]]) - a);
}

/// Which corners of a low poly share a normal: those that share a vertex and its UVs. Normals that part at seams thus
/// cost no vertices.
class Fans {
 public:
  explicit Fans(const Mesh& low) : sets_(3 * low.triangles.size()), welded_(low.triangles) {
    const std::vector<std::uint32_t> first = weld_positions(low.positions);
    for (Triangle& t : welded_) {
      for (std::uint32_t& vertex : t) vertex = first[vertex];
    }
    const bool laid_out = low.uv_triangles.size() == low.triangles.size() && !low.uvs.empty();
    const std::vector<std::uint32_t> uvs = laid_out ? first_uvs(low) : std::vector<std::uint32_t>{};
    const auto uv_of = [&](std::size_t corner) {
      return laid_out ? uvs[low.uv_triangles[corner / 3][corner % 3]] : 0;
    };
    const VertexLists corners(
        low.positions.size(), 3 * low.triangles.size(),
        [&](std::size_t i) { return welded_[i / 3][i % 3]; },
        [&](std::size_t i) { return std::uint64_t{uv_of(i)}; });
    order_.reserve(3 * low.triangles.size());
    for (std::size_t v = 0; v < corners.vertices(); ++v) {
      const auto around = corners.of(v);
      for (std::size_t i = 0; i < around.size(); ++i) {
        order_.push_back(around[i].index);
        if (i > 0 && around[i].key == around[i - 1].key) {
          sets_.join(around[i - 1].index, around[i].index);
        }
      }
    }
    if (laid_out) find_seams(low.positions.size());
  }

  /// Joins normals over seams where they part by less at both ends.
  void soften(const Normals& normals, const std::vector<std::uint32_t>& slots,
              double least_cosine) {
    std::size_t kept = 0;
    for (const Seam& seam : seams_) {
      const auto near = [&](const std::array<std::uint32_t, 2>& corners) {
        return normals.row(slots[corners[0]]).dot(normals.row(slots[corners[1]])) > least_cosine;
      };
      if (near(seam[0]) && near(seam[1])) {
        for (const auto& corners : seam) sets_.join(corners[0], corners[1]);
      } else {
        seams_[kept++] = seam;
      }
    }
    seams_.resize(kept);
  }

  /// Of each corner, its normal's number; numbered in the order of vertices.
  std::vector<std::uint32_t> slots() {
    constexpr std::uint32_t kNone = 0xFFFFFFFFU;
    std::vector<std::uint32_t> number(3 * welded_.size(), kNone), result(number.size());
    count_ = 0;
    for (const std::uint32_t i : order_) {
      std::uint32_t& slot = number[sets_.find(i)];
      if (slot == kNone) slot = static_cast<std::uint32_t>(count_++);
      result[i] = slot;
    }
    return result;
  }
  std::size_t count() const { return count_; }
  /// UV seams that part normals.
  std::size_t hard() const { return seams_.size(); }

 private:
  /// Of both ends of an edge, the corners on its two sides.
  using Seam = std::array<std::array<std::uint32_t, 2>, 2>;

  /// Of each UV, the first of the same value.
  static std::vector<std::uint32_t> first_uvs(const Mesh& low) {
    std::vector<Vec3> flat;
    flat.reserve(low.uvs.size());
    for (const Vec2& uv : low.uvs) flat.push_back({uv.x, uv.y, 0});
    return weld_positions(flat);
  }
  std::uint32_t corner(std::uint32_t triangle, std::uint32_t vertex) const {
    const Triangle& t = welded_[triangle];
    return 3 * triangle + (t[0] == vertex ? 0U : t[1] == vertex ? 1U : 2U);
  }
  void find_seams(std::size_t vertices) {
    SideLists(welded_, vertices)
        .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
          const std::uint32_t b = SideLists::higher(sides[0]);
          for (std::size_t i = 1; i < sides.size(); ++i) {
            const std::uint32_t one = sides[i - 1].index / 3, other = sides[i].index / 3;
            const Seam seam{
                {{corner(one, a), corner(other, a)}, {corner(one, b), corner(other, b)}}};
            const bool parts = sets_.find(seam[0][0]) != sets_.find(seam[0][1]) ||
                               sets_.find(seam[1][0]) != sets_.find(seam[1][1]);
            if (parts && a != b) seams_.push_back(seam);
          }
        });
  }

  DisjointSets sets_;
  std::vector<Triangle> welded_;
  std::vector<std::uint32_t> order_;  ///< Corners by vertex
  std::vector<Seam> seams_;
  std::size_t count_ = 0;
};

/// Area-weighted normals, which flats keep; and the area around each, a third of each triangle's.
struct FaceNormals {
  Normals sums;
  std::vector<double> areas;
};

FaceNormals face_normals(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                         const std::vector<std::uint32_t>& slots, std::size_t count) {
  FaceNormals result{Normals::Zero(static_cast<Eigen::Index>(count), 3),
                     std::vector<double>(count)};
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vec3d face = face_of(positions, triangles[t]);
    const double doubled = length(face);
    if (!std::isfinite(doubled)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t slot = slots[3 * t + k];
      result.sums.row(slot) += Eigen::RowVector3d(face.x, face.y, face.z);
      result.areas[slot] += doubled / 3;
    }
  }
  return result;
}

/// Unit rows; (0, 0, 1) where a row has no direction.
void normalize(Normals& normals) {
  for (Eigen::Index i = 0; i < normals.rows(); ++i) {
    const double size = normals.row(i).norm();
    if (size > 0 && std::isfinite(size)) {
      normals.row(i) /= size;
    } else {
      normals.row(i) = Eigen::RowVector3d(0, 0, 1);
    }
  }
}

/// Angle-weighted normals, which look the way of all faces around, if any does.
Normals angle_weighted(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                       const std::vector<std::uint32_t>& slots, std::size_t count) {
  Normals result = Normals::Zero(static_cast<Eigen::Index>(count), 3);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const CornerWeights weights = corner_weights(positions, triangles[t]);
    const Eigen::RowVector3d face(weights.normal.x, weights.normal.y, weights.normal.z);
    for (std::size_t k = 0; k < 3; ++k) result.row(slots[3 * t + k]) += face * weights.angles[k];
  }
  normalize(result);
  return result;
}

/// Of each normal, the least cosine of its angles to the faces around.
std::vector<double> least_facing(const std::vector<Vec3>& positions,
                                 const std::vector<Triangle>& triangles,
                                 const std::vector<std::uint32_t>& slots, const Normals& normals) {
  std::vector<double> result(static_cast<std::size_t>(normals.rows()), 1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vec3d face = face_of(positions, triangles[t]);
    const double size = length(face);
    if (!(size > 0) || !std::isfinite(size)) continue;
    const Eigen::RowVector3d unit = Eigen::RowVector3d(face.x, face.y, face.z) / size;
    for (std::size_t k = 0; k < 3; ++k) {
      double& least = result[slots[3 * t + k]];
      least = std::min(least, normals.row(slots[3 * t + k]).dot(unit));
    }
  }
  return result;
}

/// Where a face would look too far from its normal, takes that towards the angle-weighted one.
void keep_facing(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                 const std::vector<std::uint32_t>& slots, Normals& normals) {
  constexpr int kSteps = 4;
  const Normals fitted = normals;
  const Normals base =
      angle_weighted(positions, triangles, slots, static_cast<std::size_t>(normals.rows()));
  const std::vector<double> of_base = least_facing(positions, triangles, slots, base);
  for (int step = 1; step <= kSteps; ++step) {
    const std::vector<double> least = least_facing(positions, triangles, slots, normals);
    const double share = static_cast<double>(step) / kSteps;
    bool any = false;
    for (Eigen::Index i = 0; i < normals.rows(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (least[k] >= std::min(kLeastFacing, of_base[k])) continue;
      normals.row(i) = (fitted.row(i) * (1 - share) + base.row(i) * share).normalized();
      any = true;
    }
    if (!any) return;
  }
}

}  // namespace

/// A point of the high poly, and where it lies on the low poly.
struct NormalFit::Place {
  std::uint32_t triangle = 0;
  std::array<double, 3> share{};
  Vec3d normal;  ///< Unit; zero: it does not count
};

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

/// The high poly's normal on a triangle. \param face  of the triangle, unit; taken where there is no other
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
  const double size = length(normal);
  if (!(size > 0)) return false;
  normal = normal * (1 / size);
  return true;
}

/// Samples of even area, each matched with the nearest point of the low poly.
std::vector<NormalFit::Place> NormalFit::places(std::size_t count, const Mesh& low) const {
  std::vector<Place> result(count);
  const double whole = area_until_.back();
  const std::vector<Vec3> light = frame_.to_frame(low);
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> source;
  for (std::uint32_t t = 0; t < low.triangles.size(); ++t) {
    const Triangle& c = low.triangles[t];
    if (!is_finite(light[c[0]]) || !is_finite(light[c[1]]) || !is_finite(light[c[2]])) continue;
    triangles.push_back(c);
    source.push_back(t);
  }
  if (triangles.empty()) return result;
  const SurfaceDistance surface(light, triangles);
  parallel_for(count, kGrainOfSamples, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double at = whole * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
      const auto found = std::upper_bound(area_until_.begin(), area_until_.end(), at);
      if (found == area_until_.end()) continue;
      const auto t = static_cast<std::size_t>(found - area_until_.begin());
      const Triangle& c = high_.triangles[t];
      const Vec3d face = face_of(positions_, c);
      const Vec3d unit = face * (1 / length(face));
      const std::array<double, 3> share = spread_shares(i);
      Vec3d normal;
      if (!normal_at(t, share, unit, normal)) continue;
      const Vec3d point = Vec3d(positions_[c[0]]) * share[0] + Vec3d(positions_[c[1]]) * share[1] +
                          Vec3d(positions_[c[2]]) * share[2];
      Place& place = result[i];
      place.triangle = source[surface.nearest(to_float(point))];
      const Triangle& l = low.triangles[place.triangle];
      const Vec3d below = face_of(light, l);
      if (!(dot(below, unit) > kAgreement * length(below))) continue;
      place.share = shares_of(point, Vec3d(light[l[0]]), Vec3d(light[l[1]]), Vec3d(light[l[2]]));
      place.normal = normal;
    }
  });
  return result;
}

void NormalFit::run(Mesh& low, const FitNormalsOptions& options, FitNormalsReport* report,
                    bool rough) const {
  const std::size_t wanted = std::max(kLeastSamples, kSamplesOfFace * low.triangles.size());
  const std::vector<Place> found = places(rough ? wanted / kRough : wanted, low);
  // Shares of triangles' corners, whichever normals these come to have.
  const double sample_area = area_until_.back() / static_cast<double>(found.size());
  const std::vector<Vec3> positions = frame_.to_frame(low);
  const auto fitted = [&](const std::vector<std::uint32_t>& slots, std::size_t count) {
    FaceNormals faces = face_normals(positions, low.triangles, slots, count);
    normalize(faces.sums);
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(9 * low.triangles.size() + count);
    Normals right = Normals::Zero(static_cast<Eigen::Index>(count), 3);
    // The sums of each triangle first: as many entries as it has pairs of corners.
    std::vector<std::array<double, 6>> sums(low.triangles.size(), std::array<double, 6>{});
    for (const Place& place : found) {
      if (!(dot(place.normal, place.normal) > 0)) continue;
      const auto& [x, y, z] = place.share;
      const std::array<double, 6> products{x * x, x * y, x * z, y * y, y * z, z * z};
      for (std::size_t i = 0; i < 6; ++i) sums[place.triangle][i] += sample_area * products[i];
      for (std::size_t k = 0; k < 3; ++k) {
        right.row(slots[3 * place.triangle + k]) +=
            sample_area * place.share[k] *
            Eigen::RowVector3d(place.normal.x, place.normal.y, place.normal.z);
      }
    }
    constexpr std::array<std::array<std::size_t, 3>, 3> kPair{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};
    for (std::size_t t = 0; t < sums.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          entries.emplace_back(slots[3 * t + i], slots[3 * t + k], sums[t][kPair[i][k]]);
        }
      }
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const double weight = kTowardsFaces * faces.areas[i] + 1e-12;
      entries.emplace_back(i, i, weight);
      right.row(i) += weight * faces.sums.row(i);
    }
    Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(count),
                                       static_cast<Eigen::Index>(count));
    matrix.setFromTriplets(entries.begin(), entries.end());
    Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
    solver.setTolerance(1e-6);
    solver.setMaxIterations(100);
    solver.compute(matrix);
    Normals normals = solver.solveWithGuess(right, faces.sums);
    normalize(normals);
    keep_facing(positions, low.triangles, slots, normals);
    return normals;
  };
  Fans fans(low);
  std::vector<std::uint32_t> slots = fans.slots();
  Normals normals = fitted(slots, fans.count());
  if (fans.hard() > 0) {
    fans.soften(normals, slots, std::cos(options.hard_degrees * std::numbers::pi / 180));
    slots = fans.slots();
    normals = fitted(slots, fans.count());
  }
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
    throw Error(ErrorCode::usage, "fit_normals: hard_degrees is " +
                                      std::to_string(options.hard_degrees) +
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
