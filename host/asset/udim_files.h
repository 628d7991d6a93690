// Recognises pictures of UDIM sets, whose file names contain the number of a tile of UV space.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Key under which register_query() records the existing tiles of a name with a token, such as "1001
/// 1002 ".
inline constexpr const char* kTilesAnswerKey = "tiles";

/// A file name in which a token or a number stands for the tile.
class TileName {
 public:
  /// Recognises a token: `<UDIM>` (1001 + u + 10 v) or `<UVTILE>` (u1_v1, counted from 1), both in
  /// upper or lower case, or Houdini's `%(UDIM)d`. Returns nullopt if the name has no token, or if
  /// a file has exactly this name.
  static std::optional<TileName> parse_token(const std::filesystem::path& path);
  /// Recognises a separate number from 1001 to 1999, or u1_v1; of several, the last one in the name
  /// counts. Returns nullopt if there is none.
  static std::optional<TileName> parse_number(const std::filesystem::path& path);

  std::filesystem::path file_of(std::uint32_t tile) const;
  /// The path with a token for the tile. If the name has a number, `<UDIM>` or `<UVTILE>` replaces
  /// it.
  std::filesystem::path token_path() const;
  /// The tiles whose files exist, in ascending order.
  std::vector<std::uint32_t> files() const;
  /// Number of the tile in the name that was given to parse_number()
  std::uint32_t number() const { return number_; }

 private:
  std::filesystem::path folder_;
  std::string prefix_, suffix_, token_;
  bool by_columns_ = false;  ///< True: tiles are written as u1_v1; false: as numbers from 1001
  std::uint32_t number_ = 0;
};

/// True if a name contains a token or the number of a tile.
bool names_tile(const std::filesystem::path& path);

/// Number of triangles whose centroid lies on each tile. Tile 0 counts triangles outside of all
/// UDIM tiles, and those without UVs.
using TileCounts = std::map<std::uint32_t, std::uint64_t>;
/// Where a material's picture is placed: its UV set and transform, as in MaterialPicture.
struct PicturePlace {
  std::uint32_t uv_set = 0;
  std::array<float, 6> uv_transform = {1, 0, 0, 0, 1, 0};
};
/// Counts the triangles of each material on each tile.
/// \param places  one per material. If the mesh lacks a set, its own UVs are used
std::vector<TileCounts> count_tiles(const Mesh& mesh, std::span<const PicturePlace> places);
/// Counts all triangles of a mesh on each tile.
TileCounts count_tiles(const Mesh& mesh);

/// What the file name of a picture means for a mesh.
struct TileFiles {
  /// UV tiles and their files, in ascending order; empty if the name stands for a single picture
  std::vector<std::pair<std::uint32_t, std::filesystem::path>> tiles;
  std::string note;  ///< Text of a warning ("udim-siblings"); empty if there is none
};

/// Decides whether the file name of a picture stands for a UDIM set. A name with a token always
/// does: the set consists of those tiles that have files and that the mesh uses; if there is no
/// mesh, or it uses none of them, of all tiles that have files. A name with a number does only if
/// the UVs of the mesh leave the first tile, if a file exists for another tile that they reach, and
/// if at least half of the triangles are on tiles that have files. Otherwise, pictures with
/// unrelated numbers would no longer repeat. If UVs leave the first tile and such files exist,
/// `note` explains the decision.
/// \param counts     number of triangles on each tile; null: unknown
/// \param is_others  returns true for files that other materials name
TileFiles find_tiles(const std::filesystem::path& picture, const TileCounts* counts,
                     const std::function<bool(const std::filesystem::path&)>& is_others = {});

}  // namespace kiln
