#include "simplify/presimplify.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <numeric>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "mesh/fans.h"
#include "mesh/vertex_lists.h"
#include "simplify/heightfield_constraint.h"
#include "simplify/label_seams.h"
#include "simplify/mesh_pieces.h"
#include "simplify/small_components.h"

namespace kiln {
namespace {

/// Factor by which the heights of height fields are scaled. It makes surface normals nearly vertical; meshoptimizer
/// prevents flips relative to these normals.
constexpr double kHeightScale = 0.1;
/// How strongly meshes other than height fields are bent before simplification. On flat surfaces, meshoptimizer's
/// collapses cost nothing, which would leave long slivers and folds that hinder all later collapses.
constexpr float kBendStrength = 0.05F;
/// Minimum number of triangles in a piece. Meshes are halved repeatedly, as long as no piece becomes smaller.
constexpr std::size_t kMinPresimplifyPiece = 125'000;
/// Pieces keep their borders. If the result has more than kMaxGoalExcess times the requested triangles, as for meshes
/// of many small components, the whole mesh is simplified further.
constexpr double kMaxGoalExcess = 1.25;
/// Largest share of the goal that triangles along borders of pieces may take. A larger share would leave few triangles
/// between the borders: an urn of 4.5 million triangles, reduced to 50,000, would have kept 57,000 along borders and
/// lost its relief. Above this share, pieces keep correspondingly more triangles, and the whole mesh is simplified
/// further.
constexpr double kMaxBorderShare = 0.75;
/// Maximum number of triangles in a small component.
constexpr std::size_t kMaxSmallComponent = 64;
/// Limit of the sum of squared valences, divided by the number of triangles. meshoptimizer takes 0.2 ns times the sum
/// of squared valences, EdgeCollapser 10 us per triangle. Above this limit, meshoptimizer is slower.
constexpr double kMaxMeanSquaredValence = 50'000;
/// If the cosine between the normals of two neighbours is below this, one of them may be folded.
constexpr double kMaxFoldCosine = 0;

struct PositionsAndTriangles {
  const std::vector<Vec3>& positions;
  const std::vector<Triangle>& triangles;
};

/// Bends the mesh slightly, so that hardly any surface remains flat.
void bend(std::vector<Vec3>& positions) {
  const auto along = [](float a, float b) {
    return kBendStrength * (a * a + 0.6F * b * b + 0.5F * a * b);
  };
  for (Vec3& p : positions) {
    p = {p.x + along(p.y, p.z), p.y + along(p.z, p.x), p.z + along(p.x, p.y)};
  }
}

float scale_of(const std::vector<Vec3>& positions) {
  return meshopt_simplifyScale(&positions.data()->x, positions.size(), sizeof(Vec3));
}

std::vector<Triangle> simplify_triangles(const PositionsAndTriangles& mesh, std::size_t faces,
                                         double error, unsigned int options) {
  static_assert(sizeof(Triangle) == 3 * sizeof(unsigned int) && sizeof(Vec3) == 3 * sizeof(float));
  std::vector<Triangle> result(mesh.triangles.size());
  const std::size_t indices =
      meshopt_simplify(result.data()->data(), mesh.triangles.data()->data(),
                       mesh.triangles.size() * 3, &mesh.positions.data()->x, mesh.positions.size(),
                       sizeof(Vec3), faces * 3, static_cast<float>(error), options, nullptr);
  result.resize(indices / 3);
  return result;
}

/// Simplifies one piece without changing its border. The memory is proportional to the piece, not to the mesh.
/// \param scale  scale of the whole mesh, by meshopt_simplifyScale()
std::vector<Triangle> simplify_piece(const PositionsAndTriangles& mesh,
                                     const std::vector<std::uint32_t>& piece, std::size_t faces,
                                     double error, float scale) {
  std::unordered_map<std::uint32_t, std::uint32_t> number;
  number.reserve(piece.size());
  std::vector<std::uint32_t> source_vertices;
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  triangles.reserve(piece.size());
  for (const std::uint32_t t : piece) {
    Triangle corners = mesh.triangles[t];
    for (std::uint32_t& vertex : corners) {
      const auto [place, added] =
          number.emplace(vertex, static_cast<std::uint32_t>(source_vertices.size()));
      if (added) {
        source_vertices.push_back(vertex);
        positions.push_back(mesh.positions[vertex]);
      }
      vertex = place->second;
    }
    triangles.push_back(corners);
  }
  // meshoptimizer's errors are relative to the size of the mesh that it receives, which is a piece here.
  const double larger = scale / std::max(scale_of(positions), 1e-12F);
  std::vector<Triangle> result =
      simplify_triangles({positions, triangles}, faces, error * larger, meshopt_SimplifyLockBorder);
  for (Triangle& t : result) {
    for (std::uint32_t& vertex : t) vertex = source_vertices[vertex];
  }
  return result;
}

/// For each piece, the number of triangles with an edge on the piece's border.
std::vector<std::size_t> count_along_borders(const std::vector<std::vector<std::uint32_t>>& pieces,
                                             const PositionsAndTriangles& mesh) {
  const std::vector<std::uint8_t> is_between_pieces =
      vertices_between_pieces(pieces, mesh.triangles, mesh.positions.size());
  std::vector<std::size_t> count;
  for (const std::vector<std::uint32_t>& piece : pieces) {
    count.push_back(static_cast<std::size_t>(
        std::count_if(piece.begin(), piece.end(), [&](std::uint32_t number) {
          const Triangle& t = mesh.triangles[number];
          return is_between_pieces[t[0]] + is_between_pieces[t[1]] + is_between_pieces[t[2]] >= 2;
        })));
  }
  return count;
}

/// Simplifies the pieces on all threads, then the whole mesh if needed.
/// \param is_kept        for each triangle, 1 if it must be kept; if empty, none must
/// \param other_work     unrelated work that one of the threads does meanwhile
/// \param reused_pieces  as for presimplify()
std::vector<Triangle> simplify_by_pieces(const PositionsAndTriangles& mesh,
                                         const std::vector<std::uint8_t>& is_kept,
                                         std::size_t faces, double error,
                                         const std::function<void()>& other_work,
                                         PresimplifiedPieces& reused_pieces) {
  std::vector<std::vector<std::uint32_t>> pieces =
      pieces_of(mesh.positions, mesh.triangles, kMinPresimplifyPiece);
  if (pieces.size() == 1 && is_kept.empty()) {
    other_work();
    return simplify_triangles(mesh, faces, error, 0);
  }
  std::vector<std::size_t> border_counts = count_along_borders(pieces, mesh);
  if (static_cast<double>(
          std::accumulate(border_counts.begin(), border_counts.end(), std::size_t{0})) <=
      kMaxBorderShare * static_cast<double>(faces)) {
    border_counts.assign(pieces.size(), 0);
  }
  const double share = static_cast<double>(faces) / static_cast<double>(mesh.triangles.size());
  std::vector<Triangle> result;
  std::vector<std::vector<Triangle>> parts(pieces.size());
  std::vector<std::uint8_t> is_known(pieces.size(), 0);
  if (!is_kept.empty()) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const std::size_t kept_count = std::erase_if(pieces[i], [&](std::uint32_t t) {
        if (is_kept[t] != 0) result.push_back(mesh.triangles[t]);
        return is_kept[t] != 0;
      });
      if (kept_count > 0 || i >= reused_pieces.size()) continue;
      parts[i] = reused_pieces[i];
      is_known[i] = 1;
    }
  }
  const std::size_t untouched = result.size();
  const float scale = scale_of(mesh.positions);
  parallel_for(pieces.size() + 1, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (i == pieces.size()) {
        other_work();
      } else if (is_known[i] == 0) {
        const auto goal = static_cast<std::size_t>(share * static_cast<double>(pieces[i].size()));
        parts[i] = simplify_piece(mesh, pieces[i], goal + border_counts[i], error, scale);
      }
    }
  });
  for (const std::vector<Triangle>& part : parts) {
    result.insert(result.end(), part.begin(), part.end());
  }
  if (is_kept.empty()) reused_pieces = std::move(parts);
  const bool is_near_goal =
      static_cast<double>(result.size() - untouched) <= kMaxGoalExcess * static_cast<double>(faces);
  if (is_near_goal || !is_kept.empty()) return result;
  return simplify_triangles({mesh.positions, result}, faces, error, 0);
}

