// Normals that oppose their faces, and parts that face inwards.
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
#include "mesh/normals.h"
#include "mesh/vector.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Signs of a mirror image's axes. The first leaves all as it is, the second turns all.
using Signs = std::array<double, 3>;
constexpr std::array<Signs, 8> kMirrors = {{{1, 1, 1},
                                            {-1, -1, -1},
                                            {-1, 1, 1},
                                            {1, -1, 1},
                                            {1, 1, -1},
                                            {-1, -1, 1},
                                            {-1, 1, -1},
                                            {1, -1, -1}}};
constexpr std::size_t kAsIs = 0, kTurned = 1;

/// True if a triangle's normals oppose it: the cosine between the two, of what fits best.
constexpr double kOpposed = -0.2;
/// Share of a part's area that must be opposed.
constexpr double kAll = 0.95;
/// A part's normals are off by 1 less the mean cosine. Turned, they may be off by as much.
constexpr double kFits = 0.1;
/// The same of mirror images, which fit by chance more easily: and so many times better than as they are.
constexpr double kMirrorFits = 0.02, kMirrorGain = 10;
/// Triangles of open parts that tell of a mirror image.
constexpr std::uint32_t kEnough = 16;
/// Mean error of ordinary normals: nothing is looked for below.
constexpr double kOrdinary = 0.02;
/// Normals of open parts that fit neither as they are nor turned are those of another shape, on purpose. Of so much
/// of the open area all open parts stay.
constexpr double kNeither = 0.15, kStyled = 0.2;
/// Flux of an open part, as a share of what it could be at most, that makes it nearly closed. A closed part has an
/// inside where it has more than rounding.
constexpr double kNearlyClosed = 0.3, kSomeVolume = 1e-3;
/// A quick look sees no more parts than those of less flux inwards.
constexpr double kPerhapsInward = -0.02;
constexpr std::size_t kGrain = std::size_t{1} << 15;

struct SidePart {
  double area = 0, opposed = 0;  // twice the area
  std::array<double, kMirrors.size()> off{};
  double flux = 0, most_flux = 0;
  Vec3d middle{};
  std::array<double, 3> low{}, high{};
  std::uint32_t first = 0, triangles = 0;
  bool open = false;

  bool is_used() const { return area > 0; }
  /// Share of the flux out of its middle that it could have: above 0 where it faces outwards.
  double outward() const { return most_flux > 0 ? flux / most_flux : 0; }
  /// 1: faces outwards; -1: inwards; 0: is a sheet, which has no inside.
  int side() const {
    const double least = open ? kNearlyClosed : kSomeVolume;
    return outward() > least ? 1 : outward() < -least ? -1 : 0;
  }
  bool holds(const SidePart& other) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(low[k] <= other.low[k] && high[k] >= other.high[k])) return false;
    }
    return true;
  }
};

struct SideFace {
  Vec3d normal, middle;  // unit, where it has an area
  double area = 0;       // twice
};

SideFace face_of(const Mesh& mesh, std::size_t t) {
  const Triangle& v = mesh.triangles[t];
  const Vec3d a(mesh.positions[v[0]]), b(mesh.positions[v[1]]), c(mesh.positions[v[2]]);
  SideFace face;
  face.normal = cross(b - a, c - a);
  const double size = length(face.normal);
  if (!(size > 0) || !std::isfinite(size)) return face;
  face.area = size;
  face.normal = face.normal * (1 / size);
  face.middle = (a + b + c) * (1.0 / 3);
  return face;
}

/// Cosines between a triangle's normals and what they may be like: the face, or the smooth surface.
double agreement(const Mesh& mesh, const std::vector<Vec3>& smooth, std::size_t t,
                 const Vec3d& face, const Signs& signs) {
  double sum = 0;
  int count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& own = mesh.normals[mesh.normal_triangles[t][k]];
    if (!is_usable_normal(own)) continue;
    const Vec3d n = Vec3d{own.x * signs[0], own.y * signs[1], own.z * signs[2]};
    double cosine = dot(n, face);
    if (!smooth.empty()) cosine = std::max(cosine, dot(n, Vec3d(smooth[mesh.triangles[t][k]])));
    sum += cosine / length(n);
    ++count;
  }
  return count == 0 ? 1 : sum / count;
}

