// Recognises pictures of UDIM sets, whose file names contain the tile of UV space.
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

/// Key under which note_answer() records the existing tiles of a name with a token, such as "1001 1002 ".
inline constexpr const char* kTilesAnswerKey = "tiles";

/// A file name in which a placeholder stands for the tile.
class TileName {
 public:
  /// Recognises a token: `<UDIM>` (1001 + u + 10 v), `<UVTILE>` (u1_v1, counted from 1), both in any case, or Houdini's
  /// `%(UDIM)d`. nullopt if the name has no token, or a file has exactly this name.
  static std::optional<TileName> by_token(const std::filesystem::path& path);
  /// Recognises a separate number from 1001 to 1999, or u1_v1; the last one in the name counts. nullopt without one.
  static std::optional<TileName> by_number(const std::filesystem::path& path);

  std::filesystem::path file_of(std::uint32_t tile) const;
  /// The path with the token instead of the tile; for by_number(), `<UDIM>` or `<UVTILE>` replaces the number.
  std::filesystem::path token_path() const;
  /// The tiles whose files exist, in ascending order.
  std::vector<std::uint32_t> files() const;
  std::uint32_t number() const { return number_; }  ///< The tile in the name that by_number() got.

 private:
  std::filesystem::path folder_;
  std::string before_, after_, token_;
  bool by_columns_ = false;  ///< true: tiles are written as u1_v1; false: as numbers from 1001
  std::uint32_t number_ = 0;
};

/// True if a name contains a token, or a number of a tile.
bool names_tile(const std::filesystem::path& path);

/// Numbers of triangles by the tile of their centroids. Tile 0: outside UDIM's tiles, or without UVs.
using TileCounts = std::map<std::uint32_t, std::uint64_t>;
/// The placement of a material's picture: UV set and transform, as in MaterialPicture.
struct PicturePlace {
  std::uint32_t uv_set = 0;
  std::array<float, 6> uv_transform = {1, 0, 0, 0, 1, 0};
};
/// Counts the triangles of each material by tile. \param places  one per material. A set that the mesh lacks is
/// replaced by the mesh's own
std::vector<TileCounts> count_tiles(const Mesh& mesh, std::span<const PicturePlace> places);
/// Counts all triangles of a mesh by tile.
TileCounts count_tiles(const Mesh& mesh);

/// The meaning of a picture's file name for a mesh.
struct TileFiles {
  /// The UV tiles and their files, in ascending order; empty for a single picture
  std::vector<std::pair<std::uint32_t, std::filesystem::path>> tiles;
  std::string note;  ///< The text of a warning ("udim-siblings"); empty if there is none
};

/// Decides whether a file name means a UDIM set. A token always does: the set consists of the tiles that have files and
/// that the mesh uses, or of all files if there is no mesh or it uses none of them. A number does if the mesh's UVs
/// leave the first tile, another tile that they reach has a file, and tiles with files hold at least half of the
/// triangles; otherwise pictures with unrelated numbers would no longer repeat. In both cases there is a note.
/// \param counts     of the mesh; null: unknown
/// \param is_others  true for files that other materials name
TileFiles find_tiles(const std::filesystem::path& picture, const TileCounts* counts,
                     const std::function<bool(const std::filesystem::path&)>& is_others = {});

}  // namespace kiln
