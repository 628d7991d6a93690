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

/// The histogram of turns, degrees, and what counts as a gap in it: see find_creases().
struct GapRule {
  static constexpr std::size_t kBins = 181;
  static constexpr std::size_t kFirst = 20;  ///< kLeastCut
  static constexpr std::size_t kRightAngle = 90;
  static constexpr double kMostInside = 0.1;  ///< Share of the weight above
  static constexpr double kLeastRatio = 1.5;  ///< Of the gap's ends
  static constexpr double kLeastWeight =
      2e-4;  ///< Share above: a cube of ten million triangles has 1e-3
  static constexpr double kLeastLines = 0.8;     ///< Share of the edges above, by weight
  static constexpr std::size_t kFewEdges = 100;  ///< Parts of fewer have planes, or no smooth edges
  static constexpr double kPlanesOfFew = 0.1, kWeakOfFew = 0.05;  ///< Shares by weight
  static constexpr std::size_t kLeastEdges =
      12;  ///< A tetrahedron's has 6; smaller parts are judged together
};

/// Parts of planes and edges, but without a gap.
struct PlaneRule {
  static constexpr double kLeastPlanes = 0.25;  ///< Share of edges within planes, by weight
  static constexpr double kLeastLines = 0.9;
  static constexpr std::size_t kFirst = 25, kLast = 50;  ///< Where the angle is looked for, degrees
};

/// Vertices that the file splits.
struct SplitRule {
  static constexpr double kLeastMedian = 25;  ///< Turn of split edges, degrees
  static constexpr double kLeastRatio =
      2;  ///< To the turn that nine tenths of the others stay below
  static constexpr double kLeastTurn = 1;      ///< Splits in planes are no edges, degrees
  static constexpr double kLeastShared = 0.1;  ///< Share of the edges that are not split, by number
};

/// Surfaces of labelled voxels.
struct LatticeRule {
  static constexpr std::size_t kLeastEdges = 200;
  static constexpr double kMostSteps = 2;    ///< Of the lattice along an axis, of an edge
  static constexpr double kRounding = 2e-3;  ///< Of a step
  static constexpr double kLeastSlanted =
      0.05;  ///< Share of edges that turn by 30 to 65 degrees, by weight
};

/// Edges where planes meet.
struct RegionRule {
  static constexpr float kPlane = 0.1F;  ///< Turn within a plane, degrees
  static constexpr double kFlat = 0.5;   ///< Turn of a plane's triangle from the whole, degrees
  static constexpr double kLeastCrease = 5;
  static constexpr double kLess = 0.4, kMore = 2.5;  ///< Turns between these ratios are alike
  static constexpr double kMostRound = 46;           ///< Degrees
  static constexpr double kSameTurn = 2;             ///< Degrees
  static constexpr double kSameArea = 0.1;           ///< Share
};

std::size_t bin_of_turn(float turn) {
  return std::min(static_cast<std::size_t>(std::lround(turn)), GapRule::kBins - 1);
}

class CreaseFinder {
 public:
  CreaseFinder(const Mesh& mesh, const FaceEdges& faces) : mesh_(mesh), faces_(faces) {
    result_.hard.resize(faces.edges.size());
    result_.hard_part.resize(mesh.triangles.size());
  }

  void group();
  void judge();
  /// \param is_hard  of an edge, but for those within polygons
  template <typename IsHard>
  void cut(const IsHard& is_hard);
  void find_regions();
  void see_to_single_edges();
  Creases finish();

 private:
  struct Histogram {
    std::array<double, GapRule::kBins> weight{};
    double planes = 0, total = 0;
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
  double lines_from(std::span<const std::uint32_t> edges, double degrees);
  bool is_lattice(std::span<const std::uint32_t> edges, const Histogram& turns) const;
  bool judge_splits(std::span<const std::uint32_t> edges);
  double cut_of(std::span<const std::uint32_t> edges);
  void judge_part(std::span<const std::uint32_t> edges);

