#include "lowpoly/head_start.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "lowpoly/height_rule.h"
#include "mesh/fans.h"

namespace kiln {
namespace {

/// Height fields are brought down to this share of their heights for it.
constexpr double kFlattened = 0.1;
/// Triangles of a piece, at least. Pieces are halved until one more time would leave fewer.
constexpr std::size_t kPiece = 125'000;
/// Pieces keep their borders. Where these leave this many times the goal, as on meshes of many small parts, the
/// mesh goes on as a whole.
constexpr double kTooMany = 1.25;

struct Input {
  const std::vector<Vec3>& positions;
  const std::vector<Triangle>& triangles;
};

/// Triangles by piece: halves along the longest side, of halves, and so on. As the mesh alone says.
std::vector<std::vector<std::uint32_t>> pieces_of(const Input& mesh) {
  struct Item {
    Vec3 corner;
    std::uint32_t triangle;
  };
  std::vector<Item> items(mesh.triangles.size());
  for (std::uint32_t t = 0; t < items.size(); ++t) {
    items[t] = {mesh.positions[mesh.triangles[t][0]], t};
  }
  std::vector<std::span<Item>> pieces{items};
  while (pieces[0].size() / 2 >= kPiece) {
    std::vector<std::span<Item>> halves(2 * pieces.size());
    parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::span<Item> all = pieces[i];
        Vec3 low = all[0].corner, high = low;
        for (const Item& item : all) {
          const Vec3& p = item.corner;
          low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
          high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
        const float x = high.x - low.x, y = high.y - low.y, z = high.z - low.z;
        const auto axis = x >= y && x >= z ? &Vec3::x : y >= z ? &Vec3::y : &Vec3::z;
        const std::size_t half = all.size() / 2;
        std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(half), all.end(),
                         [&](const Item& a, const Item& b) {
                           return a.corner.*axis != b.corner.*axis ? a.corner.*axis < b.corner.*axis
                                                                   : a.triangle < b.triangle;
                         });
        halves[2 * i] = all.subspan(0, half);
        halves[2 * i + 1] = all.subspan(half);
      }
    });
    pieces = std::move(halves);
  }
  std::vector<std::vector<std::uint32_t>> result(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (const Item& item : pieces[i]) result[i].push_back(item.triangle);
    std::sort(result[i].begin(), result[i].end());
  }
  return result;
}

float scale_of(const std::vector<Vec3>& positions) {
  return meshopt_simplifyScale(&positions.data()->x, positions.size(), sizeof(Vec3));
}

std::vector<Triangle> simplified(const Input& mesh, std::size_t faces, double error,
                                 unsigned int options) {
  static_assert(sizeof(Triangle) == 3 * sizeof(unsigned int) && sizeof(Vec3) == 3 * sizeof(float));
  std::vector<Triangle> result(mesh.triangles.size());
  const std::size_t indices =
      meshopt_simplify(result.data()->data(), mesh.triangles.data()->data(),
                       mesh.triangles.size() * 3, &mesh.positions.data()->x, mesh.positions.size(),
                       sizeof(Vec3), faces * 3, static_cast<float>(error), options, nullptr);
  result.resize(indices / 3);
  return result;
}

/// A piece by itself: its border stays.
std::vector<Triangle> simplified_piece(const Input& mesh, const std::vector<std::uint32_t>& piece,
                                       double share, double error) {
  std::vector<std::uint32_t> number(mesh.positions.size(), kNoVertex), given;
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  triangles.reserve(piece.size());
  for (const std::uint32_t t : piece) {
    Triangle corners = mesh.triangles[t];
    for (std::uint32_t& vertex : corners) {
      if (number[vertex] == kNoVertex) {
        number[vertex] = static_cast<std::uint32_t>(given.size());
        given.push_back(vertex);
        positions.push_back(mesh.positions[vertex]);
      }
      vertex = number[vertex];
    }
    triangles.push_back(corners);
  }
  // meshoptimizer takes errors as shares of what it is given.
  const double larger = scale_of(mesh.positions) / std::max(scale_of(positions), 1e-12F);
  const auto faces = static_cast<std::size_t>(share * static_cast<double>(piece.size()));
  std::vector<Triangle> result =
      simplified({positions, triangles}, faces, error * larger, meshopt_SimplifyLockBorder);
  for (Triangle& t : result) {
    for (std::uint32_t& vertex : t) vertex = given[vertex];
  }
  return result;
}

/// Piece by piece on all threads, then as a whole where need be.
std::vector<Triangle> simplified_by_pieces(const Input& mesh, std::size_t faces, double error) {
  const std::vector<std::vector<std::uint32_t>> pieces = pieces_of(mesh);
  if (pieces.size() == 1) return simplified(mesh, faces, error, 0);
  const double share = static_cast<double>(faces) / static_cast<double>(mesh.triangles.size());
  std::vector<std::vector<Triangle>> parts(pieces.size());
  parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      parts[i] = simplified_piece(mesh, pieces[i], share, error);
    }
  });
  std::vector<Triangle> result;
  for (const std::vector<Triangle>& part : parts) {
    result.insert(result.end(), part.begin(), part.end());
  }
  if (static_cast<double>(result.size()) <= kTooMany * static_cast<double>(faces)) return result;
  return simplified({mesh.positions, result}, faces, error, 0);
}

}  // namespace

/// meshoptimizer leaves pairs of triangles back to back, and edges with four triangles, where the high
/// poly had none: the former are removed, the latter cut. It also lets no triangle turn over, but as seen
/// from the side: height fields are made flat for it, so that this is nearly as seen from above.
void head_start(Work& work, std::size_t faces, double error, bool height_field) {
  std::vector<Vec3> positions = to_floats(work.points);
  if (height_field) {
    for (Vec3& p : positions) p.z *= static_cast<float>(kFlattened);
    error *= kFlattened;
  }
  std::vector<Triangle> triangles = simplified_by_pieces({positions, work.triangles}, faces, error);
  if (triangles.empty()) return;
  if (height_field && std::any_of(triangles.begin(), triangles.end(), [&](const Triangle& t) {
        return !(upward(work.points[t[0]], work.points[t[1]], work.points[t[2]]) > kLeastUpward);
      })) {
    return;
  }
  if (!has_repeated_sides(work.triangles)) {
    remove_back_to_back(triangles);
    if (triangles.empty()) return;
    if (has_repeated_sides(triangles)) {
      for (const std::uint32_t original : split_into_fans(triangles, work.points.size())) {
        work.points.push_back(work.points[original]);
      }
    }
  }
  work.triangles = std::move(triangles);
  work.sources.clear();
}

}  // namespace kiln
