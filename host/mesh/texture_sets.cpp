#include "kiln/texture_sets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include "base/formatted.h"
#include "kiln/validate.h"

namespace kiln {
namespace {

// Number of columns and rows of UDIM tiles, for the numbers 1001 to 9999 with a margin
constexpr std::uint32_t kTilesAcross = 10, kTilesUp = 900;
// Number of cells along a side of the grid that finds overlap
constexpr std::uint32_t kOverlapGrid = 512;
constexpr double kMaxOverlapShare = 0.01;  // Allowed overlap, as a share of the unit square

using UvCorners = std::array<Vec2, 3>;

UvCorners corner_uvs(const Mesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.uv_triangles[t];
  return {mesh.uvs[a], mesh.uvs[b], mesh.uvs[c]};
}

bool has_uvs(const UvCorners& uvs) {
  return std::all_of(uvs.begin(), uvs.end(),
                     [](const Vec2& uv) { return std::isfinite(uv.x) && std::isfinite(uv.y); });
}

bool has_area_in_uv(const UvCorners& uvs) {
  const double u1 = double{uvs[1].x} - uvs[0].x, v1 = double{uvs[1].y} - uvs[0].y;
  const double u2 = double{uvs[2].x} - uvs[0].x, v2 = double{uvs[2].y} - uvs[0].y;
  return u1 * v2 - u2 * v1 != 0;
}

/// The tile that contains the centroid of a triangle.
std::pair<std::int64_t, std::int64_t> tile_of(const UvCorners& uvs) {
  const double u = (double{uvs[0].x} + uvs[1].x + uvs[2].x) / 3;
  const double v = (double{uvs[0].y} + uvs[1].y + uvs[2].y) / 3;
  const auto whole_part = [](double value) {
    constexpr double kMaxTile = 1e9;
    return static_cast<std::int64_t>(std::floor(std::clamp(value, -kMaxTile, kMaxTile)));
  };
  return {whole_part(u), whole_part(v)};
}

/// Moves a triangle to the unit square, and calls `use` for each cell of a grid over the square whose centre lies
/// inside of it.
template <typename Use>
void visit_uv_cells(const UvCorners& uvs, double move_u, double move_v, const Use& use) {
  std::array<std::array<double, 2>, 3> p{};
  for (std::size_t k = 0; k < 3; ++k) {
    p[k] = {(uvs[k].x - move_u) * kOverlapGrid, (uvs[k].y - move_v) * kOverlapGrid};
  }
  const auto edge = [](const auto& a, const auto& b, double x, double y) {
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
  };
  const double area = edge(p[0], p[1], p[2][0], p[2][1]);
  if (!(std::abs(area) > 0)) return;
  const auto range = [&](std::size_t axis) {
    const auto [low, high] = std::minmax({p[0][axis], p[1][axis], p[2][axis]});
    const auto cell = [](double value) {
      return static_cast<std::uint32_t>(std::clamp(value, 0.0, double{kOverlapGrid}));
    };
    return std::pair(cell(low), std::min(cell(high) + 1, kOverlapGrid));
  };
  const auto [x0, x1] = range(0);
  const auto [y0, y1] = range(1);
  for (std::uint32_t y = y0; y < y1; ++y) {
    for (std::uint32_t x = x0; x < x1; ++x) {
      bool is_centre_inside = true;
      for (std::size_t k = 0; k < 3; ++k) {
        is_centre_inside =
            is_centre_inside && edge(p[k], p[(k + 1) % 3], x + 0.5, y + 0.5) * area > 0;
      }
      if (is_centre_inside) use(std::size_t{y} * kOverlapGrid + x);
    }
  }
}

/// True if two triangles are copies of one part: their UVs are equal in any order, except for whole-number offsets.
bool are_copies(const UvCorners& a, const UvCorners& b) {
  constexpr float kSameUvTolerance = 1e-4F;
  const auto sorted = [](UvCorners uvs) {
    const auto [u, v] = tile_of(uvs);
    for (Vec2& uv : uvs) uv = {uv.x - static_cast<float>(u), uv.y - static_cast<float>(v)};
    std::sort(uvs.begin(), uvs.end(), [](const Vec2& p, const Vec2& q) {
      return std::pair(p.x, p.y) < std::pair(q.x, q.y);
    });
    return uvs;
  };
  const UvCorners p = sorted(a), q = sorted(b);
  for (std::size_t k = 0; k < 3; ++k) {
    if (std::abs(p[k].x - q[k].x) > kSameUvTolerance ||
        std::abs(p[k].y - q[k].y) > kSameUvTolerance)
      return false;
  }
  return true;
}

/// True if triangles of different sets overlap in more than 1% of the unit square.
/// \param in_tile  moves every tile to the unit square, and ignores copies
template <typename SetOf>
bool clearly_overlap(const Mesh& low, const SetOf& set_of, bool in_tile) {
  constexpr std::uint32_t kNoTriangle = 0xFFFFFFFFU;
  std::vector<std::uint32_t> cell_owner(std::size_t{kOverlapGrid} * kOverlapGrid, kNoTriangle);
  std::vector<std::uint8_t> is_cell_shared(cell_owner.size(), 0);
  const auto max_grid_cells =
      static_cast<std::uint64_t>(kMaxOverlapShare * static_cast<double>(cell_owner.size()));
  std::uint64_t cells = 0;
  const auto is_copy_in_tile = [&](const UvCorners& uvs) {
    const auto cell = [&](float a, float b, float c) {
      const double middle = (double{a} + b + c) / 3;
      return static_cast<std::size_t>((middle - std::floor(middle)) * kOverlapGrid) % kOverlapGrid;
    };
    const std::uint32_t known = cell_owner[cell(uvs[0].y, uvs[1].y, uvs[2].y) * kOverlapGrid +
                                           cell(uvs[0].x, uvs[1].x, uvs[2].x)];
    return known != kNoTriangle && are_copies(corner_uvs(low, known), uvs);
  };
  for (std::uint32_t t = 0; t < low.triangles.size() && cells <= max_grid_cells; ++t) {
    const UvCorners uvs = corner_uvs(low, t);
    if (!has_uvs(uvs)) continue;
    const auto [u, v] = in_tile ? tile_of(uvs) : std::pair<std::int64_t, std::int64_t>(0, 0);
    if (in_tile && is_copy_in_tile(uvs))
      continue;  // The copy of this triangle covers the same cells
    visit_uv_cells(uvs, static_cast<double>(u), static_cast<double>(v), [&](std::size_t cell) {
      if (cell_owner[cell] == kNoTriangle) cell_owner[cell] = t;
      if (is_cell_shared[cell] != 0 || set_of(cell_owner[cell]) == set_of(t)) return;
      if (in_tile && are_copies(corner_uvs(low, cell_owner[cell]), uvs)) return;
      is_cell_shared[cell] = 1;
      ++cells;
    });
  }
  return cells > max_grid_cells;
}

TextureSet whole_mesh_set(const Mesh& low) {
  TextureSet set;
  set.members.resize(low.triangles.size());
  std::iota(set.members.begin(), set.members.end(), 0U);
  set.triangles = low.triangles.size();
  return set;
}

std::vector<TextureSet> texture_sets_by_name(const Mesh& low, const std::vector<std::uint32_t>& of,
                                             const std::vector<std::string>& names) {
  std::vector<TextureSet> sets(names.size());
  for (std::size_t i = 0; i < sets.size(); ++i) {
    sets[i].name = names[i];
  }
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    const UvCorners uvs = corner_uvs(low, t);
    if (!has_uvs(uvs)) continue;
    sets[of[t]].members.push_back(static_cast<std::uint32_t>(t));
    if (has_area_in_uv(uvs)) ++sets[of[t]].triangles;
  }
  return sets;
}

/// \throws Error(input) for a triangle outside of the UDIM tiles
void check_tiles(const Mesh& low) {
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    const UvCorners uvs = corner_uvs(low, t);
    if (!has_uvs(uvs) || !has_area_in_uv(uvs)) continue;
    const auto [u, v] = tile_of(uvs);
    if (u < 0 || u >= kTilesAcross || v < 0 || v >= kTilesUp) {
      throw Error(ErrorCode::input, "Mesh '" + low.name + "': triangle " + std::to_string(t) +
                                        " lies at UV (" + decimal(uvs[0].x) + ", " +
                                        decimal(uvs[0].y) +
                                        "), where UDIM has no tile: u goes from 0 to " +
                                        std::to_string(kTilesAcross) + ", v from 0 to " +
                                        std::to_string(kTilesUp) + ". Move its chart into a tile.");
    }
  }
}

