// Detects and corrects normals that point to the back of their faces, and parts whose faces point inwards.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "kiln/normals.h"
#include "kiln/validate.h"
#include "mesh/box.h"
#include "mesh/normals.h"
#include "mesh/vector.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// The signs by which a mirroring multiplies x, y and z. The first entry changes nothing, the second negates all three.
using AxisSigns = std::array<double, 3>;
constexpr std::array<AxisSigns, 8> kMirrorSigns = {{{1, 1, 1},
                                                    {-1, -1, -1},
                                                    {-1, 1, 1},
                                                    {1, -1, 1},
                                                    {1, 1, -1},
                                                    {-1, -1, 1},
                                                    {-1, 1, -1},
                                                    {1, -1, -1}}};
constexpr std::size_t kUnchanged = 0, kNegated = 1;

/// Normals are opposed to their triangle if their mean cosine to it is below this.
constexpr double kMaxOpposedCosine = -0.2;
/// A part is only changed if normals are opposed on at least this share of its area.
constexpr double kMinOpposedShare = 0.95;
/// Negation is only accepted if the mean error (1 - cosine) of a part's normals is at most this afterwards.
constexpr double kMaxNegatedError = 0.1;
/// A mirroring is only accepted if the mean error of a part's normals is at most kMaxMirrorError afterwards. Mirrorings
/// fit by chance more easily than negation, so they must also reduce the error by at least the factor kMinMirrorGain.
constexpr double kMaxMirrorError = 0.02, kMinMirrorGain = 10;
/// In open parts with fewer triangles, mirrored normals are not detected.
constexpr std::uint32_t kMinMirrorTriangles = 16;
/// If the mean error of a mesh's normals is below this, nothing is checked.
constexpr double kMaxUsualError = 0.02;
/// If an open part's normals fit neither unchanged nor mirrored (a mean error above kMinForeignError), they imitate
/// another shape on purpose. If such parts have more than the share kMaxForeignShare of the area of open parts, no open
/// part is changed.
constexpr double kMinForeignError = 0.15, kMaxForeignShare = 0.2;
/// Flux of a part's surface relative to the largest possible flux. An open part counts as nearly closed above
/// kMinOpenFlux; a closed part has an inside above kMinClosedFlux, which exceeds rounding.
constexpr double kMinOpenFlux = 0.3, kMinClosedFlux = 1e-3;
/// The quick check suspects that a part faces inwards if its relative flux is below this.
constexpr double kMaxSuspectFlux = -0.02;
constexpr std::size_t kTrianglesPerTask = std::size_t{1} << 15;

struct SidePart {
  // Doubled areas of all triangles, and of those with opposed normals
  double area = 0, opposed_area = 0;
  std::array<double, kMirrorSigns.size()> mirror_errors{};
  double flux = 0, max_flux = 0;
  Vec3d centre{};
  Box<Vec3d> box;
  std::uint32_t lowest_triangle = 0, triangles = 0;
  bool open = false;

  bool has_area() const { return area > 0; }
  /// Flux of the normals away from the part's centre, relative to the largest possible flux; positive if the part faces
  /// outwards.
  double outward() const { return max_flux > 0 ? flux / max_flux : 0; }
  /// 1 if the part faces outwards, -1 if it faces inwards, 0 if it is a sheet without an inside.
  int side() const {
    const double min_flux = open ? kMinOpenFlux : kMinClosedFlux;
    return outward() > min_flux ? 1 : outward() < -min_flux ? -1 : 0;
  }
};

struct SideFace {
  Vec3d normal{}, centre{};  // `normal` is a unit vector if the area is positive
  double area = 0;           // Doubled area
};

SideFace face_of(const Mesh& mesh, std::size_t t) {
  const Triangle& v = mesh.triangles[t];
  const Vec3d a = to_double(mesh.positions[v[0]]), b = to_double(mesh.positions[v[1]]),
              c = to_double(mesh.positions[v[2]]);
  SideFace face;
  face.normal = cross(b - a, c - a);
  const double size = length(face.normal);
  if (!(size > 0) || !std::isfinite(size)) return face;
  face.area = size;
  face.normal = face.normal * (1 / size);
  face.centre = (a + b + c) * (1.0 / 3);
  return face;
}

