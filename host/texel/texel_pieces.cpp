#include "texel/texel_pieces.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "base/formatted.h"
#include "base/option.h"
#include "base/parallel.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

// Share of the way to a triangle's centre by which points are moved inward: points exactly on the border may miss a
// high poly that ends there.
constexpr double kPointInset = 1.0 / 256;

/// Number of triangles with an imperfection, and the first of them.
struct CountedFlaw {
  std::uint64_t count = 0;
  std::size_t example = 0;
  void add(std::size_t triangle) {
    if (count++ == 0) example = triangle;
  }
  void add(const CountedFlaw& later) {
    if (count == 0) example = later.example;
    count += later.count;
  }
};

/// Builds the pieces of a range of triangles.
struct PieceBuilder {
  UvGrid grid;
  std::vector<kiln_texel_piece> pieces;
  std::vector<kiln_texel_corners> corners;
  std::vector<FixedPointTriangle> fixed_point_triangles;
  CountedFlaw outside_square, degenerate_uv, missing_uv, degenerate_low;

  void add_triangle(const LowSurface& surface, std::size_t t) {
    // Skips UV copies, which are not baked since they share the texels of another triangle
    if (surface.usable[t] == 0 || surface.is_copy(t)) return;
    const auto& triangle = surface.triangles[t];
    const auto first = static_cast<std::uint32_t>(pieces.size());
    if (in_prism(triangle[0].uv) && in_prism(triangle[1].uv) && in_prism(triangle[2].uv)) {
      FixedPointTriangle f;
      for (std::size_t k = 0; k < 3; ++k) {
        f.x[k] = grid.fixed_x(triangle[k].uv.x);
        f.y[k] = grid.fixed_y(triangle[k].uv.y);
      }
      if (doubled_area(f) == 0) {
        degenerate_uv.add(t);
        return;
      }
      if (grid.is_beyond_square(f)) outside_square.add(t);
      if (grid.is_outside_square(f)) return;
      std::array<ClipVertex, 3> uncut_corners;
      for (std::size_t k = 0; k < 3; ++k) uncut_corners[k].weight[k] = 1;
      add_piece(f, triangle, uncut_corners, t, first);
      return;
    }
    outside_square.add(t);
    const std::vector<ClipVertex> polygon =
        clip_to_prism({triangle[0].uv, triangle[1].uv, triangle[2].uv});
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      const std::array<ClipVertex, 3> fan{polygon[0], polygon[i - 1], polygon[i]};
      FixedPointTriangle f;
      for (std::size_t k = 0; k < 3; ++k) {
        f.x[k] = grid.fixed_x(fan[k].u);
        f.y[k] = grid.fixed_y(fan[k].v);
      }
      if (doubled_area(f) != 0 && !grid.is_outside_square(f)) add_piece(f, triangle, fan, t, first);
    }
  }

  void add_piece(const FixedPointTriangle& f, const std::array<LowSurface::Corner, 3>& triangle,
                 const std::array<ClipVertex, 3>& weights, std::size_t t, std::uint32_t first) {
    const std::int64_t area = doubled_area(f);
    const std::int32_t sign = area < 0 ? -1 : 1;
    const std::int64_t half = std::int64_t{1} << (grid.shift - 1);
    kiln_texel_piece piece{};
    for (std::size_t k = 0; k < 3; ++k) {
      // The edge opposite corner k, oriented so that its edge function E is positive inside.
      const std::size_t p = (k + 1) % 3;
      const std::size_t q = (k + 2) % 3;
      const std::int32_t dx = sign * (f.x[q] - f.x[p]);
      const std::int32_t dy = sign * (f.y[q] - f.y[p]);
      piece.a[k] = -dy;
      piece.b[k] = dx;
      piece.c[k] = dx * (half - f.y[p]) - dy * (half - f.x[p]);
      // Rows are numbered downwards, so the inside of the triangle lies to the right of an edge that points up, and
      // below an edge that points right. These are left and top edges; samples on them belong to the triangle.
      if (dy < 0 || (dy == 0 && dx > 0)) piece.closed |= 1U << k;
    }
    const auto magnitude = static_cast<std::uint64_t>(area < 0 ? -area : area);
    piece.drop =
        static_cast<std::uint32_t>(std::max(0, static_cast<int>(std::bit_width(magnitude)) - 31));
    piece.triangle = static_cast<std::uint32_t>(t);
    piece.first = first;

    kiln_texel_corners data{};
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3d position{};
      Vec3d direction{};
      for (std::size_t m = 0; m < 3; ++m) {
        position += to_double(triangle[m].position) * weights[k].weight[m];
        direction += to_double(triangle[m].direction) * weights[k].weight[m];
      }
      const Vec3 p = to_float(position);
      const Vec3 d = to_float(direction);
      const std::array<float, 6> values{p.x, p.y, p.z, d.x, d.y, d.z};
      std::copy_n(values.begin(), 3, &data.position[3 * k]);
      std::copy_n(values.begin() + 3, 3, &data.direction[3 * k]);
      data.weight1[k] = static_cast<float>(weights[k].weight[1]);
      data.weight2[k] = static_cast<float>(weights[k].weight[2]);
    }
    data.reciprocal = static_cast<float>(std::ldexp(1.0, static_cast<int>(piece.drop)) /
                                         static_cast<double>(magnitude));
    pieces.push_back(piece);
    corners.push_back(data);
    fixed_point_triangles.push_back(f);
  }
};

