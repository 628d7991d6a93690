#include "mesh/crease_rule.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <tuple>

#include "base/disjoint_sets.h"
#include "mesh/high_poly_normals.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNoPart = 0xFFFFFFFFU;

/// Parameters of the histogram of edge angles, in degrees, and of gaps in it: see find_creases().
struct GapRule {
  static constexpr std::size_t kBins = 181;
  static constexpr std::size_t kFirstBin = 20;  ///< Equals kMinCreaseDegrees
  static constexpr std::size_t kRightAngle = 90;
  /// Edges within a gap may have at most this share of the weight above the gap
  static constexpr double kMaxGapWeight = 0.1;
  /// The angle at a gap's upper end must be at least this many times that at its lower end
  static constexpr double kMinGapRatio = 1.5;
  /// Edges above a gap must have at least this share of the part's weight. For a cube of ten million triangles, they
  /// have 1e-3
  static constexpr double kMinWeightAbove = 2e-4;
  /// Of the edges with an angle above the gap, at least this share by weight must be parts of lines: at both of their
  /// vertices there is another such edge or a border
  static constexpr double kMinLineShare = 0.8;
  /// Parts with fewer edges only have hard edges if edges within planes have at least the share kMinPlaneShareOfSmall
  /// of the weight, or if other edges below the gap have at most the share kMaxWeakShareOfSmall
  static constexpr std::size_t kMinEdgesWithoutPlanes = 100;
  static constexpr double kMinPlaneShareOfSmall = 0.1, kMaxWeakShareOfSmall = 0.05;
  /// Parts with fewer edges are examined together as one part; a tetrahedron has 6 edges
  static constexpr std::size_t kMinEdges = 12;
};

/// Parameters for parts with planes and edges, but without a gap.
struct PlaneRule {
  /// Edges within planes must have at least this share of the weight
  static constexpr double kMinPlaneShare = 0.25;
  static constexpr double kMinLineShare = 0.9;
  /// Range of the threshold in degrees
  static constexpr std::size_t kFirstBin = 25, kLastBin = 50;
};

/// Parameters for parts in which the file splits vertices at some edges.
struct SplitRule {
  static constexpr double kMinMedianAngle =
      25;  ///< Smallest median angle of split edges, in degrees
  /// If the median is smaller, split edges are still accepted if the 10% quantile of their angles is at least this, in
  /// degrees. This accepts shallow edges such as a blade's ridge
  static constexpr double kMinLowQuantileAngle = 5;
  /// Smallest ratio between angles of split and of other edges: the median (or the 10% quantile) of split edges over
  /// the 90% quantile of the others
  static constexpr double kMinSplitAngleRatio = 2;
  /// Split edges with a smaller angle, in degrees, are ignored, since they lie within planes
  static constexpr double kMinSplitAngle = 1;
  /// Split vertices are only evaluated if at least this share of all edges is not split. In triangle soups, all edges
  /// are
  static constexpr double kMinSharedShare = 0.1;
};

/// Parameters for surfaces of labelled voxels.
struct LatticeRule {
  static constexpr std::size_t kMinEdges = 200;
  /// Maximum extent of an edge along each axis, in steps of the lattice
  static constexpr double kMaxEdgeSteps = 2;
  static constexpr double kStepTolerance = 2e-3;  ///< Tolerance in steps of the lattice
  static constexpr double kMinSlantedShare =
      0.05;  ///< Edges with angles of 30 to 65 degrees must have at least this share of the weight
};

/// Parameters of correct_edges_between_planes().
struct PlanarRegionRule {
  static constexpr float kMaxPlaneAngle =
      0.1F;  ///< Edges within a plane have at most this angle, in degrees
  /// Triangles of a plane have normals within this angle of the plane's mean normal, in degrees
  static constexpr double kMaxPlaneDeviation = 0.5;
  static constexpr double kMinSingleAngle = 5;
  static constexpr double kMinSimilarRatio = 0.4,
                          /// Angles are similar if their ratio is in this range
      kMaxSimilarRatio = 2.5;
  /// Edges of a round shape, such as a tube, have at most this angle, in degrees
  static constexpr double kMaxRoundShapeAngle = 46;
  static constexpr double kAngleTolerance = 2;   ///< Tolerance of equal angles, degrees
  static constexpr double kAreaTolerance = 0.1;  ///< Relative tolerance of equal areas
};