/// True if vertices have so many triangles that meshoptimizer is slower than EdgeCollapser.
bool has_costly_hubs(const std::vector<Triangle>& triangles, std::size_t vertices) {
  std::vector<std::uint32_t> around(vertices, 0);
  for (const Triangle& t : triangles) {
    for (const std::uint32_t v : t) ++around[v];
  }
  double squared_valence_sum = 0;
  for (const std::uint32_t n : around) squared_valence_sum += static_cast<double>(n) * n;
  return squared_valence_sum > kMaxMeanSquaredValence * static_cast<double>(triangles.size());
}

/// For each triangle, 1 if it lies in one of the balls; empty if there are no balls.
std::vector<std::uint8_t> triangles_in_balls(const Work& work, std::span<const Ball> places) {
  if (places.empty()) return {};
  constexpr std::size_t kTrianglesOfPiece = std::size_t{1} << 15;
  std::vector<std::uint8_t> result(work.triangles.size(), 0);
  parallel_for(result.size(), kTrianglesOfPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Vec3d& corner = work.points[work.triangles[t][0]];
      result[t] = std::any_of(places.begin(), places.end(), [&](const Ball& place) {
        const Vec3d offset = corner - place.center;
        return dot(offset, offset) < place.radius * place.radius;
      });
    }
  });
  return result;
}