std::vector<TextureSet> texture_sets_by_tile(const Mesh& low) {
  check_tiles(low);  // Checked here, before thousands of sets are created
  // The sets of all tiles, row by row
  std::map<std::pair<std::int64_t, std::int64_t>, TextureSet> tiles;
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    const UvCorners uvs = corner_uvs(low, t);
    if (!has_uvs(uvs) || !has_area_in_uv(uvs)) continue;
    const auto [u, v] = tile_of(uvs);
    TextureSet& set = tiles[{v, u}];
    if (set.members.empty()) {
      set.tile_u = static_cast<std::uint32_t>(u);
      set.tile_v = static_cast<std::uint32_t>(v);
      set.name = std::to_string(1001 + u + kTilesAcross * v);
    }
    set.members.push_back(static_cast<std::uint32_t>(t));
    ++set.triangles;
  }
  std::vector<TextureSet> sets;
  sets.reserve(tiles.size());
  for (auto& [place, set] : tiles) sets.push_back(std::move(set));
  return sets;
}

/// True if all triangles lie in UDIM tiles, and at least one beyond the unit square.
bool lies_in_tiles(const Mesh& low) {
  bool is_beyond_unit_square = false, in_tiles = true;
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    const UvCorners uvs = corner_uvs(low, t);
    if (!has_uvs(uvs)) continue;
    const auto [u, v] = tile_of(uvs);
    is_beyond_unit_square = is_beyond_unit_square || u != 0 || v != 0;
    in_tiles = in_tiles && u >= 0 && u < kTilesAcross && v >= 0 && v < kTilesUp;
  }
  return is_beyond_unit_square && in_tiles;
}

