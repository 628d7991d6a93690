// Pictures of UDIM sets: files whose names contain the tile of UV space.
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

#include "kiln/material.h"
#include "kiln/mesh.h"
#include "kiln/texture.h"

namespace kiln {

/// Key that note_answer() records for a set: the existing tiles of a name with a token, "1001 1002
/// ".
inline constexpr const char* kTilesQuestion = "tiles";

/// A file name with a placeholder for the tile's number.
class TileName {
 public:
  /// By a token: `<UDIM>` (1001 + u + 10 v), `<UVTILE>` (u1_v1, from 1 on), ignoring case, or Houdini's `%(UDIM)d`.
  /// None if the name has no token, or a file has exactly this name.
  static std::optional<TileName> by_token(const std::filesystem::path& path);
  /// By a separate number from 1001 to 1999, or u1_v1: the last one of the name. None without one.
  static std::optional<TileName> by_number(const std::filesystem::path& path);

  std::filesystem::path file_of(std::uint32_t tile) const;
  /// The path with the token in place of the tile; by_number() replaces the number by `<UDIM>` or `<UVTILE>`.
  std::filesystem::path token_path() const;
  /// Tiles whose files exist, in order.
  std::vector<std::uint32_t> files() const;
  std::uint32_t number() const { return number_; }  ///< Number in the name given to by_number()

 private:
  std::filesystem::path folder_;
  std::string before_, after_, token_;
  bool by_columns_ =
      false;  ///< true: the tile is written as u1_v1; false: as a number from 1001 on
  std::uint32_t number_ = 0;
};

/// True if a name has a token or a number.
bool names_tile(const std::filesystem::path& path);

/// Numbers of triangles by the tile of their centroids; tile 0: outside of UDIM's tiles, or without
/// UVs.
using TileCounts = std::map<std::uint32_t, std::uint64_t>;
/// Placement of a material's picture: its UV set and transform, as in MaterialPicture.
struct PicturePlace {
  std::uint32_t uv_set = 0;
  std::array<float, 6> uv_transform = {1, 0, 0, 0, 1, 0};
};
/// Counts per material of a mesh. \param places  one per material. A set that the mesh lacks is replaced
/// by its own
std::vector<TileCounts> count_tiles(const Mesh& mesh, std::span<const PicturePlace> places);
/// Counts of a whole mesh.
TileCounts count_tiles(const Mesh& mesh);

/// Interpretation of a picture's name for a mesh.
struct TileFiles {
  /// Tiles and their files, in order; empty for a single picture.
  std::vector<std::pair<std::uint32_t, std::filesystem::path>> tiles;
  std::string note;  ///< A warning ("udim-siblings"), or none
};

/// A token always means a set: the tiles that have files and that the mesh uses, or all files if there is no mesh or it
/// uses none of them. A number means a set if the mesh's UVs leave the first tile, another tile that they reach has a
/// file, and tiles with files hold at least half of the triangles: otherwise pictures with unrelated numbers would not
/// repeat any more. In both cases there is a note.
/// \param counts     of the mesh; null: unknown
/// \param is_others  true for files that other materials name
TileFiles find_tiles(const std::filesystem::path& picture, const TileCounts* counts,
                     const std::function<bool(const std::filesystem::path&)>& is_others = {});

}  // namespace kiln
