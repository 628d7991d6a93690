#include "mesh/cage.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "base/disjoint_sets.h"
#include "base/lower_case.h"
#include "kiln/validate.h"
#include "mesh/box.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

constexpr const char* kInnerShellName = "inner";
constexpr std::uint32_t kNoPartner = 0xFFFFFFFFU;
// Maximum number of triangles in a polygon that the cage may triangulate differently than the low poly.
constexpr std::size_t kMaxPolygonTriangles = 64;
// A vertex of the low poly lies far from its partner in the cage if its distance to the partner is this many times that
// to the nearest vertex of the cage.
constexpr double kFarRatio = 4;
// Shares of far vertices: above kMinFarShare, the pairing in the order of faces is doubted and pairing by distance is
// tried; above kMaxFarShare, a pairing is rejected.
constexpr double kMinFarShare = 1.0 / 16, kMaxFarShare = 1.0 / 2;
constexpr std::size_t kSampledCorners = 256;

/// The triangles of one object or group, in their order.
struct Piece {
  std::string name;
  std::vector<std::uint32_t> triangles;
  Box<Vec3d> box;  ///< Bounding box of the finite corners
};

void find_boxes(const Mesh& mesh, std::span<const Vec3> positions, std::vector<Piece>& pieces) {
  for (Piece& piece : pieces) {
    piece.box = {};
    for (const std::uint32_t t : piece.triangles) {
      for (const std::uint32_t vertex : mesh.triangles[t]) {
        const Vec3& p = positions[vertex];
        if (is_finite(p)) piece.box.add(to_double(p));
      }
    }
  }
}

/// Splits triangles [first, first + count) by object or group. If the mesh has no names, there is a single unnamed
/// piece.
std::vector<Piece> pieces_of(const Mesh& mesh, std::span<const Vec3> positions, bool objects,
                             std::size_t first, std::size_t count) {
  const std::vector<std::uint32_t>& of = objects ? mesh.objects : mesh.groups;
  const std::vector<std::string>& names = objects ? mesh.object_names : mesh.group_names;
  std::vector<Piece> pieces(of.empty() ? 1 : names.size());
  for (std::size_t i = 0; i < names.size() && !of.empty(); ++i) pieces[i].name = names[i];
  for (std::size_t t = first; t < first + count; ++t) {
    pieces[of.empty() ? 0 : of[t]].triangles.push_back(static_cast<std::uint32_t>(t));
  }
  std::erase_if(pieces, [](const Piece& piece) { return piece.triangles.empty(); });
  find_boxes(mesh, positions, pieces);
  return pieces;
}

/// Splits triangles [first, first + count) into components that are connected over equal positions, in the order of
/// their first triangles.
std::vector<Piece> parts_of(const Mesh& mesh, std::span<const Vec3> positions, std::size_t first,
                            std::size_t count) {
  const std::vector<std::uint32_t> welded_vertex = weld_vertices(positions);
  DisjointSets sets(mesh.positions.size());
  for (std::size_t t = first; t < first + count; ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    sets.join(welded_vertex[a], welded_vertex[b]);
    sets.join(welded_vertex[a], welded_vertex[c]);
  }
  std::unordered_map<std::uint32_t, std::size_t> piece_of_component;
  std::vector<Piece> pieces;
  for (std::size_t t = first; t < first + count; ++t) {
    const std::size_t place =
        piece_of_component.emplace(sets.find(welded_vertex[mesh.triangles[t][0]]), pieces.size())
            .first->second;
    if (place == pieces.size()) pieces.push_back({mesh.name, {}, {}});
    pieces[place].triangles.push_back(static_cast<std::uint32_t>(t));
  }
  find_boxes(mesh, positions, pieces);
  return pieces;
}