/// Mean, over a triangle's corners, of the cosine between the corner's normal (with mirrored signs) and the face's
/// normal, or the smooth normal if that is nearer.
double mean_normal_cosine(const Mesh& mesh, const std::vector<Vec3>& smooth, std::size_t t,
                          const Vec3d& face, const AxisSigns& signs) {
  double sum = 0;
  int count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& own = mesh.normals[mesh.normal_triangles[t][k]];
    if (!is_usable_normal(own)) continue;
    const Vec3d n = Vec3d{own.x * signs[0], own.y * signs[1], own.z * signs[2]};
    double cosine = dot(n, face);
    if (!smooth.empty()) cosine = std::max(cosine, dot(n, to_double(smooth[mesh.triangles[t][k]])));
    sum += cosine / length(n);
    ++count;
  }
  return count == 0 ? 1 : sum / count;
}

/// The connected parts of a mesh.
struct MeshParts {
  std::vector<SidePart> list;
  std::vector<std::uint32_t> of;  // Part of each triangle
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      opposed_pairs;  // Pairs of triangles with opposite orientation at a common edge
};

MeshParts parts_of(const Mesh& mesh) {
  const std::vector<Triangle> welded = welded_triangles(mesh);
  DisjointSets sets(welded.size());
  std::vector<std::uint8_t> open(welded.size(), 0);
  MeshParts parts;
  SideLists(welded, mesh.positions.size())
      .each_edge([&](std::uint32_t, std::span<const SideLists::Item> sides) {
        const std::uint32_t a = sides[0].index / 3, b = sides.back().index / 3;
        if (sides.size() == 2 && a != b) {
          if (SideLists::forward(sides[0]) != SideLists::forward(sides[1])) return sets.join(a, b);
          parts.opposed_pairs.push_back({a, b});
        }
        for (const SideLists::Item& side : sides) open[side.index / 3] = 1;
      });
  parts.of.resize(welded.size());
  for (std::uint32_t t = 0; t < welded.size(); ++t) {
    const std::uint32_t root = sets.find(t);  // Lowest triangle of the part
    if (root == t) {
      parts.of[t] = static_cast<std::uint32_t>(parts.list.size());
      parts.list.emplace_back().lowest_triangle = t;
    }
    SidePart& part = parts.list[parts.of[t] = parts.of[root]];
    part.open = part.open || open[t] != 0;
    ++part.triangles;
    const SideFace face = face_of(mesh, t);
    if (face.area == 0) continue;
    part.area += face.area;
    part.centre += face.centre * face.area;
    for (const std::uint32_t v : mesh.triangles[t]) part.box.add(to_double(mesh.positions[v]));
  }
  for (SidePart& part : parts.list) {
    if (part.has_area()) part.centre = part.centre * (1 / part.area);
  }
  for (std::uint32_t t = 0; t < welded.size(); ++t) {
    const SideFace face = face_of(mesh, t);
    if (face.area == 0) continue;
    SidePart& part = parts.list[parts.of[t]];
    const Vec3d offset = face.centre - part.centre;
    part.flux += face.area * dot(offset, face.normal);
    part.max_flux += face.area * length(offset);
  }
  return parts;
}

/// True if the mesh has no unusual normals, by a quick check.
bool has_usual_normals(const Mesh& mesh) {
  const std::size_t pieces = (mesh.triangles.size() + kTrianglesPerTask - 1) / kTrianglesPerTask;
  std::vector<std::pair<double, double>> sums(pieces);  // Area, and area times error, of each chunk
  std::atomic<bool> has_opposed{false};
  parallel_for(mesh.triangles.size(), kTrianglesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const SideFace face = face_of(mesh, t);
      if (face.area == 0) continue;
      const double cosine = mean_normal_cosine(mesh, {}, t, face.normal, kMirrorSigns[kUnchanged]);
      if (cosine < kMaxOpposedCosine) has_opposed = true;
      sums[begin / kTrianglesPerTask].first += face.area;
      sums[begin / kTrianglesPerTask].second += face.area * (1 - cosine);
    }
  });
  double area = 0, error_area = 0;
  for (const auto& [a, o] : sums) {
    area += a;
    error_area += o;
  }
  return !has_opposed && !(error_area > kMaxUsualError * area);
}

/// What is wrong with a part.
struct PartFault {
  std::size_t mirror = kUnchanged;  ///< The mirroring with which the normals fit the faces
  bool has_wrong_faces = false;     ///< True if the faces are wrong instead of the normals
  bool is_decided = false;
};