/// Triangles of the low poly that are not usable, counted once for all texture sets.
struct UnusableTriangles {
  CountedFlaw triangles;
};

/// Finds usable triangles without UVs. It visits only the triangles of the texture set, except that the search for an
/// example may visit those of the whole mesh.
CountedFlaw find_triangles_without_uvs(const LowSurface& surface, std::uint64_t unusable_count) {
  const std::vector<std::uint32_t>& with_uvs = surface.with_uvs;
  const auto usable_with_uvs =
      std::count_if(with_uvs.begin(), with_uvs.end(),
                    [&](const std::uint32_t t) { return surface.usable[t] != 0; });
  CountedFlaw result;
  result.count =
      surface.triangles.size() - unusable_count - static_cast<std::uint64_t>(usable_with_uvs);
  if (result.count == 0) return result;
  for (std::size_t t = 0, next = 0;; ++t) {
    if (next < with_uvs.size() && with_uvs[next] == t) {
      ++next;
    } else if (surface.usable[t] != 0) {
      result.example = t;
      return result;
    }
  }
}

std::string name_triangles(std::uint64_t count) {
  return std::to_string(count) +
         (count == 1 ? " triangle of the low poly " : " triangles of the low poly ");
}

std::string uv_of_triangle(const LowSurface& surface, std::size_t t) {
  std::string text = "triangle " + std::to_string(t) + " with UVs ";
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2& uv = surface.triangles[t][k].uv;
    text += (k == 0 ? "(" : ", (") + decimal(uv.x) + ", " + decimal(uv.y) + ")";
  }
  return text;
}

std::vector<Warning> flaw_warnings(const LowSurface& surface, const PieceBuilder& merged_builder) {
  std::vector<Warning> warnings;
  if (const CountedFlaw& found = merged_builder.outside_square; found.count != 0) {
    warnings.push_back(
        {"uv-outside",
         name_triangles(found.count) + (found.count == 1 ? "reaches" : "reach") +
             " out of the unit square of UV space, for example " +
             uv_of_triangle(surface, found.example) +
             ": what lies outside has no texel and was not baked. Move the charts into the unit "
             "square, or bake each tile by itself (" +
             option("sets", "udim") + ").",
         found.count});
  }
  if (const CountedFlaw& found = merged_builder.degenerate_uv; found.count != 0) {
    warnings.push_back(
        {"uv-degenerate",
         name_triangles(found.count) + (found.count == 1 ? "has" : "have") +
             " no area in UV space, for example " + uv_of_triangle(surface, found.example) +
             ": they cover no texel and were not baked. Unwrap them if they are seen.",
         found.count});
  }
  if (const CountedFlaw& found = merged_builder.missing_uv; found.count != 0) {
    warnings.push_back({"uv-missing",
                        name_triangles(found.count) + (found.count == 1 ? "has" : "have") +
                            " a corner without UVs, for example triangle " +
                            std::to_string(found.example) +
                            ": they cover no texel and were not baked. Unwrap them if they are "
                            "seen.",
                        found.count});
  }
  if (const CountedFlaw& found = merged_builder.degenerate_low; found.count != 0) {
    warnings.push_back({"low-degenerate",
                        name_triangles(found.count) +
                            (found.count == 1 ? "has no area, or has" : "have no area, or have") +
                            " a non-finite corner, for example triangle " +
                            std::to_string(found.example) +
                            ": they were not baked. Clean up the mesh if they should be.",
                        found.count});
  }
  return warnings;
}

}  // namespace