/// MeshParts of a mesh, by numbers.
struct MeshParts {
  std::vector<SidePart> list;
  std::vector<std::uint32_t> of;  // of a triangle
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      against;  // triangles at an edge that face differently
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
          parts.against.push_back({a, b});
        }
        for (const SideLists::Item& side : sides) open[side.index / 3] = 1;
      });
  parts.of.resize(welded.size());
  for (std::uint32_t t = 0; t < welded.size(); ++t) {
    const std::uint32_t root = sets.find(t);  // the lowest of the part
    if (root == t) {
      parts.of[t] = static_cast<std::uint32_t>(parts.list.size());
      parts.list.emplace_back().first = t;
      parts.list.back().low.fill(std::numeric_limits<double>::infinity());
      parts.list.back().high.fill(-std::numeric_limits<double>::infinity());
    }
    SidePart& part = parts.list[parts.of[t] = parts.of[root]];
    part.open = part.open || open[t] != 0;
    ++part.triangles;
    const SideFace face = face_of(mesh, t);
    if (face.area == 0) continue;
    part.area += face.area;
    part.middle += face.middle * face.area;
    for (const std::uint32_t v : mesh.triangles[t]) {
      const Vec3& p = mesh.positions[v];
      const double xyz[3] = {p.x, p.y, p.z};
      for (std::size_t k = 0; k < 3; ++k) {
        part.low[k] = std::min(part.low[k], xyz[k]);
        part.high[k] = std::max(part.high[k], xyz[k]);
      }
    }
  }
  for (SidePart& part : parts.list) {
    if (part.is_used()) part.middle = part.middle * (1 / part.area);
  }
  for (std::uint32_t t = 0; t < welded.size(); ++t) {
    const SideFace face = face_of(mesh, t);
    if (face.area == 0) continue;
    SidePart& part = parts.list[parts.of[t]];
    const Vec3d way = face.middle - part.middle;
    part.flux += face.area * dot(way, face.normal);
    part.most_flux += face.area * length(way);
  }
  return parts;
}

/// True if a quick look finds normals that ordinary meshes do not have.
bool is_ordinary(const Mesh& mesh) {
  const std::size_t pieces = (mesh.triangles.size() + kGrain - 1) / kGrain;
  std::vector<std::pair<double, double>> sums(pieces);  // area, and the same times how far off
  std::atomic<bool> opposed{false};
  parallel_for(mesh.triangles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const SideFace face = face_of(mesh, t);
      if (face.area == 0) continue;
      const double cosine = agreement(mesh, {}, t, face.normal, kMirrors[kAsIs]);
      if (cosine < kOpposed) opposed = true;
      sums[begin / kGrain].first += face.area;
      sums[begin / kGrain].second += face.area * (1 - cosine);
    }
  });
  double area = 0, off = 0;
  for (const auto& [a, o] : sums) {
    area += a;
    off += o;
  }
  return !opposed && !(off > kOrdinary * area);
}

/// Fault of a part's normals.
struct Fault {
  std::size_t mirror = kAsIs;  ///< The mirroring that makes them fit the faces
  bool faces = false;          ///< The faces are wrong
  bool decided = false;
};

class Judge {
 public:
  Judge(const Mesh& mesh, MeshParts& parts, Trusted trust) : parts_(parts), trust_(trust) {
    measure(mesh);
    faults_.resize(parts.list.size());
    const bool styled = is_styled();
    for (std::size_t p = 0; p < parts.list.size(); ++p) {
      if (!(parts.list[p].open && styled)) faults_[p].mirror = mirror_of(parts.list[p]);
    }
    decide();
  }
  const Fault& fault(std::uint32_t triangle) const { return faults_[parts_.of[triangle]]; }
  bool is_strange(std::uint32_t triangle) const {
    const SidePart& part = parts_.list[parts_.of[triangle]];
    return fault(triangle).mirror == kAsIs && part.triangles >= kEnough &&
           2 * part.opposed > part.area;
  }