/// True if charts of several tiles would overlap if all tiles were moved to one, and are not copies of each other.
bool tiles_overlap(const Mesh& low) {
  const auto tile = [&](std::uint32_t t) { return tile_of(corner_uvs(low, t)); };
  return clearly_overlap(low, tile, /*in_tile=*/true);
}

/// Removes the UVs of all triangles that are not in a set.
void remove_uvs_outside(const TextureSet& set, Mesh& low) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  const auto nan_uv = static_cast<std::uint32_t>(low.uvs.size());
  low.uvs.push_back({kNaN, kNaN});
  std::vector<Triangle> kept(low.triangles.size(), {nan_uv, nan_uv, nan_uv});
  for (const std::uint32_t t : set.members) kept[t] = low.uv_triangles[t];
  low.uv_triangles = std::move(kept);
}

/// The tile that contains all triangles of a set with UV area; nullopt if there are several tiles.
std::optional<std::pair<std::uint32_t, std::uint32_t>> tile_if_single(const Mesh& low,
                                                                      const TextureSet& set) {
  std::optional<std::pair<std::uint32_t, std::uint32_t>> single_tile;
  for (const std::uint32_t t : set.members) {
    const UvCorners uvs = corner_uvs(low, t);
    if (!has_area_in_uv(uvs)) continue;
    const std::pair<std::uint32_t, std::uint32_t> tile = tile_of(uvs);
    if (single_tile.value_or(tile) != tile) return std::nullopt;
    single_tile = tile;
  }
  return single_tile;
}