/// Triangles at sharp edges. If a triangle is folded and its neighbours are not, it is always among them.
std::vector<std::uint32_t> triangles_at_sharp_edges(const std::vector<Vec3d>& normals,
                                                    const std::vector<Triangle>& triangles,
                                                    std::size_t vertices) {
  std::vector<std::uint8_t> found(triangles.size(), 0);
  SideLists(triangles, vertices)
      .each_edge([&](std::uint32_t, std::span<const SideLists::Item> sides) {
        for (std::size_t i = 1; i < sides.size(); ++i) {
          const std::uint32_t a = sides[i - 1].index / 3, b = sides[i].index / 3;
          if (dot(normals[a], normals[b]) <=
              kMaxFoldCosine * length(normals[a]) * length(normals[b])) {
            found[a] = found[b] = 1;
          }
        }
      });
  std::vector<std::uint32_t> result;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (found[t] != 0) result.push_back(t);
  }
  return result;
}

/// For each vertex, the component of the dense mesh (connected over edges) that it belongs to; kNoVertex where
/// components touch.
std::vector<std::uint32_t> dense_component_of_vertices(const std::vector<Triangle>& dense,
                                                       const SideLists& sides) {
  DisjointSets parts(dense.size());
  sides.each_edge([&](std::uint32_t, std::span<const SideLists::Item> of_edge) {
    for (const SideLists::Item& side : of_edge) parts.join(of_edge[0].index / 3, side.index / 3);
  });
  std::vector<std::uint32_t> result(sides.vertices(), kNoVertex);
  std::vector<std::uint8_t> is_shared(sides.vertices(), 0);
  for (std::uint32_t t = 0; t < dense.size(); ++t) {
    const std::uint32_t part = parts.find(t);
    for (const std::uint32_t v : dense[t]) {
      if (result[v] != kNoVertex && result[v] != part) is_shared[v] = 1;
      result[v] = part;
    }
  }
  for (std::size_t v = 0; v < is_shared.size(); ++v) {
    if (is_shared[v] != 0) result[v] = kNoVertex;
  }
  return result;
}

/// Finds triangles that face away from the dense triangles around their corners.
/// \param origin  for each vertex of `triangles`, the vertex of the dense mesh
std::vector<Fold> folds_of(const std::vector<Vec3d>& points, const std::vector<Triangle>& dense,
                           const std::vector<Triangle>& triangles,
                           const std::vector<std::uint32_t>& origin) {
  const auto normal_of = [&](const Triangle& t) {
    return cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
  };
  std::vector<Vec3d> normals(triangles.size());
  std::transform(triangles.begin(), triangles.end(), normals.begin(), normal_of);
  const std::vector<std::uint32_t> candidates =
      triangles_at_sharp_edges(normals, triangles, points.size());
  std::vector<std::uint32_t> number(points.size(), kNoVertex);
  std::uint32_t count = 0;
  for (const std::uint32_t t : candidates) {
    for (const std::uint32_t v : triangles[t]) {
      if (number[origin[v]] == kNoVertex) number[origin[v]] = count++;
    }
  }
  std::vector<Vec3d> dense_normals(count);
  for (const Triangle& t : dense) {
    if (number[t[0]] == kNoVertex && number[t[1]] == kNoVertex && number[t[2]] == kNoVertex) {
      continue;
    }
    const Vec3d normal = normal_of(t);
    for (const std::uint32_t v : t) {
      if (number[v] != kNoVertex) dense_normals[number[v]] += normal;
    }
  }
  std::vector<Fold> folds;
  for (const std::uint32_t t : candidates) {
    Vec3d surface{};
    for (const std::uint32_t v : triangles[t]) {
      const Vec3d& at = dense_normals[number[origin[v]]];
      if (const double size = length(at); size > 0) surface += at * (1 / size);
    }
    if (!(dot(normals[t], surface) > 0)) folds.push_back({t, surface});
  }
  return folds;
}

