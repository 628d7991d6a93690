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
  std::size_t body = 0;         ///< Offset in bytes of the body, after the header
  std::uint64_t body_line = 0;  ///< Line at which the body starts, counted from 1
};

/// Names the materials of a file's pictures, one per picture: the picture's name without extension, or with it if two
/// would be equal.
std::vector<std::string> texture_names(const Header& header);
/// Name of the material for faces whose `texnumber` has no picture.
inline constexpr const char* kUntextured = "untextured";

std::size_t size_of(Type type);
bool integral(Type type);

/// Parses the header. \throws Error(input) with the line
Header parse_header(const MeshInput& input);

}  // namespace kiln::ply