std::size_t bin_of_angle(float degrees) {
  return std::min(static_cast<std::size_t>(std::lround(degrees)), GapRule::kBins - 1);
}

class CreaseFinder {
 public:
  CreaseFinder(const Mesh& mesh, const FaceEdges& faces) : mesh_(mesh), faces_(faces) {
    creases_.hard.resize(faces.edges.size());
    creases_.hard_part.resize(mesh.triangles.size());
  }

  void group_edges_by_part();
  void classify_parts();
  /// Makes the edges hard for which a predicate holds. Edges within polygons are never hard.
  template <typename IsHard>
  void make_hard(const IsHard& is_hard);
  void find_regions();
  /// Softens hard edges of round shapes such as tubes, and makes edges hard that resemble no other edge of their
  /// planes.
  void correct_edges_between_planes();
  Creases take_result();

 private:
  struct Histogram {
    std::array<double, GapRule::kBins> weight{};
    double plane_weight = 0, total = 0;
  };

  const FaceEdge& edge(std::uint32_t e) const { return faces_.edges[e]; }
  double weight(const FaceEdge& e) const {
    return std::min(faces_.areas[e.sides[0] / 3], faces_.areas[e.sides[1] / 3]);
  }
  std::array<std::uint32_t, 2> ends(const FaceEdge& e) const {
    const Triangle& at = mesh_.triangles[e.sides[0] / 3];
    return {faces_.welded[at[e.sides[0] % 3]], faces_.welded[at[(e.sides[0] + 1) % 3]]};
  }
  Histogram histogram(std::span<const std::uint32_t> edges) const;
  double line_share_from(std::span<const std::uint32_t> edges, double degrees);
  bool is_lattice(std::span<const std::uint32_t> edges, const Histogram& angles) const;
  bool classify_by_splits(std::span<const std::uint32_t> edges);
  double find_threshold(std::span<const std::uint32_t> edges);
  void classify_part(std::span<const std::uint32_t> edges);

  const Mesh& mesh_;
  const FaceEdges& faces_;
  Creases creases_;
  // Part of each triangle, identified by one of the part's triangles
  std::vector<std::uint32_t> part_of_;
  Adjacency edges_of_;  // Edges of each part
  // Number of each part, indexed by the triangle that identifies it
  std::vector<std::uint32_t> part_numbers_;
  // True if split vertices determined the part's hard edges; indexed by the triangle that identifies the part
  std::vector<bool> split_in_file_;
  std::vector<std::uint8_t> line_edges_;  // Scratch memory of line_share_from(), by welded vertex
};

void CreaseFinder::group_edges_by_part() {
  DisjointSets sets(mesh_.triangles.size());
  for (const FaceEdge& e : faces_.edges) sets.join(e.sides[0] / 3, e.sides[1] / 3);
  part_of_.resize(mesh_.triangles.size());
  std::vector<std::uint32_t> edges(mesh_.triangles.size());
  for (std::uint32_t t = 0; t < part_of_.size(); ++t) part_of_[t] = sets.find(t);
  for (const FaceEdge& e : faces_.edges) ++edges[part_of_[e.sides[0] / 3]];
  part_numbers_.assign(part_of_.size(), kNoPart);
  std::uint32_t next = 1;  // All small parts together have the number 0
  for (std::uint32_t t = 0; t < part_of_.size(); ++t) {
    if (part_of_[t] != t || faces_.areas[t] == 0) continue;
    ++creases_.parts;
    part_numbers_[t] = edges[t] < GapRule::kMinEdges ? 0 : next++;
  }
  edges_of_ = Adjacency::make(next, faces_.edges.size(), [&](std::size_t e) {
    return part_numbers_[part_of_[faces_.edges[e].sides[0] / 3]];
  });
  line_edges_.resize(mesh_.positions.size());
  split_in_file_.resize(part_of_.size());
}