class FaultFinder {
 public:
  FaultFinder(const Mesh& mesh, MeshParts& parts, Trusted trust)
      : parts_(parts), is_trusted_(trust) {
    measure_errors(mesh);
    fault_of_part_.resize(parts.list.size());
    const bool imitates_other_shapes = open_parts_imitate_other_shapes();
    for (std::size_t p = 0; p < parts.list.size(); ++p) {
      if (!(parts.list[p].open && imitates_other_shapes))
        fault_of_part_[p].mirror = mirror_of(parts.list[p]);
    }
    find_faults();
  }
  const PartFault& fault_of(std::uint32_t triangle) const {
    return fault_of_part_[parts_.of[triangle]];
  }
  bool has_foreign_part(std::uint32_t triangle) const {
    const SidePart& part = parts_.list[parts_.of[triangle]];
    return fault_of(triangle).mirror == kUnchanged && part.triangles >= kMinMirrorTriangles &&
           2 * part.opposed_area > part.area;
  }

 private:
  void measure_errors(const Mesh& mesh) {
    const std::vector<Triangle> welded = welded_triangles(mesh);
    std::vector<Vec3> smooth = vertex_normals(mesh.positions, welded, mesh.polygons);
    const std::vector<std::uint32_t> welded_vertices = weld_vertices(mesh.positions);
    for (std::size_t v = 0; v < smooth.size(); ++v) smooth[v] = smooth[welded_vertices[v]];
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const SideFace face = face_of(mesh, t);
      if (face.area == 0) continue;
      SidePart& part = parts_.list[parts_.of[t]];
      for (std::size_t m = 0; m < kMirrorSigns.size(); ++m) {
        const double cosine = mean_normal_cosine(mesh, smooth, t, face.normal, kMirrorSigns[m]);
        part.mirror_errors[m] += face.area * (1 - cosine) / part.area;
        if (m == kUnchanged && cosine < kMaxOpposedCosine) part.opposed_area += face.area;
      }
    }
  }

  bool open_parts_imitate_other_shapes() const {
    double open = 0, foreign_area = 0;
    for (const SidePart& part : parts_.list) {
      if (!part.open) continue;
      open += part.area;
      const std::size_t mirrors =
          part.triangles < kMinMirrorTriangles ? kNegated + 1 : kMirrorSigns.size();
      if (*std::min_element(part.mirror_errors.begin(), part.mirror_errors.begin() + mirrors) >
          kMinForeignError) {
        foreign_area += part.area;
      }
    }
    return foreign_area > kMaxForeignShare * open;
  }

  static std::size_t mirror_of(const SidePart& part) {
    if (!part.has_area()) return kUnchanged;
    if (part.opposed_area >= kMinOpposedShare * part.area &&
        part.mirror_errors[kNegated] < kMaxNegatedError)
      return kNegated;
    if (part.open && part.triangles < kMinMirrorTriangles) return kUnchanged;
    const auto best = std::min_element(part.mirror_errors.begin(), part.mirror_errors.end());
    if (!(*best < kMaxMirrorError && kMinMirrorGain * *best < part.mirror_errors[kUnchanged]))
      return kUnchanged;
    // Several mirrorings may fit flat parts and rods equally well.
    const auto fits = [&](std::size_t m) { return part.mirror_errors[m] < *best + 1e-6; };
    if (fits(kUnchanged)) return kUnchanged;
    return fits(kNegated) ? kNegated : static_cast<std::size_t>(best - part.mirror_errors.begin());
  }

  void find_faults() {
    std::vector<std::uint32_t> faulty_parts, faulty_solids;
    for (std::uint32_t p = 0; p < fault_of_part_.size(); ++p) {
      if (fault_of_part_[p].mirror == kUnchanged) continue;
      faulty_parts.push_back(p);
      if (parts_.list[p].side() == 0) continue;
      fault_of_part_[p].is_decided = true;
      fault_of_part_[p].has_wrong_faces = parts_.list[p].side() < 0;
      faulty_solids.push_back(p);
    }
    // Parts are processed from the largest to the smallest. A part within another, such as the inner wall of a shell,
    // usually has the same fault as its container, and takes it over.
    const auto size = [&](std::uint32_t p) { return std::abs(parts_.list[p].flux); };
    std::stable_sort(faulty_solids.begin(), faulty_solids.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return size(a) > size(b); });
    constexpr std::size_t kMaxEnclosingParts =
        1000;  // Only the largest parts are tested as containers
    for (std::size_t i = 1; i < faulty_solids.size(); ++i) {
      for (std::size_t k = 0; k < std::min(i, kMaxEnclosingParts); ++k) {
        if (!parts_.list[faulty_solids[k]].box.contains(parts_.list[faulty_solids[i]].box))
          continue;
        fault_of_part_[faulty_solids[i]].has_wrong_faces =
            fault_of_part_[faulty_solids[k]].has_wrong_faces;
        break;
      }
    }
    double face_error_area = 0,
           // Total areas of the parts with wrong faces, and of those with wrong normals
        normal_error_area = 0;
    for (const std::uint32_t p : faulty_solids)
      (fault_of_part_[p].has_wrong_faces ? face_error_area : normal_error_area) +=
          parts_.list[p].area;
    // If the faces of a faulty part are opposed to those of a correct neighbour, its faces are wrong, and its normals
    // are right.
    for (const auto& [a, b] : parts_.opposed_pairs) {
      for (const auto& [own, other] :
           {std::pair(parts_.of[a], parts_.of[b]), std::pair(parts_.of[b], parts_.of[a])}) {
        if (fault_of_part_[own].mirror == kUnchanged || fault_of_part_[own].is_decided ||
            fault_of_part_[other].mirror != kUnchanged) {
          continue;
        }
        fault_of_part_[own].is_decided = fault_of_part_[own].has_wrong_faces = true;
      }
    }
    for (const std::uint32_t p : faulty_parts) {
      if (fault_of_part_[p].is_decided) continue;
      fault_of_part_[p].has_wrong_faces = face_error_area != normal_error_area
                                              ? face_error_area > normal_error_area
                                              : is_trusted_ == Trusted::normals;
      fault_of_part_[p].is_decided = face_error_area != normal_error_area;
    }
  }

  MeshParts& parts_;
  Trusted is_trusted_;
  std::vector<PartFault> fault_of_part_;
};