 private:
  void measure(const Mesh& mesh) {
    const std::vector<Triangle> welded = welded_triangles(mesh);
    std::vector<Vec3> smooth = vertex_normals(mesh.positions, welded, mesh.polygons);
    const std::vector<std::uint32_t> first = weld_vertices(mesh.positions);
    for (std::size_t v = 0; v < smooth.size(); ++v) smooth[v] = smooth[first[v]];
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const SideFace face = face_of(mesh, t);
      if (face.area == 0) continue;
      SidePart& part = parts_.list[parts_.of[t]];
      for (std::size_t m = 0; m < kMirrors.size(); ++m) {
        const double cosine = agreement(mesh, smooth, t, face.normal, kMirrors[m]);
        part.off[m] += face.area * (1 - cosine) / part.area;
        if (m == kAsIs && cosine < kOpposed) part.opposed += face.area;
      }
    }
  }

  bool is_styled() const {
    double open = 0, neither = 0;
    for (const SidePart& part : parts_.list) {
      if (!part.open) continue;
      open += part.area;
      const std::size_t mirrors = part.triangles < kEnough ? kTurned + 1 : kMirrors.size();
      if (*std::min_element(part.off.begin(), part.off.begin() + mirrors) > kNeither) {
        neither += part.area;
      }
    }
    return neither > kStyled * open;
  }

  static std::size_t mirror_of(const SidePart& part) {
    if (!part.is_used()) return kAsIs;
    if (part.opposed >= kAll * part.area && part.off[kTurned] < kFits) return kTurned;
    if (part.open && part.triangles < kEnough) return kAsIs;
    const auto best = std::min_element(part.off.begin(), part.off.end());
    if (!(*best < kMirrorFits && kMirrorGain * *best < part.off[kAsIs])) return kAsIs;
    // A flat part, or a rod, fits several.
    const auto fits = [&](std::size_t m) { return part.off[m] < *best + 1e-6; };
    if (fits(kAsIs)) return kAsIs;
    return fits(kTurned) ? kTurned : static_cast<std::size_t>(best - part.off.begin());
  }

  void decide() {
    std::vector<std::uint32_t> faulty, solid;
    for (std::uint32_t p = 0; p < faults_.size(); ++p) {
      if (faults_[p].mirror == kAsIs) continue;
      faulty.push_back(p);
      if (parts_.list[p].side() == 0) continue;
      faults_[p].decided = true;
      faults_[p].faces = parts_.list[p].side() < 0;
      solid.push_back(p);
    }
    // From the largest on: what lies in another part, as the inner side of a shell, has its fault.
    const auto size = [&](std::uint32_t p) { return std::abs(parts_.list[p].flux); };
    std::stable_sort(solid.begin(), solid.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return size(a) > size(b); });
    constexpr std::size_t kMostHolders = 1000;  // of very many parts the largest
    for (std::size_t i = 1; i < solid.size(); ++i) {
      for (std::size_t k = 0; k < std::min(i, kMostHolders); ++k) {
        if (!parts_.list[solid[k]].holds(parts_.list[solid[i]])) continue;
        faults_[solid[i]].faces = faults_[solid[k]].faces;
        break;
      }
    }
    double faces = 0, normals = 0;  // areas
    for (const std::uint32_t p : solid) (faults_[p].faces ? faces : normals) += parts_.list[p].area;
    // Who faces against a sound neighbour is turned round.
    for (const auto& [a, b] : parts_.against) {
      for (const auto& [own, other] :
           {std::pair(parts_.of[a], parts_.of[b]), std::pair(parts_.of[b], parts_.of[a])}) {
        if (faults_[own].mirror == kAsIs || faults_[own].decided ||
            faults_[other].mirror != kAsIs) {
          continue;
        }
        faults_[own].decided = faults_[own].faces = true;
      }
    }
    for (const std::uint32_t p : faulty) {
      if (faults_[p].decided) continue;
      faults_[p].faces = faces != normals ? faces > normals : trust_ == Trusted::normals;
      faults_[p].decided = faces != normals;
    }
  }

  MeshParts& parts_;
  Trusted trust_;
  std::vector<Fault> faults_;
};

/// Gives triangles other normals, each made once.
class OtherNormals {
 public:
  explicit OtherNormals(Mesh& mesh) : mesh_(mesh) {}
  void give(std::size_t t, const Signs& signs, std::size_t which) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& n = mesh_.normal_triangles[t][k];
      const Vec3 own = mesh_.normals[n];
      if (!is_usable_normal(own)) continue;
      const auto [found, is_new] =
          other_.try_emplace({n, which}, static_cast<std::uint32_t>(mesh_.normals.size()));
      if (is_new) {
        mesh_.normals.push_back({own.x * static_cast<float>(signs[0]),
                                 own.y * static_cast<float>(signs[1]),
                                 own.z * static_cast<float>(signs[2])});
      }
      n = found->second;
      if (!mesh_.tangents.empty()) mesh_.tangents[3 * t + k].sign *= -1;  // The same bitangent.
    }
  }

 private:
  Mesh& mesh_;
  std::map<std::pair<std::uint32_t, std::size_t>, std::uint32_t> other_;
};