  const Mesh& mesh_;
  const FaceEdges& faces_;
  Creases result_;
  std::vector<std::uint32_t> part_of_;       // per triangle; a triangle of it
  Adjacency edges_of_;                       // per part
  std::vector<std::uint32_t> part_numbers_;  // per triangle that stands for a part
  std::vector<bool> by_file_;         // per triangle that stands for a part: split vertices say
  std::vector<std::uint8_t> strong_;  // per welded vertex, scratch of lines_from()
};

void CreaseFinder::group() {
  DisjointSets sets(mesh_.triangles.size());
  for (const FaceEdge& e : faces_.edges) sets.join(e.sides[0] / 3, e.sides[1] / 3);
  part_of_.resize(mesh_.triangles.size());
  std::vector<std::uint32_t> edges(mesh_.triangles.size());
  for (std::uint32_t t = 0; t < part_of_.size(); ++t) part_of_[t] = sets.find(t);
  for (const FaceEdge& e : faces_.edges) ++edges[part_of_[e.sides[0] / 3]];
  part_numbers_.assign(part_of_.size(), kNoPart);
  std::uint32_t next = 1;  // 0: small ones together
  for (std::uint32_t t = 0; t < part_of_.size(); ++t) {
    if (part_of_[t] != t || faces_.areas[t] == 0) continue;
    ++result_.parts;
    part_numbers_[t] = edges[t] < GapRule::kLeastEdges ? 0 : next++;
  }
  edges_of_ = Adjacency::make(next, faces_.edges.size(), [&](std::size_t e) {
    return part_numbers_[part_of_[faces_.edges[e].sides[0] / 3]];
  });
  strong_.resize(mesh_.positions.size());
  by_file_.resize(part_of_.size());
}

CreaseFinder::Histogram CreaseFinder::histogram(std::span<const std::uint32_t> edges) const {
  Histogram result;
  for (const std::uint32_t e : edges) {
    const double w = weight(edge(e));
    result.weight[edge(e).inner ? 0 : bin_of_turn(edge(e).turn)] += w;
    result.total += w;
    if (edge(e).inner || edge(e).turn < RegionRule::kPlane) result.planes += w;
  }
  return result;
}

/// Share of the edges from an angle on, by weight, that go on at both ends; 0 where there are none.
double CreaseFinder::lines_from(std::span<const std::uint32_t> edges, double degrees) {
  const auto each = [&](const auto& call) {
    for (const std::uint32_t e : edges) {
      if (edge(e).turn >= degrees && !edge(e).inner) call(edge(e));
    }
  };
  each([&](const FaceEdge& e) {
    for (const std::uint32_t end : ends(e)) {
      strong_[end] = static_cast<std::uint8_t>(std::min(strong_[end] + 1, 2));
    }
  });
  double lines = 0, all = 0;
  each([&](const FaceEdge& e) {
    const auto goes_on = [&](std::uint32_t end) { return strong_[end] > 1 || faces_.borders[end]; };
    all += weight(e);
    if (goes_on(ends(e)[0]) && goes_on(ends(e)[1])) lines += weight(e);
  });
  each([&](const FaceEdge& e) {
    for (const std::uint32_t end : ends(e)) strong_[end] = 0;
  });
  return all > 0 ? lines / all : 0;
}

bool CreaseFinder::is_lattice(std::span<const std::uint32_t> edges, const Histogram& turns) const {
  if (edges.size() < LatticeRule::kLeastEdges) return false;
  const double slanted = std::accumulate(&turns.weight[30], &turns.weight[66], 0.0);
  if (slanted < LatticeRule::kLeastSlanted * turns.total) return false;
  const auto along = [&](std::uint32_t e) {
    const auto [a, b] = ends(edge(e));
    const Vec3d d = Vec3d(mesh_.positions[b]) - Vec3d(mesh_.positions[a]);
    return std::array<double, 3>{std::abs(d.x), std::abs(d.y), std::abs(d.z)};
  };
  std::array<double, 3> most{}, step{HUGE_VAL, HUGE_VAL, HUGE_VAL};
  for (const std::uint32_t e : edges) {
    for (std::size_t k = 0; k < 3; ++k) most[k] = std::max(most[k], along(e)[k]);
  }
  for (const std::uint32_t e : edges) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (along(e)[k] > most[k] / (2 * LatticeRule::kMostSteps)) {
        step[k] = std::min(step[k], along(e)[k]);
      }
    }
  }
  return std::all_of(edges.begin(), edges.end(), [&](std::uint32_t e) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double steps = along(e)[k] / step[k];
      if (steps > LatticeRule::kMostSteps + LatticeRule::kRounding ||
          std::abs(steps - std::round(steps)) > LatticeRule::kRounding) {
        return false;
      }
    }
    return true;
  });
}