CreaseFinder::Histogram CreaseFinder::histogram(std::span<const std::uint32_t> edges) const {
  Histogram result;
  for (const std::uint32_t e : edges) {
    const double w = weight(edge(e));
    result.weight[edge(e).inner ? 0 : bin_of_angle(edge(e).degrees)] += w;
    result.total += w;
    if (edge(e).inner || edge(e).degrees < PlanarRegionRule::kMaxPlaneAngle)
      result.plane_weight += w;
  }
  return result;
}

/// Share, by weight, of edges that continue at both ends, in another edge or in a border. Only edges with an angle of
/// at least `degrees` count. 0 if there are none.
double CreaseFinder::line_share_from(std::span<const std::uint32_t> edges, double degrees) {
  const auto each = [&](const auto& call) {
    for (const std::uint32_t e : edges) {
      if (edge(e).degrees >= degrees && !edge(e).inner) call(edge(e));
    }
  };
  each([&](const FaceEdge& e) {
    for (const std::uint32_t end : ends(e)) {
      line_edges_[end] = static_cast<std::uint8_t>(std::min(line_edges_[end] + 1, 2));
    }
  });
  double line_weight = 0, total_weight = 0;
  each([&](const FaceEdge& e) {
    const auto continues_line = [&](std::uint32_t end) {
      return line_edges_[end] > 1 || faces_.borders[end];
    };
    total_weight += weight(e);
    if (continues_line(ends(e)[0]) && continues_line(ends(e)[1])) line_weight += weight(e);
  });
  each([&](const FaceEdge& e) {
    for (const std::uint32_t end : ends(e)) line_edges_[end] = 0;
  });
  return total_weight > 0 ? line_weight / total_weight : 0;
}

bool CreaseFinder::is_lattice(std::span<const std::uint32_t> edges, const Histogram& angles) const {
  if (edges.size() < LatticeRule::kMinEdges) return false;
  const double slanted_weight = std::accumulate(&angles.weight[30], &angles.weight[66], 0.0);
  if (slanted_weight < LatticeRule::kMinSlantedShare * angles.total) return false;
  const auto along = [&](std::uint32_t e) {
    const auto [a, b] = ends(edge(e));
    const Vec3d d = to_double(mesh_.positions[b]) - to_double(mesh_.positions[a]);
    return std::array<double, 3>{std::abs(d.x), std::abs(d.y), std::abs(d.z)};
  };
  std::array<double, 3> max_steps{}, step{HUGE_VAL, HUGE_VAL, HUGE_VAL};
  for (const std::uint32_t e : edges) {
    for (std::size_t k = 0; k < 3; ++k) max_steps[k] = std::max(max_steps[k], along(e)[k]);
  }
  for (const std::uint32_t e : edges) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (along(e)[k] > max_steps[k] / (2 * LatticeRule::kMaxEdgeSteps)) {
        step[k] = std::min(step[k], along(e)[k]);
      }
    }
  }
  return std::all_of(edges.begin(), edges.end(), [&](std::uint32_t e) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double steps = along(e)[k] / step[k];
      if (steps > LatticeRule::kMaxEdgeSteps + LatticeRule::kStepTolerance ||
          std::abs(steps - std::round(steps)) > LatticeRule::kStepTolerance) {
        return false;
      }
    }
    return true;
  });
}

/// Sets hard edges where the file splits vertices.
/// \returns false if split vertices give no information
bool CreaseFinder::classify_by_splits(std::span<const std::uint32_t> edges) {
  std::vector<float> split_angles, shared_angles;
  for (const std::uint32_t e : edges) {
    if (edge(e).inner) continue;
    if (!edge(e).split) {
      shared_angles.push_back(edge(e).degrees);
    } else if (edge(e).degrees >= SplitRule::kMinSplitAngle) {
      split_angles.push_back(edge(e).degrees);
    }
  }
  const auto inner = static_cast<std::size_t>(
      std::count_if(edges.begin(), edges.end(), [&](std::uint32_t e) { return edge(e).inner; }));
  if (split_angles.empty() || static_cast<double>(shared_angles.size() + inner) <
                                  SplitRule::kMinSharedShare * static_cast<double>(edges.size())) {
    return false;
  }
  const auto quantile = [](std::vector<float>& angles, double share) {
    if (angles.empty()) return 0.0F;
    const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(angles.size() - 1));
    std::nth_element(angles.begin(), angles.begin() + at, angles.end());
    return angles[static_cast<std::size_t>(at)];
  };
  const double median = quantile(split_angles, 0.5), low = quantile(split_angles, 0.1);
  const double shared_quantile = quantile(shared_angles, 0.9);
  const bool has_steep_edges = median >= SplitRule::kMinMedianAngle &&
                               median >= SplitRule::kMinSplitAngleRatio * shared_quantile;
  const bool has_shallow_edges = low >= SplitRule::kMinLowQuantileAngle &&
                                 low >= SplitRule::kMinSplitAngleRatio * shared_quantile;
  if (!has_steep_edges && !has_shallow_edges) return false;
  for (const std::uint32_t e : edges) {
    creases_.hard[e] = edge(e).split && edge(e).degrees >= SplitRule::kMinSplitAngle;
  }
  return true;
}