void turn_round(Mesh& mesh, std::size_t t) {
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
  if (mesh.normal_triangles.empty() || is_ordinary(mesh)) return result;
  MeshParts parts = parts_of(mesh);
  const Judge judge(mesh, parts, trust);
  OtherNormals other(mesh);
  std::optional<std::uint32_t> first;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Fault& fault = judge.fault(t);
    const bool strange = judge.is_strange(t);
    if (strange) ++result.strange;
    if ((strange || fault.mirror != kAsIs) && !first) first = t;
    if (fault.mirror == kAsIs) continue;
    Signs signs = kMirrors[fault.mirror];
    if (fault.faces) {
      for (double& sign : signs) sign = -sign;
    }
    const bool turned = std::equal(signs.begin(), signs.end(), kMirrors[kTurned].begin());
    const bool as_is = std::equal(signs.begin(), signs.end(), kMirrors[kAsIs].begin());
    if (!as_is && !turned && !mesh.tangents.empty()) {
      throw Error(ErrorCode::input,
                  "Mesh '" + mesh.name +
                      "' has normals of its mirror image, and tangents, so that neither can be "
                      "trusted: export it again, or leave its tangents out.",
                  "mirrored-normals");
    }
    if (!as_is) other.give(t, signs, 2 * fault.mirror + (fault.faces ? 1 : 0));
    if (fault.faces) turn_round(mesh, t);
    ++(fault.faces ? result.faces : result.normals);
    result.mirrored += as_is || turned ? 0 : 1;
    result.unclear += fault.decided ? 0 : 1;
  }
  result.first = first.value_or(0);
  return result;
}

namespace {

/// A quick look, by shared vertices alone.
bool may_face_inwards(const Mesh& mesh, std::span<const Triangle> triangles) {
  DisjointSets sets(mesh.positions.size());
  for (const Triangle& t : triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
  }
  struct Sums {
    Vec3d middle{};
    double area = 0, flux = 0, most = 0;
    void add_middle(const SideFace& face) {
      middle += face.middle * face.area;
      area += face.area;
    }
    void add_flux(const SideFace& face, const Sums& part) {
      const Vec3d way = face.middle - part.middle * (1 / part.area);
      flux += face.area * dot(way, face.normal);
      most += face.area * length(way);
    }
    bool may_face_inwards() const { return flux < kPerhapsInward * most; }
  };
  // Numbers of parts, by the vertex that stands for one.
  std::vector<std::uint32_t> number(mesh.positions.size(), 0);
  std::vector<Sums> sums;
  for (const Triangle& t : triangles) {
    std::uint32_t& of = number[sets.find(t[0])];
    if (of != 0) continue;
    sums.emplace_back();
    of = static_cast<std::uint32_t>(sums.size());
  }
  if (sums.size() == 1) {  // All threads sum up pieces.
    std::vector<Sums> pieces((triangles.size() + kGrain - 1) / kGrain);
    const auto each = [&](const auto& add) {
      parallel_for(triangles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
          if (const SideFace face = face_of(mesh, t); face.area != 0)
            add(pieces[begin / kGrain], face);
        }
      });
    };
    each([](Sums& piece, const SideFace& face) { piece.add_middle(face); });
    Sums whole;
    for (const Sums& piece : pieces) {
      whole.middle += piece.middle;
      whole.area += piece.area;
    }
    each([&](Sums& piece, const SideFace& face) { piece.add_flux(face, whole); });
    for (const Sums& piece : pieces) {
      whole.flux += piece.flux;
      whole.most += piece.most;
    }
    return whole.may_face_inwards();
  }
  const auto part = [&](std::size_t t) -> Sums& {
    return sums[number[sets.find(triangles[t][0])] - 1];
  };
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (const SideFace face = face_of(mesh, t); face.area != 0) part(t).add_middle(face);
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (const SideFace face = face_of(mesh, t); face.area != 0) part(t).add_flux(face, part(t));
  }
  return std::any_of(sums.begin(), sums.end(),
                     [](const Sums& of) { return of.may_face_inwards(); });
}

}  // namespace

InwardParts inward_parts(const Mesh& mesh) {
  validate(mesh);
  InwardParts result;
  const bool shared = mesh.positions.size() < mesh.triangles.size();
  if (!may_face_inwards(mesh, shared ? mesh.triangles : welded_triangles(mesh))) return result;
  const MeshParts parts = parts_of(mesh);
  std::vector<const SidePart*> inward, outward;
  for (const SidePart& part : parts.list) {
    if (!part.is_used() || part.side() == 0) continue;
    (part.side() < 0 ? inward : outward).push_back(&part);
  }
  result.parts = inward.size() + outward.size();
  constexpr std::size_t kMostComparisons = 10'000'000;
  if (inward.size() * outward.size() > kMostComparisons) return result;
  for (const SidePart* part : inward) {
    if (std::any_of(outward.begin(), outward.end(),
                    [&](const SidePart* other) { return other->holds(*part); })) {
      continue;
    }
    if (result.count++ == 0) result.example = mesh.positions[mesh.triangles[part->first][0]];
  }
  return result;
}

}  // namespace kiln