/// \return whether the file's vertices say which edges are hard: then that is set
bool CreaseFinder::judge_splits(std::span<const std::uint32_t> edges) {
  std::vector<float> split, shared;
  for (const std::uint32_t e : edges) {
    if (edge(e).inner) continue;
    if (!edge(e).split) {
      shared.push_back(edge(e).turn);
    } else if (edge(e).turn >= SplitRule::kLeastTurn) {
      split.push_back(edge(e).turn);
    }
  }
  const auto inner = static_cast<std::size_t>(
      std::count_if(edges.begin(), edges.end(), [&](std::uint32_t e) { return edge(e).inner; }));
  if (split.empty() || static_cast<double>(shared.size() + inner) <
                           SplitRule::kLeastShared * static_cast<double>(edges.size())) {
    return false;
  }
  const auto quantile = [](std::vector<float>& turns, double share) {
    if (turns.empty()) return 0.0F;
    const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(turns.size() - 1));
    std::nth_element(turns.begin(), turns.begin() + at, turns.end());
    return turns[static_cast<std::size_t>(at)];
  };
  const double median = quantile(split, 0.5), others = quantile(shared, 0.9);
  if (median < SplitRule::kLeastMedian || median < SplitRule::kLeastRatio * others) return false;
  for (const std::uint32_t e : edges) {
    result_.hard[e] = edge(e).split && edge(e).turn >= SplitRule::kLeastTurn;
  }
  return true;
}

/// The angle from which on a part's edges are hard; 180: none.
double CreaseFinder::cut_of(std::span<const std::uint32_t> edges) {
  constexpr double kSmooth = 180;
  const Histogram turns = histogram(edges);
  std::array<double, GapRule::kBins + 1> above{};  // weight from a bin on
  for (std::size_t i = GapRule::kBins; i-- > 0;) above[i] = above[i + 1] + turns.weight[i];
  if (!(above[GapRule::kFirst] > 0)) return kSmooth;
  std::size_t from = 0, to = 0;
  double widest = 0;
  for (std::size_t a = GapRule::kFirst; a < GapRule::kRightAngle; ++a) {
    for (std::size_t b = a + 1; b < GapRule::kBins; ++b) {
      // Bins between a and b are the gap. A right angle is thought to be above.
      const bool thought = b == GapRule::kRightAngle && !(above[a + 1] > 0);
      if (!thought && !(turns.weight[b] > 0)) continue;
      if (above[a + 1] - above[b] > GapRule::kMostInside * above[b]) continue;
      const double ratio =
          static_cast<double>(std::min(b, GapRule::kRightAngle)) / static_cast<double>(a);
      if (ratio > widest) std::tie(widest, from, to) = std::tuple(ratio, a, b);
    }
  }
  if (is_lattice(edges, turns)) return kSmooth;
  if (widest >= GapRule::kLeastRatio) {
    if (above[to] <= GapRule::kLeastWeight * turns.total) return kSmooth;
    const double cut = std::sqrt(static_cast<double>(from) *
                                 static_cast<double>(std::min(to, GapRule::kRightAngle)));
    // Of few turns some gap is easily found: of a scan's crumbs, too.
    const double weak =
        turns.total - turns.planes - above[static_cast<std::size_t>(std::ceil(cut))];
    if (edges.size() < GapRule::kFewEdges && turns.planes < GapRule::kPlanesOfFew * turns.total &&
        weak > GapRule::kWeakOfFew * turns.total) {
      return kSmooth;
    }
    if (lines_from(edges, cut) >= GapRule::kLeastLines) return cut;
  }
  if (turns.planes < PlaneRule::kLeastPlanes * turns.total) return kSmooth;
  std::size_t emptiest = PlaneRule::kFirst;
  const auto around = [&](std::size_t at) {
    return std::accumulate(&turns.weight[at - 2], &turns.weight[at + 3], 0.0) *
           static_cast<double>(at);
  };
  for (std::size_t at = PlaneRule::kFirst; at <= PlaneRule::kLast; ++at) {
    if (around(at) < around(emptiest)) emptiest = at;
  }
  const auto cut = static_cast<double>(emptiest);
  return lines_from(edges, cut) >= PlaneRule::kLeastLines ? cut : kSmooth;
}