/// The angle in degrees above which the edges of a part are hard; 180 if no edge is hard.
double CreaseFinder::find_threshold(std::span<const std::uint32_t> edges) {
  constexpr double kNoHardEdgeDegrees = 180;
  const Histogram angles = histogram(edges);
  // For each bin, the weight of this bin and all higher ones
  std::array<double, GapRule::kBins + 1> weight_above{};
  for (std::size_t i = GapRule::kBins; i-- > 0;)
    weight_above[i] = weight_above[i + 1] + angles.weight[i];
  if (!(weight_above[GapRule::kFirstBin] > 0)) return kNoHardEdgeDegrees;
  std::size_t from = 0, to = 0;
  double widest_ratio = 0;
  for (std::size_t a = GapRule::kFirstBin; a < GapRule::kRightAngle; ++a) {
    for (std::size_t b = a + 1; b < GapRule::kBins; ++b) {
      // The bins between a and b form the gap. If there are no edges above a, a virtual edge of 90 degrees is its upper
      // end.
      const bool is_virtual = b == GapRule::kRightAngle && !(weight_above[a + 1] > 0);
      if (!is_virtual && !(angles.weight[b] > 0)) continue;
      if (weight_above[a + 1] - weight_above[b] > GapRule::kMaxGapWeight * weight_above[b])
        continue;
      const double ratio =
          static_cast<double>(std::min(b, GapRule::kRightAngle)) / static_cast<double>(a);
      if (ratio > widest_ratio) std::tie(widest_ratio, from, to) = std::tuple(ratio, a, b);
    }
  }
  if (is_lattice(edges, angles)) return kNoHardEdgeDegrees;
  if (widest_ratio >= GapRule::kMinGapRatio) {
    if (weight_above[to] <= GapRule::kMinWeightAbove * angles.total) return kNoHardEdgeDegrees;
    const double cut = std::sqrt(static_cast<double>(from) *
                                 static_cast<double>(std::min(to, GapRule::kRightAngle)));
    // In a small part, such as a fragment of a scan, a gap may occur by chance.
    const double weak_weight =
        angles.total - angles.plane_weight - weight_above[static_cast<std::size_t>(std::ceil(cut))];
    if (edges.size() < GapRule::kMinEdgesWithoutPlanes &&
        angles.plane_weight < GapRule::kMinPlaneShareOfSmall * angles.total &&
        weak_weight > GapRule::kMaxWeakShareOfSmall * angles.total) {
      return kNoHardEdgeDegrees;
    }
    if (line_share_from(edges, cut) >= GapRule::kMinLineShare) return cut;
  }
  if (angles.plane_weight < PlaneRule::kMinPlaneShare * angles.total) return kNoHardEdgeDegrees;
  std::size_t emptiest_bin = PlaneRule::kFirstBin;
  const auto weight_around = [&](std::size_t at) {
    return std::accumulate(&angles.weight[at - 2], &angles.weight[at + 3], 0.0) *
           static_cast<double>(at);
  };
  for (std::size_t at = PlaneRule::kFirstBin; at <= PlaneRule::kLastBin; ++at) {
    if (weight_around(at) < weight_around(emptiest_bin)) emptiest_bin = at;
  }
  const auto cut = static_cast<double>(emptiest_bin);
  return line_share_from(edges, cut) >= PlaneRule::kMinLineShare ? cut : kNoHardEdgeDegrees;
}