TexelPieces TexelPieces::of(const LowSurface& surface, std::uint32_t sample_width,
                            std::uint32_t sample_height) {
  PieceBuilder merged_builder;
  merged_builder.grid = UvGrid::of(sample_width, sample_height);

  const std::size_t count = surface.with_uvs.size();
  merged_builder.degenerate_low = surface.made
                                      ->get<UnusableTriangles>([&] {
                                        UnusableTriangles result;
                                        for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
                                          if (surface.usable[t] == 0) result.triangles.add(t);
                                        }
                                        return result;
                                      })
                                      ->triangles;
  merged_builder.missing_uv =
      find_triangles_without_uvs(surface, merged_builder.degenerate_low.count);
  constexpr std::size_t kTrianglesPerRun = 1 << 14;
  std::vector<PieceBuilder> runs((count + kTrianglesPerRun - 1) / kTrianglesPerRun);
  parallel_for(runs.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      runs[r].grid = merged_builder.grid;
      const std::size_t last = std::min(count, (r + 1) * kTrianglesPerRun);
      for (std::size_t i = r * kTrianglesPerRun; i < last; ++i) {
        runs[r].add_triangle(surface, surface.with_uvs[i]);
      }
    }
  });

  for (PieceBuilder& run : runs) {
    const auto offset = static_cast<std::uint32_t>(merged_builder.pieces.size());
    for (kiln_texel_piece& piece : run.pieces) piece.first += offset;
    merged_builder.pieces.insert(merged_builder.pieces.end(), run.pieces.begin(), run.pieces.end());
    merged_builder.corners.insert(merged_builder.corners.end(), run.corners.begin(),
                                  run.corners.end());
    merged_builder.fixed_point_triangles.insert(merged_builder.fixed_point_triangles.end(),
                                                run.fixed_point_triangles.begin(),
                                                run.fixed_point_triangles.end());
    merged_builder.outside_square.add(run.outside_square);
    merged_builder.degenerate_uv.add(run.degenerate_uv);
    run = PieceBuilder{};
  }
  TexelPieces result;
  result.fraction_bits = merged_builder.grid.shift;
  result.warnings = flaw_warnings(surface, merged_builder);
  result.pieces = std::move(merged_builder.pieces);
  result.corners = std::move(merged_builder.corners);
  result.fixed_point_triangles = std::move(merged_builder.fixed_point_triangles);
  return result;
}

void TexelPieces::add_assigned_texels(const LowSurface& surface,
                                      std::span<const AssignedTexel> texels, std::uint32_t width,
                                      std::uint32_t height, std::uint32_t samples) {
  PieceBuilder merged_builder;
  merged_builder.grid = UvGrid::of(width * samples, height * samples);
  for (const AssignedTexel& texel : texels) {
    const auto& triangle = surface.triangles[texel.triangle];
    std::array<double, 3> x{}, y{};
    for (std::size_t k = 0; k < 3; ++k) {
      x[k] = double{triangle[k].uv.x} * width;
      y[k] = (1 - double{triangle[k].uv.y}) * height;
    }
    const auto first = static_cast<std::uint32_t>(pieces.size() + merged_builder.pieces.size());
    // Splits the texel's square into two triangles.
    for (const auto& half : {std::array<std::uint32_t, 3>{0, 1, 3}, {0, 3, 2}}) {
      FixedPointTriangle f{};
      std::array<ClipVertex, 3> points;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t column = texel.column + half[k] % 2, row = texel.row + half[k] / 2;
        f.x[k] = static_cast<std::int32_t>(std::int64_t{column} * samples << fraction_bits);
        f.y[k] = static_cast<std::int32_t>(std::int64_t{row} * samples << fraction_bits);
        auto [u, v] = samples == 1 ? nearest_weights(x, y, texel.column + 0.5, texel.row + 0.5)
                                   : nearest_weights(x, y, column, row);
        u += (1.0 / 3 - u) * kPointInset;
        v += (1.0 / 3 - v) * kPointInset;
        points[k].weight = {1 - u - v, u, v};
      }
      merged_builder.add_piece(f, triangle, points, texel.triangle, first);
    }
  }
  pieces.insert(pieces.end(), merged_builder.pieces.begin(), merged_builder.pieces.end());
  corners.insert(corners.end(), merged_builder.corners.begin(), merged_builder.corners.end());
  fixed_point_triangles.insert(fixed_point_triangles.end(),
                               merged_builder.fixed_point_triangles.begin(),
                               merged_builder.fixed_point_triangles.end());
}

std::array<double, 2> nearest_weights(const std::array<double, 3>& x,
                                      const std::array<double, 3>& y, double at_x, double at_y) {
  const double bx = x[1] - x[0], by = y[1] - y[0], cx = x[2] - x[0], cy = y[2] - y[0];
  const double px = at_x - x[0], py = at_y - y[0];
  const double area = bx * cy - by * cx;
  const double u = (px * cy - py * cx) / area, v = (bx * py - by * px) / area;
  if (u >= 0 && v >= 0 && u + v <= 1) return {u, v};
  constexpr std::array<std::array<double, 2>, 3> kUnitTriangle = {{{0, 0}, {1, 0}, {0, 1}}};
  std::array<double, 2> best{};
  double min_distance = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    const double ex = x[next] - x[k], ey = y[next] - y[k];
    const double along = ex * ex + ey * ey;
    const double projection = (at_x - x[k]) * ex + (at_y - y[k]) * ey;
    const double share = along > 0 ? std::clamp(projection / along, 0.0, 1.0) : 0;
    const double dx = x[k] + share * ex - at_x, dy = y[k] + share * ey - at_y;
    const double away = dx * dx + dy * dy;
    if (!(away < min_distance)) continue;
    min_distance = away;
    for (std::size_t c = 0; c < 2; ++c) {
      best[c] = kUnitTriangle[k][c] + share * (kUnitTriangle[next][c] - kUnitTriangle[k][c]);
    }
  }
  return best;
}

}  // namespace kiln
