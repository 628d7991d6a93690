#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "kiln/types.h"

namespace kiln {

/// An indexed triangle mesh with optional per-corner ("wedge") UVs and normals.
///
/// Every optional attribute is either empty or complete. Index arrays are parallel to `triangles`.
/// Triangles keep the order of the file (polygons are split in place), and no triangle is ever left
/// out: degenerate ones and ones with a non-finite corner stay, and are skipped where they are used.
struct Mesh {
  std::string name;                 ///< Stem of the file, or any name; used in messages.
  std::array<double, 3> origin{};   ///< World position of a vertex = origin + positions[i]. Readers
                                    ///< set it where single precision would lose detail.
  std::vector<Vec3> positions;      ///< One per vertex, in the file's units.
  std::vector<Triangle> triangles;  ///< Indices into positions.

  std::vector<Vec2> uvs;               ///< Pool of texture coordinates, origin at the lower left.
  std::vector<Triangle> uv_triangles;  ///< Indices into uvs; empty where there are no UVs.
  std::vector<Vec3> normals;           ///< Pool of unit normals.
  std::vector<Triangle> normal_triangles;  ///< Indices into normals; empty: computed when needed.

  std::vector<std::array<std::uint8_t, 4>> colors;  ///< RGBA per vertex, or empty.
  std::vector<std::uint32_t> groups;  ///< Per triangle, index into group_names, or empty.
  std::vector<std::string> group_names;
};

/// Reads a mesh: PLY (ascii, binary of either byte order), OBJ, STL, OFF, chosen by extension.
///
/// \param path      the file
/// \param warnings  where to append what was imperfect but handled; may be null
/// \throws Error(input) names the file, the place and the remedy; nothing else happens.
/// Cost: about 0.5 s for a binary PLY of a million faces on one core.
Mesh load_mesh(const std::filesystem::path& path, std::vector<Warning>* warnings = nullptr);

/// Writes a Wavefront OBJ (positions, UVs, normals, groups) with 9 significant digits, so that
/// reading it back gives the same floats. The file appears whole or not at all.
/// \throws Error(output)
void save_obj(const Mesh& mesh, const std::filesystem::path& path);

}  // namespace kiln