/// The name in lower case, without suffixes such as _low, _cage and .001.
std::string bare_name_of(std::string name) {
  name = lower_case(name);
  for (bool retry = true; retry;) {
    retry = false;
    for (const char* ending : {"_low", "_lp", "_lo", "_lowpoly", "_cage"}) {
      if (!name.ends_with(ending) || name == ending) continue;
      name.resize(name.size() - std::strlen(ending));
      retry = true;
    }
  }
  return name;
}

/// For each piece of the low poly, the piece of the cage with the same name (compared by bare_name_of() if `bare`), or
/// kNoPartner. Empty if names are not unique.
std::vector<std::uint32_t> pair_by_names(const std::vector<Piece>& low,
                                         const std::vector<Piece>& cage, bool bare) {
  const auto name = [&](const Piece& piece) {
    return bare ? bare_name_of(piece.name) : piece.name;
  };
  std::map<std::string, std::uint32_t> cage_piece_of_name;
  for (std::uint32_t i = 0; i < cage.size(); ++i) {
    if (!cage_piece_of_name.emplace(name(cage[i]), i).second) return {};
  }
  std::vector<std::uint32_t> piece_partners;
  std::set<std::string> paired_names;
  for (const Piece& piece : low) {
    if (!paired_names.insert(name(piece)).second) return {};
    const auto found = cage_piece_of_name.find(name(piece));
    piece_partners.push_back(found == cage_piece_of_name.end() ? kNoPartner : found->second);
  }
  return piece_partners;
}

/// Pairs pieces that have equal numbers of triangles by the distance of their bounding boxes. Empty if one piece is the
/// nearest of two.
std::vector<std::uint32_t> pair_by_distance(const std::vector<Piece>& low,
                                            const std::vector<Piece>& cage) {
  std::vector<std::uint32_t> piece_partners;
  std::vector<bool> is_piece_taken(cage.size());
  for (const Piece& piece : low) {
    std::uint32_t nearest_piece = kNoPartner;
    double smallest_gap = 0;
    for (std::uint32_t i = 0; i < cage.size(); ++i) {
      if (cage[i].triangles.size() != piece.triangles.size()) continue;
      const double gap =
          length(cage[i].box.low - piece.box.low) + length(cage[i].box.high - piece.box.high);
      if (nearest_piece == kNoPartner || gap < smallest_gap)
        std::tie(nearest_piece, smallest_gap) = std::pair(i, gap);
    }
    if (nearest_piece == kNoPartner || is_piece_taken[nearest_piece]) return {};
    is_piece_taken[nearest_piece] = true;
    piece_partners.push_back(nearest_piece);
  }
  return piece_partners;
}

/// Share of vertices that lie far from their partners (see kFarRatio).
/// \param corners  cage positions of the corners of the low poly's triangles, in order; a subset is tested
double far_share(const Mesh& low, std::span<const Vec3> low_positions,
                 std::span<const Vec3> corners) {
  std::size_t count = 0, farther = 0;
  const std::size_t step = 1 + corners.size() / kSampledCorners;
  for (std::size_t i = 0; i < corners.size(); i += step) {
    if (!is_finite(corners[i])) continue;
    const auto distance_to_cage = [&](std::uint32_t vertex) {
      return length(to_double(corners[i]) - to_double(low_positions[vertex]));
    };
    const double own_distance = distance_to_cage(low.triangles[i / 3][i % 3]);
    double nearest_distance = own_distance;
    for (const Triangle& t : low.triangles) {
      for (const std::uint32_t vertex : t)
        nearest_distance = std::min(nearest_distance, distance_to_cage(vertex));
    }
    ++count;
    farther += own_distance > kFarRatio * nearest_distance ? 1 : 0;
  }
  return count == 0 ? 0 : static_cast<double>(farther) / static_cast<double>(count);
}

bool has_all_partners(const std::vector<std::uint32_t>& piece_partners) {
  return !piece_partners.empty() && std::find(piece_partners.begin(), piece_partners.end(),
                                              kNoPartner) == piece_partners.end();
}

