// Parses the header of a PLY file (Turk 1994).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asset/mesh_builder.h"
#include "asset/mesh_reader.h"

namespace kiln::ply {

enum class Encoding { ascii, little_endian, big_endian };
enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

/// The meaning of a property.
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
  Type count_type = Type::uint8;  ///< For a list, the type of its length
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
  /// Names from lines "comment TextureFile NAME", in order
  std::vector<std::string> texture_files;
  std::size_t body = 0;         ///< Offset of the body in bytes
  std::uint64_t body_line = 0;  ///< Number of the line at which the body starts, counted from 1
};

/// Names of the materials that are made for a file's pictures, one for each: the name of the
/// picture without its extension, or with it if two names would be equal.
std::vector<std::string> texture_names(const Header& header);
/// Name of the material of faces whose `texnumber` refers to no picture.
inline constexpr const char* kUntexturedMaterialName = "untextured";

std::size_t size_of(Type type);
bool is_integer_type(Type type);

/// Parses the header.
/// \throws Error(input) that names the line
Header parse_header(const MeshInput& input);

}  // namespace kiln::ply