/// Replaces the normals of triangles by mirrored ones. Each new normal is stored once.
class MirroredNormals {
 public:
  explicit MirroredNormals(Mesh& mesh) : mesh_(mesh) {}
  void mirror(std::size_t t, const AxisSigns& signs, std::size_t which) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& n = mesh_.normal_triangles[t][k];
      const Vec3 own = mesh_.normals[n];
      if (!is_usable_normal(own)) continue;
      const auto [found, is_new] = changed_normals_.try_emplace(
          {n, which}, static_cast<std::uint32_t>(mesh_.normals.size()));
      if (is_new) {
        mesh_.normals.push_back({own.x * static_cast<float>(signs[0]),
                                 own.y * static_cast<float>(signs[1]),
                                 own.z * static_cast<float>(signs[2])});
      }
      n = found->second;
      // The sign is negated like the normal, so that the bitangent does not change
      if (!mesh_.tangents.empty()) mesh_.tangents[3 * t + k].sign *= -1;
    }
  }

 private:
  Mesh& mesh_;
  std::map<std::pair<std::uint32_t, std::size_t>, std::uint32_t> changed_normals_;
};

void reverse_triangle(Mesh& mesh, std::size_t t) {
  for (std::vector<Triangle>* corners :
       {&mesh.triangles, &mesh.uv_triangles, &mesh.normal_triangles}) {
    if (!corners->empty()) std::swap((*corners)[t][1], (*corners)[t][2]);
  }
  if (!mesh.tangents.empty()) std::swap(mesh.tangents[3 * t + 1], mesh.tangents[3 * t + 2]);
}

}  // namespace

AgreedNormals agree_normals(Mesh& mesh, Trusted trust) {
  validate(mesh);
  AgreedNormals result;
  if (mesh.normal_triangles.empty() || has_usual_normals(mesh)) return result;
  MeshParts parts = parts_of(mesh);
  const FaultFinder fault_finder(mesh, parts, trust);
  MirroredNormals mirrored_normals(mesh);
  std::optional<std::uint32_t> first_faulty;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const PartFault& fault = fault_finder.fault_of(t);
    const bool is_foreign = fault_finder.has_foreign_part(t);
    if (is_foreign) ++result.unexplained;
    if ((is_foreign || fault.mirror != kUnchanged) && !first_faulty) first_faulty = t;
    if (fault.mirror == kUnchanged) continue;
    AxisSigns signs = kMirrorSigns[fault.mirror];
    if (fault.has_wrong_faces) {
      for (double& sign : signs) sign = -sign;
    }
    const bool is_negated = std::equal(signs.begin(), signs.end(), kMirrorSigns[kNegated].begin());
    const bool is_unchanged =
        std::equal(signs.begin(), signs.end(), kMirrorSigns[kUnchanged].begin());
    if (!is_unchanged && !is_negated && !mesh.tangents.empty()) {
      throw Error(ErrorCode::input,
                  "Mesh '" + mesh.name +
                      "' has the normals of its mirror image, so its tangents cannot be trusted "
                      "either: export it again, or leave its tangents out.",
                  "mirrored-normals");
    }
    if (!is_unchanged)
      mirrored_normals.mirror(t, signs, 2 * fault.mirror + (fault.has_wrong_faces ? 1 : 0));
    if (fault.has_wrong_faces) reverse_triangle(mesh, t);
    ++(fault.has_wrong_faces ? result.faces : result.normals);
    result.mirrored += is_unchanged || is_negated ? 0 : 1;
    result.unclear += fault.is_decided ? 0 : 1;
  }
  result.first = first_faulty.value_or(0);
  return result;
}