/// Maps vertices of the low poly to vertices of the cage, piece by piece.
class VertexPartners {
 public:
  VertexPartners(const Mesh& low, const Mesh& cage, std::span<const Vec3> positions)
      : low_(low), cage_(cage), positions_(positions), corners_(3 * low.triangles.size()) {}

  /// \returns true if the two pieces correspond: by the order of their triangles, or else by the order of their
  /// vertices
  bool pair(const Piece& low, const Piece& cage) {
    return match_in_order(low, cage) || pair_by_rank(low, cage);
  }

  /// For each triangle of the low poly, three corners of the cage. Empty if a vertex of the low poly would have two
  /// positions in the cage.
  std::vector<Vec3> corners() const {
    std::vector<std::uint32_t> cage_vertex_of(low_.positions.size(), kNoPartner);
    std::vector<Vec3> result;
    result.reserve(corners_.size());
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      std::uint32_t& known = cage_vertex_of[low_.triangles[i / 3][i % 3]];
      if (known == kNoPartner) known = corners_[i];
      if (differ_in_position(known, corners_[i])) return {};
      result.push_back(positions_[corners_[i]]);
    }
    return result;
  }

 private:
  bool differ_in_position(std::uint32_t a, std::uint32_t b) const {
    return a != b && positions_[a] != positions_[b] && is_finite(positions_[a]) &&
           is_finite(positions_[b]);
  }

  bool match_in_order(const Piece& low, const Piece& cage) {
    std::unordered_map<std::uint32_t, std::uint32_t> cage_vertex_of;
    for (std::size_t i = 0; i < low.triangles.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t cage_vertex = cage_.triangles[cage.triangles[i]][k];
        const auto known =
            cage_vertex_of.emplace(low_.triangles[low.triangles[i]][k], cage_vertex).first->second;
        if (differ_in_position(known, cage_vertex)) return false;
        corners_[3 * std::size_t{low.triangles[i]} + k] = cage_vertex;
      }
    }
    return true;
  }

  static std::vector<std::uint32_t> vertices(const Mesh& mesh, const Piece& piece) {
    std::vector<std::uint32_t> sorted_vertices;
    for (const std::uint32_t t : piece.triangles) {
      sorted_vertices.insert(sorted_vertices.end(), mesh.triangles[t].begin(),
                             mesh.triangles[t].end());
    }
    std::sort(sorted_vertices.begin(), sorted_vertices.end());
    sorted_vertices.erase(std::unique(sorted_vertices.begin(), sorted_vertices.end()),
                          sorted_vertices.end());
    return sorted_vertices;
  }

  /// Pairs the vertices of two pieces by rank: the n-th lowest vertex index of one with the n-th lowest of the other.
  /// Polygons may be triangulated differently.
  bool pair_by_rank(const Piece& low, const Piece& cage) {
    const std::vector<std::uint32_t> sorted_low_vertices = vertices(low_, low),
                                     sorted_cage_vertices = vertices(cage_, cage);
    if (sorted_low_vertices.size() != sorted_cage_vertices.size()) return false;
    const auto partner_of_vertex = [&](std::uint32_t vertex) {
      return sorted_cage_vertices[static_cast<std::size_t>(
          std::lower_bound(sorted_low_vertices.begin(), sorted_low_vertices.end(), vertex) -
          sorted_low_vertices.begin())];
    };
    // The vertices of the triangles that were read since both meshes last ended a polygon at the same triangle
    std::multiset<std::uint32_t> low_vertices, cage_vertices;
    std::size_t triangles_since_match = 0;
    for (std::size_t i = 0; i < low.triangles.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t cage_vertex = partner_of_vertex(low_.triangles[low.triangles[i]][k]);
        corners_[3 * std::size_t{low.triangles[i]} + k] = cage_vertex;
        low_vertices.insert(cage_vertex);
        cage_vertices.insert(cage_.triangles[cage.triangles[i]][k]);
      }
      ++triangles_since_match;
      if (std::set(low_vertices.begin(), low_vertices.end()) ==
          std::set(cage_vertices.begin(), cage_vertices.end())) {
        low_vertices.clear();
        cage_vertices.clear();
        triangles_since_match = 0;
      } else if (triangles_since_match > kMaxPolygonTriangles) {
        return false;
      }
    }
    return triangles_since_match == 0;
  }

  const Mesh& low_;
  const Mesh& cage_;
  std::span<const Vec3> positions_;
  std::vector<std::uint32_t> corners_;
};