void CreaseFinder::judge_part(std::span<const std::uint32_t> edges) {
  bool any = judge_splits(edges);
  const bool split = any;
  if (!any) {
    const double cut = cut_of(edges);
    for (const std::uint32_t e : edges) {
      result_.hard[e] = edge(e).turn >= cut && !edge(e).inner;
      any = any || result_.hard[e];
    }
  }
  if (!any) return;
  ++result_.hard_parts;
  if (split) ++result_.split_parts;
  for (const std::uint32_t e : edges) {
    const std::uint32_t part = part_of_[edge(e).sides[0] / 3];
    result_.hard_part[part] = true;
    by_file_[part] = split;
  }
}

void CreaseFinder::judge() {
  for (std::size_t part = 0; part + 1 < edges_of_.first.size(); ++part)
    judge_part(edges_of_.of(part));
}

template <typename IsHard>
void CreaseFinder::cut(const IsHard& is_hard) {
  for (std::size_t e = 0; e < faces_.edges.size(); ++e) {
    if (faces_.edges[e].inner || !is_hard(faces_.edges[e])) continue;
    result_.hard[e] = true;
    result_.hard_part[part_of_[faces_.edges[e].sides[0] / 3]] = true;
  }
  result_.hard_parts = static_cast<std::uint64_t>(
      std::count(result_.hard_part.begin(), result_.hard_part.end(), true));
}

/// Planes of hard parts: triangles that edges without a turn connect.
void CreaseFinder::find_regions() {
  if (result_.hard_parts == 0) return;
  DisjointSets sets(mesh_.triangles.size());
  for (const FaceEdge& e : faces_.edges) {
    if (result_.hard_part[part_of_[e.sides[0] / 3]] && (e.inner || e.turn < RegionRule::kPlane)) {
      sets.join(e.sides[0] / 3, e.sides[1] / 3);
    }
  }
  const std::size_t count = mesh_.triangles.size();
  result_.regions.resize(count);
  result_.region_areas.resize(count);
  std::vector<Vec3d> sums(count);
  std::vector<double> areas(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::uint32_t region = result_.regions[t] = sets.find(t);
    sums[region] += Vec3d(faces_.normals[t]) * faces_.areas[t];
    areas[region] += faces_.areas[t];
  }
  // A round of many small turns is no plane, though none of its edges shows it.
  std::vector<bool> bent(count);
  const double least = std::cos(RegionRule::kFlat * 3.14159265358979 / 180);
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::uint32_t region = result_.regions[t];
    if (faces_.areas[t] > 0 &&
        dot(sums[region], Vec3d(faces_.normals[t])) < least * length(sums[region])) {
      bent[region] = true;
    }
  }
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::uint32_t region = result_.regions[t];
    if (region != t && !bent[region])
      result_.region_areas[region] = static_cast<float>(areas[region]);
  }
}