/// For each vertex, 1 if it lies on an edge that does not have exactly two triangles.
std::vector<std::uint8_t> vertices_on_borders(const std::vector<Triangle>& triangles,
                                              std::size_t vertices) {
  std::vector<std::uint8_t> result(vertices, 0);
  SideLists(triangles, vertices)
      .each_edge([&](std::uint32_t, std::span<const SideLists::Item> sides) {
        if (sides.size() == 2) return;
        const std::uint32_t side = sides[0].index;
        const Triangle& t = triangles[side / 3];
        result[t[side % 3]] = result[t[(side + 1) % 3]] = 1;
      });
  return result;
}

Vec3d normal_of(const std::vector<Vec3>& positions, const Triangle& t) {
  const Vec3d a = to_double(positions[t[0]]);
  return cross(to_double(positions[t[1]]) - a, to_double(positions[t[2]]) - a);
}

/// Moves the vertices of folded triangles, most of which are slivers, along the surface towards the mean of their
/// neighbours. Repeats this several times.
/// \param is_fixed       for each vertex, 1 if it does not move
/// \param dense_normals  for each vertex, the unit normal of the dense mesh
void relax_folds(const std::vector<Triangle>& triangles, const std::vector<std::uint8_t>& is_fixed,
                 const std::vector<Vec3d>& dense_normals, std::vector<Vec3>& positions) {
  constexpr int kRelaxRounds = 8;
  std::vector<std::uint8_t> may_move(positions.size(), 0);
  std::vector<Vec3d> sums(positions.size());
  std::vector<double> counts(positions.size(), 0);
  for (int round = 0; round < kRelaxRounds; ++round) {
    bool any_moved = false;
    for (const Triangle& t : triangles) {
      if (dot(normal_of(positions, t),
              dense_normals[t[0]] + dense_normals[t[1]] + dense_normals[t[2]]) > 0)
        continue;
      for (const std::uint32_t v : t) may_move[v] = static_cast<std::uint8_t>(1 - is_fixed[v]);
      any_moved = true;
    }
    if (!any_moved) return;
    for (const Triangle& t : triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (may_move[t[k]] == 0) continue;
        sums[t[k]] += to_double(positions[t[(k + 1) % 3]]) + to_double(positions[t[(k + 2) % 3]]);
        counts[t[k]] += 2;
      }
    }
    for (std::size_t v = 0; v < may_move.size(); ++v) {
      if (may_move[v] == 0) continue;
      const Vec3d at = to_double(positions[v]);
      const Vec3d step = sums[v] * (1 / counts[v]) - at;
      positions[v] = to_float(at + step - dense_normals[v] * dot(step, dense_normals[v]));
      may_move[v] = 0;
      sums[v] = {};
      counts[v] = 0;
    }
  }
}

}  // namespace

void drop_small_components(std::vector<Triangle>& triangles, const std::vector<Triangle>& dense,
                           const std::vector<std::uint32_t>& origin, const SideLists& dense_sides) {
  DisjointSets parts(origin.size());
  join_parts(triangles, parts);
  std::vector<std::uint32_t> size(origin.size(), 0);
  for (const Triangle& t : triangles) ++size[parts.find(t[0])];
  // For the first vertex of each component, 1 if the component is small and lies beside a cut.
  std::vector<std::uint8_t> is_torn(origin.size(), 0);
  bool any_torn = false;
  for (auto v = static_cast<std::uint32_t>(dense_sides.vertices()); v < origin.size(); ++v) {
    for (const std::uint32_t end : {v, origin[v]}) {
      const std::uint32_t part = parts.find(end);
      is_torn[part] = size[part] > 0 && size[part] <= kMaxSmallComponent;
      any_torn = any_torn || is_torn[part] != 0;
    }
  }
  if (!any_torn) return;
  // If all vertices of a small component come from a single component of the dense mesh, a cut has separated them from
  // the rest of that component.
  const std::vector<std::uint32_t> dense_part = dense_component_of_vertices(dense, dense_sides);
  // For each dense component, 1 if triangles of it remain that are not in small components.
  std::vector<std::uint8_t> is_remaining(dense.size(), 0);
  std::vector<std::uint32_t> cut_from_component(
      origin.size(),
      kNoVertex);  // For the first vertex of each small component, the dense component it was cut from
  for (std::uint32_t v = 0; v < origin.size(); ++v) {
    const std::uint32_t from = dense_part[origin[v]], part = parts.find(v);
    if (from == kNoVertex) continue;
    if (size[part] > kMaxSmallComponent) is_remaining[from] = 1;
    if (is_torn[part] != 0) cut_from_component[part] = from;
  }
  for (std::size_t part = 0; part < is_torn.size(); ++part) {
    if (is_torn[part] != 0)
      is_torn[part] =
          cut_from_component[part] != kNoVertex && is_remaining[cut_from_component[part]] != 0;
  }
  std::erase_if(triangles, [&](const Triangle& t) { return is_torn[parts.find(t[0])] != 0; });
}