std::string in_quotes(const std::string& name) { return "'" + name + "'"; }

/// For each triangle of the low poly, three corners of the cage, from the cage's triangles beginning with `first`.
/// Empty if the meshes do not correspond.
/// \param mismatch  [out] why the meshes do not correspond, if they nearly do
std::vector<Vec3> corners_of(const Mesh& low, std::span<const Vec3> low_positions, const Mesh& cage,
                             std::span<const Vec3> positions, std::size_t first, bool named,
                             std::string& mismatch) {
  const std::size_t count = std::min(low.triangles.size(), cage.triangles.size() - first);
  const auto has = [&](const std::vector<std::uint32_t>& of, const Mesh& mesh) {
    return of.size() == mesh.triangles.size();
  };
  const bool objects = has(low.objects, low) && has(cage.objects, cage);
  const bool groups = has(low.groups, low) && has(cage.groups, cage);
  std::vector<Piece> low_pieces, cage_pieces;
  if (named && (objects || groups)) {
    low_pieces = pieces_of(low, low_positions, objects, 0, low.triangles.size());
    cage_pieces = pieces_of(cage, positions, objects, first, count);
  }
  std::vector<std::uint32_t> piece_partners = pair_by_names(low_pieces, cage_pieces, false);
  if (!has_all_partners(piece_partners))
    piece_partners = pair_by_names(low_pieces, cage_pieces, true);
  if (!has_all_partners(piece_partners) && low_pieces.size() == cage_pieces.size()) {
    if (auto near = pair_by_distance(low_pieces, cage_pieces); has_all_partners(near))
      piece_partners = std::move(near);
  }
  const bool any_partner = std::any_of(piece_partners.begin(), piece_partners.end(),
                                       [](auto pair) { return pair != kNoPartner; });
  for (std::size_t i = 0; i < piece_partners.size() && any_partner && low_pieces.size() > 1; ++i) {
    if (piece_partners[i] == kNoPartner) {
      mismatch =
          "none of its parts has the name of the low poly's " + in_quotes(low_pieces[i].name);
    } else if (cage_pieces[piece_partners[i]].triangles.size() != low_pieces[i].triangles.size()) {
      mismatch = "its " + in_quotes(cage_pieces[piece_partners[i]].name) + " has " +
                 std::to_string(cage_pieces[piece_partners[i]].triangles.size()) +
                 " triangles, and the low poly's " + in_quotes(low_pieces[i].name) + " has " +
                 std::to_string(low_pieces[i].triangles.size());
    }
    if (!mismatch.empty()) return {};
  }
  if (cage.triangles.size() - first < low.triangles.size() ||
      (named && cage.triangles.size() != low.triangles.size())) {
    return {};
  }
  const bool by_piece = has_all_partners(piece_partners) && low_pieces.size() == cage_pieces.size();
  if (!by_piece) {
    const auto whole_mesh = [](const Mesh& mesh, std::size_t from, std::size_t triangles) {
      Piece piece;
      for (std::size_t t = 0; t < triangles; ++t) {
        piece.triangles.push_back(static_cast<std::uint32_t>(from + t));
      }
      piece.name = mesh.name;
      return std::vector<Piece>{std::move(piece)};
    };
    low_pieces = whole_mesh(low, 0, low.triangles.size());
    cage_pieces = whole_mesh(cage, first, low.triangles.size());
    piece_partners = {0};
  }
  const auto pair_all = [&] {
    VertexPartners partners(low, cage, positions);
    for (std::size_t i = 0; i < low_pieces.size(); ++i) {
      if (partners.pair(low_pieces[i], cage_pieces[piece_partners[i]])) continue;
      mismatch = "the faces of its " + in_quotes(cage_pieces[piece_partners[i]].name) +
                 " do not use the same vertices in the same order as those of the low poly's " +
                 in_quotes(low_pieces[i].name);
      return std::vector<Vec3>{};
    }
    std::vector<Vec3> corners = partners.corners();
    if (corners.empty())
      mismatch = "some vertices of the low poly would have two positions in the cage";
    return corners;
  };
  std::vector<Vec3> corners = pair_all();
  if (by_piece || !named) return corners;
  const auto far_share_of_corners = [&] {
    return corners.empty() ? 1 : far_share(low, low_positions, corners);
  };
  const double far_in_order = far_share_of_corners();
  if (far_in_order <= kMinFarShare) return corners;
  // Without names, the components of the cage may be in a different order than those of the low poly.
  const std::vector<Vec3> corners_in_order = corners;
  const std::string mismatch_text =
      corners.empty()
          ? mismatch
          : "with faces paired in order, its vertices lie far from those of the low poly";
  mismatch.clear();
  low_pieces = parts_of(low, low_positions, 0, low.triangles.size());
  cage_pieces = parts_of(cage, positions, first, low.triangles.size());
  piece_partners = low_pieces.size() == cage_pieces.size()
                       ? pair_by_distance(low_pieces, cage_pieces)
                       : std::vector<std::uint32_t>{};
  corners = has_all_partners(piece_partners) ? pair_all() : std::vector<Vec3>{};
  if (const double found = far_share_of_corners(); found < far_in_order && found <= kMaxFarShare)
    return corners;
  mismatch = far_in_order <= kMaxFarShare ? "" : mismatch_text;
  return far_in_order <= kMaxFarShare ? corners_in_order : std::vector<Vec3>{};
}

