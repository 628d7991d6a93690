// Pictures of UDIM sets: files whose names hold the square of UV space that each lies on.
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

/// Of note_answer(): which tiles of a name with a token are there, "1001 1002 ".
inline constexpr const char* kTilesQuestion = "tiles";

/// A file's name with a place for the square's number.
class TileName {
 public:
  /// Of `<UDIM>` (1001 + u + 10 v), `<UVTILE>` (u1_v1, from 1 on), in capitals or not, or Houdini's `%(UDIM)d`. None: the
  /// name has none of them, or a file has that very name.
  static std::optional<TileName> by_token(const std::filesystem::path& path);
  /// Of a number from 1001 to 1999 by itself, or u1_v1: the last one of the name. None: it has none.
  static std::optional<TileName> by_number(const std::filesystem::path& path);

  std::filesystem::path file_of(std::uint32_t tile) const;
  /// With the token, or for by_number() with one in the number's place.
  std::filesystem::path with_token() const;
  /// The tiles that are files, in order.
  std::vector<std::uint32_t> files() const;
  std::uint32_t number() const { return number_; }  ///< Of the name that by_number() was given

 private:
  std::filesystem::path folder_;
  std::string before_, after_, token_;
  bool by_columns_ = false;  ///< u1_v1
  std::uint32_t number_ = 0;
};

/// True if a name has a token or a number.
bool names_tile(const std::filesystem::path& path);

/// Triangles by the tiles of their middles; tile 0: beyond UDIM's squares, or without UVs.
using TileCounts = std::map<std::uint32_t, std::uint64_t>;
/// Where a material's picture lies: its set of UVs, and its transform, as MaterialPicture has them.
struct PicturePlace {
  std::uint32_t uv_set = 0;
  std::array<float, 6> uv_transform = {1, 0, 0, 0, 1, 0};
};
/// Of each material of a mesh. \param places  one a material. A set that the mesh lacks counts as its own
std::vector<TileCounts> count_tiles(const Mesh& mesh, std::span<const PicturePlace> places);
/// Of all of a mesh.
TileCounts count_tiles(const Mesh& mesh);

/// What a picture's name means for a mesh.
struct TileFiles {
  /// Tiles and their files, in order; empty: the picture is one by itself.
  std::vector<std::pair<std::uint32_t, std::filesystem::path>> tiles;
  std::string note;  ///< A warning ("udim-siblings"), or none
};

/// A token is always a set: of those tiles that are files and that the mesh uses, or of all files without a mesh, or
/// where it uses none of them. A number is one where the mesh's UVs leave the first square, one of the squares that they
/// reach has a file, and so have squares with half of the triangles at least: else pictures with numbers that are no
/// tiles' would not repeat any more. Either way there is a note then.
/// \param counts     of the mesh; null: unknown
/// \param is_others  true for files that other materials name
TileFiles find_tiles(const std::filesystem::path& picture, const TileCounts* counts,
                     const std::function<bool(const std::filesystem::path&)>& is_others = {});

}  // namespace kiln