/// meshoptimizer may create pairs of triangles that lie back to back, which are removed here, and edges of four
/// triangles, which are cut. It prevents flips relative to surface normals. So height fields are flattened first, which
/// makes their normals nearly vertical.
void presimplify(Work& work, std::size_t faces, double error, bool height_field,
                 std::span<const Ball> untouched, bool parts, PresimplifiedPieces* reused_pieces) {
  if (has_costly_hubs(work.triangles, work.points.size())) return;
  std::vector<Vec3> positions = to_floats(work.points);
  if (height_field) {
    for (Vec3& p : positions) p.z *= static_cast<float>(kHeightScale);
    error *= kHeightScale;
  } else {
    bend(positions);
  }
  const std::vector<std::uint8_t> is_kept = triangles_in_balls(work, untouched);
  std::vector<Triangle> source_vertices = work.triangles;
  std::optional<LabelSeams> label_seams;
  if (!work.labels.empty()) {
    label_seams.emplace(work.labels, source_vertices, positions);
    if (!label_seams->is_worthwhile()) {
      if (work.keep_labels) return;
      label_seams.reset();
      source_vertices = work.triangles;
      positions.resize(work.points.size());
      work.labels.clear();
    }
  }
  std::optional<SideLists> sides;
  DisjointSets part_sets(parts ? work.points.size() : 0);
  PresimplifiedPieces unused_pieces;
  std::vector<Triangle> triangles = simplify_by_pieces(
      {positions, source_vertices}, is_kept, faces, error,
      [&] {
        sides.emplace(work.triangles, work.points.size());
        if (parts) join_parts(work.triangles, part_sets);
      },
      reused_pieces != nullptr ? *reused_pieces : unused_pieces);
  if (triangles.empty()) return;
  if (label_seams) label_seams->merge_copies(triangles);
  if (height_field && std::any_of(triangles.begin(), triangles.end(), [&](const Triangle& t) {
        return !(upward_quality(work.points[t[0]], work.points[t[1]], work.points[t[2]]) >
                 kMinUpwardQuality);
      })) {
    return;
  }
  std::vector<std::uint32_t> origin(work.points.size());
  std::iota(origin.begin(), origin.end(), 0U);
  if (!has_repeated_sides(*sides)) {
    remove_back_to_back(triangles);
    if (triangles.empty()) return;
    if (has_repeated_sides(triangles)) {
      for (const std::uint32_t original : split_into_fans(triangles, work.points.size())) {
        work.points.push_back(work.points[original]);
        work.torn.push_back(work.points[original]);
        origin.push_back(original);
      }
      drop_small_components(triangles, work.triangles, origin, *sides);
    }
  }
  const std::size_t before = triangles.size();
  if (parts) restore_lost_parts(triangles, work.triangles, origin, part_sets);
  if (label_seams) {
    if (triangles.size() > before) label_seams->store_labels(work.triangles, work.labels);
    work.labels = label_seams->labels_of(triangles, origin);
  }
  work.folds = folds_of(work.points, work.triangles, triangles, origin);
  work.triangles = std::move(triangles);
  work.sources.clear();
}

void presimplify_chunk(std::vector<Vec3>& positions, std::vector<Triangle>& triangles,
                       std::size_t faces) {
  constexpr double kUnlimitedError = 1;
  if (triangles.size() <= faces) return;
  std::vector<Vec3d> dense_normals(positions.size());
  for (const Triangle& t : triangles) {
    const Vec3d normal = normal_of(positions, t);
    for (const std::uint32_t v : t) dense_normals[v] += normal;
  }
  for (Vec3d& normal : dense_normals) {
    if (const double size = length(normal); size > 0) normal *= 1 / size;
  }
  const std::vector<std::uint8_t> is_fixed = vertices_on_borders(triangles, positions.size());
  triangles = simplify_triangles({positions, triangles}, faces, kUnlimitedError,
                                 meshopt_SimplifyLockBorder);
  relax_folds(triangles, is_fixed, dense_normals, positions);
}

}  // namespace kiln
