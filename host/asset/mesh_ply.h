// The header of a PLY file (Turk 1994), and the interface to OpenMesh's reader.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asset/mesh_builder.h"
#include "asset/mesh_reader.h"

namespace kiln::ply {

enum class Encoding { ascii, little_endian, big_endian };
enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

/// Roles of a property.
enum class Role {
  unused,
  x,
  y,
  z,
  nx,
  ny,
  nz,
  u,
  v,
  red,
  green,
  blue,
  alpha,
  tx,
  ty,
  tz,
  tw,
  texture_number,
  indices,
  wedge_uvs
};

struct Property {
  std::string name;
  Type type = Type::float32;
  bool list = false;
  Type count_type = Type::uint8;  ///< Type of a list's length.
  Role role = Role::unused;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::vector<std::string> texture_files;  ///< From lines "comment TextureFile NAME", in order
  std::size_t body = 0;                    ///< Offset of the first byte after the header.
  std::uint64_t body_line = 0;             ///< Its line, counted from 1.
};

/// Names of the materials of a file's pictures, one per picture: the picture's name without extension, or with it
/// if two would be equal.
std::vector<std::string> texture_names(const Header& header);
/// Name of the material of faces whose `texnumber` has no picture.
inline constexpr const char* kUntextured = "untextured";

std::size_t size_of(Type type);
bool integral(Type type);

/// \throws Error(input) with the line
Header parse_header(const MeshInput& input);

/// True if OpenMesh's reader preserves every bit of this file: binary; single-precision
/// coordinates; the vertices have only coordinates, normals, UVs and 8-bit colours under their
/// usual names; then faces with an index list only.
bool openmesh_reads(const Header& header);

/// Reads a binary file by OpenMesh, after its counts and indices were checked. An importer collects
/// the faces: a half-edge structure would refuse non-manifold ones. Calls are serialised, since
/// OpenMesh's readers are singletons with state.
/// \throws Error(input) if OpenMesh fails or disagrees about the counts
void read_with_openmesh(const MeshInput& input, const Header& header, MeshBuilder& builder);

}  // namespace kiln::ply