void CreaseFinder::classify_part(std::span<const std::uint32_t> edges) {
  bool any = classify_by_splits(edges);
  const bool is_split_in_file = any;
  if (!any) {
    const double cut = find_threshold(edges);
    for (const std::uint32_t e : edges) {
      creases_.hard[e] = edge(e).degrees >= cut && !edge(e).inner;
      any = any || creases_.hard[e];
    }
  }
  if (!any) return;
  ++creases_.hard_parts;
  if (is_split_in_file) ++creases_.split_parts;
  for (const std::uint32_t e : edges) {
    const std::uint32_t part = part_of_[edge(e).sides[0] / 3];
    creases_.hard_part[part] = true;
    split_in_file_[part] = is_split_in_file;
  }
}

void CreaseFinder::classify_parts() {
  for (std::size_t part = 0; part + 1 < edges_of_.first.size(); ++part)
    classify_part(edges_of_.of(part));
}

template <typename IsHard>
void CreaseFinder::make_hard(const IsHard& is_hard) {
  for (std::size_t e = 0; e < faces_.edges.size(); ++e) {
    if (faces_.edges[e].inner || !is_hard(faces_.edges[e])) continue;
    creases_.hard[e] = true;
    creases_.hard_part[part_of_[faces_.edges[e].sides[0] / 3]] = true;
  }
  creases_.hard_parts = static_cast<std::uint64_t>(
      std::count(creases_.hard_part.begin(), creases_.hard_part.end(), true));
}

/// Finds planar regions of hard parts: triangles that are connected over edges with an angle of about 0.
void CreaseFinder::find_regions() {
  if (creases_.hard_parts == 0) return;
  DisjointSets sets(mesh_.triangles.size());
  for (const FaceEdge& e : faces_.edges) {
    if (creases_.hard_part[part_of_[e.sides[0] / 3]] &&
        (e.inner || e.degrees < PlanarRegionRule::kMaxPlaneAngle)) {
      sets.join(e.sides[0] / 3, e.sides[1] / 3);
    }
  }
  const std::size_t count = mesh_.triangles.size();
  creases_.regions.resize(count);
  creases_.region_areas.resize(count);
  std::vector<Vec3d> sums(count);
  std::vector<double> region_area(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::uint32_t region = creases_.regions[t] = sets.find(t);
    sums[region] += to_double(faces_.normals[t]) * double{faces_.areas[t]};
    region_area[region] += faces_.areas[t];
  }
  // A region with many tiny angles may be rounded, although no single edge shows that.
  std::vector<bool> is_bent_region(count);
  const double min_cosine = std::cos(PlanarRegionRule::kMaxPlaneDeviation * 3.14159265358979 / 180);
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::uint32_t region = creases_.regions[t];
    if (faces_.areas[t] > 0 &&
        dot(sums[region], to_double(faces_.normals[t])) < min_cosine * length(sums[region])) {
      is_bent_region[region] = true;
    }
  }
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::uint32_t region = creases_.regions[t];
    if (region != t && !is_bent_region[region])
      creases_.region_areas[region] = static_cast<float>(region_area[region]);
  }
}