namespace {

/// Quick check for parts that face inwards. Here, parts are connected over shared vertices.
bool may_face_inwards(const Mesh& mesh, std::span<const Triangle> triangles) {
  DisjointSets sets(mesh.positions.size());
  for (const Triangle& t : triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
  }
  struct FluxSums {
    Vec3d centre{};
    double area = 0, flux = 0, most = 0;
    void add_centre(const SideFace& face) {
      centre += face.centre * face.area;
      area += face.area;
    }
    void add_flux(const SideFace& face, const FluxSums& part) {
      const Vec3d offset = face.centre - part.centre * (1 / part.area);
      flux += face.area * dot(offset, face.normal);
      most += face.area * length(offset);
    }
    bool may_face_inwards() const { return flux < kMaxSuspectFlux * most; }
  };
  // Number of each part, indexed by one vertex of the part.
  std::vector<std::uint32_t> part_numbers(mesh.positions.size(), 0);
  std::vector<FluxSums> sums;
  for (const Triangle& t : triangles) {
    std::uint32_t& of = part_numbers[sets.find(t[0])];
    if (of != 0) continue;
    sums.emplace_back();
    of = static_cast<std::uint32_t>(sums.size());
  }
  if (sums.size() == 1) {  // All threads sum chunks of a single part
    std::vector<FluxSums> pieces((triangles.size() + kTrianglesPerTask - 1) / kTrianglesPerTask);
    const auto each = [&](const auto& add) {
      parallel_for(triangles.size(), kTrianglesPerTask, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
          if (const SideFace face = face_of(mesh, t); face.area != 0)
            add(pieces[begin / kTrianglesPerTask], face);
        }
      });
    };
    each([](FluxSums& piece, const SideFace& face) { piece.add_centre(face); });
    FluxSums total_sums;
    for (const FluxSums& piece : pieces) {
      total_sums.centre += piece.centre;
      total_sums.area += piece.area;
    }
    each([&](FluxSums& piece, const SideFace& face) { piece.add_flux(face, total_sums); });
    for (const FluxSums& piece : pieces) {
      total_sums.flux += piece.flux;
      total_sums.most += piece.most;
    }
    return total_sums.may_face_inwards();
  }
  const auto part = [&](std::size_t t) -> FluxSums& {
    return sums[part_numbers[sets.find(triangles[t][0])] - 1];
  };
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (const SideFace face = face_of(mesh, t); face.area != 0) part(t).add_centre(face);
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (const SideFace face = face_of(mesh, t); face.area != 0) part(t).add_flux(face, part(t));
  }
  return std::any_of(sums.begin(), sums.end(),
                     [](const FluxSums& of) { return of.may_face_inwards(); });
}

}  // namespace

InwardParts inward_parts(const Mesh& mesh) {
  validate(mesh);
  InwardParts result;
  const bool shares_vertices = mesh.positions.size() < mesh.triangles.size();
  if (!may_face_inwards(mesh, shares_vertices ? mesh.triangles : welded_triangles(mesh)))
    return result;
  const MeshParts parts = parts_of(mesh);
  std::vector<const SidePart*> inward, outward;
  for (const SidePart& part : parts.list) {
    if (!part.has_area() || part.side() == 0) continue;
    (part.side() < 0 ? inward : outward).push_back(&part);
  }
  result.parts = inward.size() + outward.size();
  constexpr std::size_t kMaxComparisons = 10'000'000;
  if (inward.size() * outward.size() > kMaxComparisons) return result;
  for (const SidePart* part : inward) {
    if (std::any_of(outward.begin(), outward.end(),
                    [&](const SidePart* other) { return other->box.contains(part->box); })) {
      continue;
    }
    if (result.count++ == 0)
      result.example = mesh.positions[mesh.triangles[part->lowest_triangle][0]];
  }
  return result;
}

}  // namespace kiln