void CreaseFinder::see_to_single_edges() {
  if (result_.hard_parts == 0) return;
  // Where two planes meet: once a pair of planes, however many edges.
  struct Meeting {
    std::uint32_t from, to;
    float turn;
    bool convex, hard;
  };
  std::vector<Meeting> meetings;
  const auto plane = [&](std::uint32_t side) { return result_.regions[side / 3]; };
  for (std::size_t e = 0; e < faces_.edges.size(); ++e) {
    const FaceEdge& edge = faces_.edges[e];
    const std::uint32_t a = plane(edge.sides[0]), b = plane(edge.sides[1]);
    if (a == b || !result_.hard_part[part_of_[a]]) continue;
    meetings.push_back({a, b, edge.turn, edge.convex, result_.hard[e]});
    meetings.push_back({b, a, edge.turn, edge.convex, result_.hard[e]});
  }
  std::sort(meetings.begin(), meetings.end(), [](const Meeting& x, const Meeting& y) {
    return std::tie(x.from, x.to, x.turn) < std::tie(y.from, y.to, y.turn);
  });
  const auto of = [&](std::uint32_t region) {
    return std::equal_range(meetings.begin(), meetings.end(), Meeting{region, 0, 0, false, false},
                            [](const Meeting& x, const Meeting& y) { return x.from < y.from; });
  };
  const auto& areas = result_.region_areas;
  const auto any = [&](std::uint32_t region, std::uint32_t but, const auto& alike) {
    const auto [begin, end] = of(region);
    return std::any_of(begin, end, [&](const Meeting& m) { return m.to != but && alike(m); });
  };
  std::vector<bool> hard = result_.hard;
  for (std::size_t e = 0; e < faces_.edges.size(); ++e) {
    const FaceEdge& edge = faces_.edges[e];
    const std::uint32_t a = plane(edge.sides[0]), b = plane(edge.sides[1]);
    if (a == b || !(areas[a] > 0) || !(areas[b] > 0)) continue;
    if (by_file_[part_of_[edge.sides[0] / 3]]) continue;
    if (result_.hard[e] && edge.turn <= RegionRule::kMostRound) {
      const auto equal = [&](const Meeting& m) {
        return m.convex == edge.convex && std::abs(m.turn - edge.turn) < RegionRule::kSameTurn &&
               std::abs(areas[m.to] - areas[m.from]) < RegionRule::kSameArea * areas[m.from];
      };
      hard[e] = !(std::abs(areas[a] - areas[b]) < RegionRule::kSameArea * areas[a] &&
                  any(a, b, equal) && any(b, a, equal));
    } else if (!result_.hard[e] && edge.turn >= RegionRule::kLeastCrease) {
      const auto alike = [&](const Meeting& m) {
        return !m.hard && m.convex == edge.convex && m.turn > RegionRule::kLess * edge.turn &&
               m.turn < RegionRule::kMore * edge.turn;
      };
      hard[e] = !any(a, b, alike) && !any(b, a, alike);
    }
  }
  result_.hard = std::move(hard);
}

Creases CreaseFinder::finish() {
  for (std::size_t t = 0; t < part_of_.size(); ++t) {
    result_.hard_part[t] = result_.hard_part[part_of_[t]];
  }
  for (std::size_t e = 0; e < faces_.edges.size(); ++e) {
    const double turn = faces_.edges[e].turn;
    if (!result_.hard_part[faces_.edges[e].sides[0] / 3]) continue;
    if (result_.hard[e]) {
      result_.least_degrees = std::min(result_.least_degrees, turn);
    } else {
      result_.most_smooth_degrees = std::max(result_.most_smooth_degrees, turn);
    }
  }
  return std::move(result_);
}

}  // namespace

Creases find_creases(const Mesh& mesh, const FaceEdges& faces) {
  CreaseFinder rule(mesh, faces);
  rule.group();
  rule.judge();
  rule.find_regions();
  rule.see_to_single_edges();
  return rule.finish();
}

Creases creases_from(const Mesh& mesh, const FaceEdges& faces, double degrees) {
  CreaseFinder rule(mesh, faces);
  rule.group();
  rule.cut([&](const FaceEdge& edge) { return edge.turn >= degrees; });
  rule.find_regions();
  return rule.finish();
}

Creases creases_between(const Mesh& mesh, const FaceEdges& faces,
                        std::span<const std::uint32_t> masks) {
  CreaseFinder rule(mesh, faces);
  rule.group();
  rule.cut([&](const FaceEdge& edge) {
    return (masks[edge.sides[0] / 3] & masks[edge.sides[1] / 3]) == 0;
  });
  return rule.finish();
}

}  // namespace kiln