bool has_inner_shell_first(const Mesh& cage) {
  return !cage.groups.empty() && cage.groups.front() < cage.group_names.size() &&
         cage.group_names[cage.groups.front()] == kInnerShellName;
}

}  // namespace

CageCorners read_cage(const Mesh& low, const Mesh& cage, const Frame& frame) {
  validate(cage);
  const std::vector<Vec3> positions = frame.to_frame(cage);
  const std::size_t count = low.triangles.size();
  const std::vector<Vec3> low_positions = frame.to_frame(low);
  CageCorners result;
  std::string mismatch;
  if (cage.triangles.size() != 2 * count) {
    result.outer_corners = corners_of(low, low_positions, cage, positions, 0, true, mismatch);
    if (!result.outer_corners.empty()) return result;
  } else {
    result.kind = CageKind::shells;
    const auto shell = [&](std::size_t first) {
      return corners_of(low, low_positions, cage, positions, first, false, mismatch);
    };
    const bool inner_first = has_inner_shell_first(cage);
    result.outer_corners = shell(inner_first ? count : 0);
    result.inner_corners = shell(inner_first ? 0 : count);
    if (!result.outer_corners.empty() && !result.inner_corners.empty()) return result;
  }
  auto hull = std::make_shared<CageHull>();
  hull->name = cage.name;
  hull->low_triangles = count;
  hull->mismatch = mismatch;
  for (const Triangle& t : cage.triangles) {
    if (!is_finite(positions[t[0]]) || !is_finite(positions[t[1]]) || !is_finite(positions[t[2]])) {
      continue;
    }
    hull->triangles.push_back(t);
  }
  hull->positions = positions;
  CageCorners hull_corners;
  hull_corners.kind = CageKind::hull;
  hull_corners.hull = std::move(hull);
  return hull_corners;
}

}  // namespace kiln