/// Splits sets of materials or objects that span several tiles.
std::vector<TextureSet> split_sets_by_tiles(const Mesh& low, std::vector<TextureSet> sets) {
  if (!lies_in_tiles(low)) return sets;
  std::vector<TextureSet> result;
  for (TextureSet& set : sets) {
    if (const auto tile = tile_if_single(low, set)) {
      std::tie(set.tile_u, set.tile_v) = *tile;
      result.push_back(std::move(set));
      continue;
    }
    Mesh set_mesh;
    set_mesh.name = low.name;
    set_mesh.triangles = low.triangles;
    set_mesh.uvs = low.uvs;
    set_mesh.uv_triangles = low.uv_triangles;
    remove_uvs_outside(set, set_mesh);
    std::vector<TextureSet> tiles = texture_sets_by_tile(set_mesh);
    if (!tiles_overlap(set_mesh)) {
      result.push_back(std::move(set));
      continue;
    }
    for (TextureSet& tile : tiles) {
      tile.tile = std::exchange(tile.name, set.name);
      result.push_back(std::move(tile));
    }
  }
  return result;
}

}  // namespace

std::vector<TextureSet> find_texture_sets(const Mesh& low, SetsBy by) {
  validate(low);
  if (by == SetsBy::none || low.uv_triangles.empty()) return {whole_mesh_set(low)};
  const auto missing_error = [&](const char* what) {
    throw Error(ErrorCode::input, "Mesh '" + low.name + "' has no " + what +
                                      ", by which texture sets could be formed. Choose other sets, "
                                      "or none.");
  };
  std::vector<TextureSet> sets;
  if (by == SetsBy::udim) {
    sets = texture_sets_by_tile(low);
  } else if (by == SetsBy::material) {
    if (low.materials.empty()) missing_error("materials");
    sets = texture_sets_by_name(low, low.materials, low.material_names);
  } else {
    if (low.objects.empty()) missing_error("objects");
    sets = texture_sets_by_name(low, low.objects, low.object_names);
  }
  std::erase_if(sets, [](const TextureSet& set) { return set.triangles == 0; });
  if (sets.empty()) return {whole_mesh_set(low)};
  return by == SetsBy::udim ? sets : split_sets_by_tiles(low, std::move(sets));
}

SetsBy choose_texture_sets(const Mesh& low) {
  validate(low);
  if (low.uv_triangles.empty()) return SetsBy::none;
  if (low.material_names.size() > 1 && !low.materials.empty() &&
      clearly_overlap(
          low, [&](std::uint32_t t) { return low.materials[t]; }, /*in_tile=*/false)) {
    return SetsBy::material;
  }
  return lies_in_tiles(low) && tiles_overlap(low) ? SetsBy::udim : SetsBy::none;
}

Mesh low_of_set(const Mesh& low, const TextureSet& set) {
  if (low.uv_triangles.empty()) {
    throw Error(ErrorCode::input, "Mesh '" + low.name + "' has no UVs, so it has no texture sets.");
  }
  Mesh mesh = low;
  if (low.tangents.empty()) mesh.tangents = tangents_of(low);
  lay_out_set(low, set, mesh);
  return mesh;
}

// Changes the layout in place. Otherwise, each of thousands of sets would allocate and copy the whole layout.
void lay_out_set(const Mesh& low, const TextureSet& set, Mesh& part) {
  const auto u = static_cast<float>(set.tile_u), v = static_cast<float>(set.tile_v);
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  const auto nan_uv = static_cast<std::uint32_t>(low.uvs.size());
  part.uvs.resize(low.uvs.size() + 1);
  for (std::size_t i = 0; i < low.uvs.size(); ++i) {
    part.uvs[i] = {low.uvs[i].x - u, low.uvs[i].y - v};
  }
  part.uvs.back() = {kNaN, kNaN};
  part.uv_triangles.assign(low.uv_triangles.size(), {nan_uv, nan_uv, nan_uv});
  for (const std::uint32_t t : set.members) part.uv_triangles[t] = low.uv_triangles[t];
}

}  // namespace kiln