void CreaseFinder::correct_edges_between_planes() {
  if (creases_.hard_parts == 0) return;
  // Border between two planes. A pair of planes has a single border, whatever the number of shared edges.
  struct PlaneBorder {
    std::uint32_t from, to;
    float degrees;
    bool convex, hard;
  };
  std::vector<PlaneBorder> plane_borders;
  const auto plane = [&](std::uint32_t side) { return creases_.regions[side / 3]; };
  for (std::size_t e = 0; e < faces_.edges.size(); ++e) {
    const FaceEdge& edge = faces_.edges[e];
    const std::uint32_t a = plane(edge.sides[0]), b = plane(edge.sides[1]);
    if (a == b || !creases_.hard_part[part_of_[a]]) continue;
    plane_borders.push_back({a, b, edge.degrees, edge.convex, creases_.hard[e]});
    plane_borders.push_back({b, a, edge.degrees, edge.convex, creases_.hard[e]});
  }
  std::sort(plane_borders.begin(), plane_borders.end(),
            [](const PlaneBorder& x, const PlaneBorder& y) {
              return std::tie(x.from, x.to, x.degrees) < std::tie(y.from, y.to, y.degrees);
            });
  const auto of = [&](std::uint32_t region) {
    return std::equal_range(
        plane_borders.begin(), plane_borders.end(), PlaneBorder{region, 0, 0, false, false},
        [](const PlaneBorder& x, const PlaneBorder& y) { return x.from < y.from; });
  };
  const auto& areas_of_regions = creases_.region_areas;
  const auto any = [&](std::uint32_t region, std::uint32_t but, const auto& is_similar) {
    const auto [begin, end] = of(region);
    return std::any_of(begin, end,
                       [&](const PlaneBorder& m) { return m.to != but && is_similar(m); });
  };
  std::vector<bool> hard = creases_.hard;
  for (std::size_t e = 0; e < faces_.edges.size(); ++e) {
    const FaceEdge& edge = faces_.edges[e];
    const std::uint32_t a = plane(edge.sides[0]), b = plane(edge.sides[1]);
    if (a == b || !(areas_of_regions[a] > 0) || !(areas_of_regions[b] > 0)) continue;
    if (split_in_file_[part_of_[edge.sides[0] / 3]]) continue;
    if (creases_.hard[e] && edge.degrees <= PlanarRegionRule::kMaxRoundShapeAngle) {
      const auto is_equal = [&](const PlaneBorder& m) {
        return m.convex == edge.convex &&
               std::abs(m.degrees - edge.degrees) < PlanarRegionRule::kAngleTolerance &&
               std::abs(areas_of_regions[m.to] - areas_of_regions[m.from]) <
                   PlanarRegionRule::kAreaTolerance * areas_of_regions[m.from];
      };
      hard[e] = !(std::abs(areas_of_regions[a] - areas_of_regions[b]) <
                      PlanarRegionRule::kAreaTolerance * areas_of_regions[a] &&
                  any(a, b, is_equal) && any(b, a, is_equal));
    } else if (!creases_.hard[e] && edge.degrees >= PlanarRegionRule::kMinSingleAngle) {
      const auto is_similar = [&](const PlaneBorder& m) {
        return !m.hard && m.convex == edge.convex &&
               m.degrees > PlanarRegionRule::kMinSimilarRatio * edge.degrees &&
               m.degrees < PlanarRegionRule::kMaxSimilarRatio * edge.degrees;
      };
      hard[e] = !any(a, b, is_similar) && !any(b, a, is_similar);
    }
  }
  creases_.hard = std::move(hard);
}

Creases CreaseFinder::take_result() {
  for (std::size_t t = 0; t < part_of_.size(); ++t) {
    creases_.hard_part[t] = creases_.hard_part[part_of_[t]];
  }
  for (std::size_t e = 0; e < faces_.edges.size(); ++e) {
    const double degrees = faces_.edges[e].degrees;
    if (!creases_.hard_part[faces_.edges[e].sides[0] / 3]) continue;
    if (creases_.hard[e]) {
      creases_.least_degrees = std::min(creases_.least_degrees, degrees);
    } else {
      creases_.most_smooth_degrees = std::max(creases_.most_smooth_degrees, degrees);
    }
  }
  return std::move(creases_);
}

}  // namespace

Creases find_creases(const Mesh& mesh, const FaceEdges& faces) {
  CreaseFinder rule(mesh, faces);
  rule.group_edges_by_part();
  rule.classify_parts();
  rule.find_regions();
  rule.correct_edges_between_planes();
  return rule.take_result();
}

Creases creases_from(const Mesh& mesh, const FaceEdges& faces, double degrees) {
  CreaseFinder rule(mesh, faces);
  rule.group_edges_by_part();
  rule.make_hard([&](const FaceEdge& edge) { return edge.degrees >= degrees; });
  rule.find_regions();
  return rule.take_result();
}

Creases creases_between(const Mesh& mesh, const FaceEdges& faces,
                        std::span<const std::uint32_t> masks) {
  CreaseFinder rule(mesh, faces);
  rule.group_edges_by_part();
  rule.make_hard([&](const FaceEdge& edge) {
    return (masks[edge.sides[0] / 3] & masks[edge.sides[1] / 3]) == 0;
  });
  return rule.take_result();
}

}  // namespace kiln
