// Reads PLY. Every count and index is checked. A general loop reads files of any layout value by
// value. A faster path reads vertices of constant size, and faces that are all triangles, in binary
// files: in place, and on all threads. If it finds an invalid face, the general loop reads the
// faces again, and reports the first error with its position.
#include "asset/mesh_ply.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <type_traits>

#include "asset/materials.h"
#include "base/counted.h"
#include "base/formatted.h"
#include "base/parallel.h"
#include "io/file/text_scanner.h"
#include "io/file/unicode.h"

namespace kiln {
namespace {

using namespace ply;

template <typename T>
T load(const char* at, bool swap) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), at, sizeof(T));
  if (swap) std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<T>(bytes);
}

/// Reads values of a binary body. has() must be called before each value is read.
class BinarySource {
 public:
  BinarySource(const MeshInput& input, const Header& header)
      : at_(input.bytes.data() + header.body),
        begin_(input.bytes.data()),
        end_(input.bytes.data() + input.bytes.size()),
        is_byte_swapped_((header.encoding == Encoding::little_endian) !=
                         (std::endian::native == std::endian::little)) {}

  bool has(std::uint64_t bytes) const { return bytes <= remaining(); }
  std::uint64_t remaining() const { return static_cast<std::uint64_t>(end_ - at_); }
  std::uint64_t min_bytes_of(Type type) const { return size_of(type); }
  std::string place() const { return "byte " + std::to_string(at_ - begin_); }

  double number(Type type) {
    const char* at = at_;
    at_ += size_of(type);
    return number_at(at, type);
  }
  double number_at(const char* at, Type type) const {
    switch (type) {
      case Type::int8:
        return load<std::int8_t>(at, is_byte_swapped_);
      case Type::uint8:
        return load<std::uint8_t>(at, is_byte_swapped_);
      case Type::int16:
        return load<std::int16_t>(at, is_byte_swapped_);
      case Type::uint16:
        return load<std::uint16_t>(at, is_byte_swapped_);
      case Type::int32:
        return load<std::int32_t>(at, is_byte_swapped_);
      case Type::uint32:
        return load<std::uint32_t>(at, is_byte_swapped_);
      case Type::float32:
        return double{load<float>(at, is_byte_swapped_)};
      case Type::float64:
        return load<double>(at, is_byte_swapped_);
    }
    return 0;
  }
  void skip(Type type, std::uint64_t count) { at_ += size_of(type) * count; }
  /// Address of the next byte to read.
  const char* cursor() const { return at_; }
  std::uint32_t index_at(const char* at) const { return load<std::uint32_t>(at, is_byte_swapped_); }

 private:
  const char* at_;
  const char* begin_;
  const char* end_;
  bool is_byte_swapped_;
};

/// Reads values of an ASCII body, which are separated by blanks or line ends.
class AsciiSource {
 public:
  AsciiSource(const MeshInput& input, const Header& header)
      : input_(input), scan_(input.bytes.substr(header.body)), first_line_(header.body_line) {}

  bool has(std::uint64_t bytes) const { return bytes <= remaining(); }
  std::uint64_t remaining() const { return scan_.remaining() + 1; }
  /// A value takes at least a digit and a separator. The constructor accounts for a missing last
  /// separator.
  std::uint64_t min_bytes_of(Type) const { return 2; }
  std::string place() const { return "line " + std::to_string(first_line_ + scan_.line() - 1); }

  double number(Type) {
    const std::string_view token = scan_.token();
    if (const auto value = to_double(token)) return *value;
    if (token.empty())
      input_.fail(place(), "the file ends too early (truncated)", "Copy it again.");
    input_.fail(place(), "\"" + printable(token) + "\" is not a number",
                "Correct the line or export the mesh again.");
  }
  void skip(Type type, std::uint64_t count) {
    for (; count != 0; --count) number(type);
  }

 private:
  const MeshInput& input_;
  TextScanner scan_;
  std::uint64_t first_line_;
};

/// True if vertices or faces have colours.
bool has_colors(const Header& header) {
  return std::any_of(header.elements.begin(), header.elements.end(), [](const Element& element) {
    return (element.name == "vertex" || element.name == "face") &&
           std::any_of(element.properties.begin(), element.properties.end(),
                       [](const Property& property) { return property.role == Role::red; });
  });
}

template <typename Source>
class BodyReader {
 public:
  BodyReader(const MeshInput& input, const Header& header)
      : input_(input), header_(header), source_(input, header) {}

  /// Reads the whole body of the file into the builder.
  void read(MeshBuilder& builder) {
    textures_ = texture_names(header_);
    // Elements are read in the order of the file, since faces may precede the vertices.
    for (const Element& element : header_.elements) {
      if (element.name != "vertex") continue;
      vertices_ = element.count;
      vertex_normals_ = has(element, Role::nx);
      vertex_uvs_ = has(element, Role::u);
    }
    std::ptrdiff_t unread_elements = std::count_if(header_.elements.begin(), header_.elements.end(),
                                                   [](const Element& e) { return is_useful(e); });
    for (const Element& element : header_.elements) {
      if (unread_elements == 0) break;  // The remaining elements are not needed
      if (is_useful(element)) --unread_elements;
      check_size(element);
      if (element.name == "vertex") {
        if (!read_fixed_size_vertices(element, builder)) read_vertices(element, builder);
      } else if (element.name == "tristrips") {
        read_strips(element, builder);
      } else if (element.name != "face") {
        read_faces(element, builder, /*check_only=*/true);
      } else if (!read_triangles(element, builder)) {
        read_faces(element, builder, /*check_only=*/false);
      }
    }
    finish_textures(builder);
  }

 private:
  static bool is_useful(const Element& element) {
    return element.name == "vertex" || element.name == "face" || element.name == "tristrips";
  }

  static bool has(const Element& element, Role role) {
    return std::any_of(element.properties.begin(), element.properties.end(),
                       [role](const Property& property) { return property.role == role; });
  }

  [[noreturn]] void truncated(const Element& element, std::uint64_t index) {
    input_.fail(source_.place(),
                "the file ends at " + printable(element.name) + " " + std::to_string(index) +
                    " of " + std::to_string(element.count) + " (truncated)",
                "Copy or export it again.");
  }

  /// Checks that the rest of the file can hold the number of elements that the header declares,
  /// before memory is allocated for them.
  void check_size(const Element& element) {
    std::uint64_t min_bytes = 0;
    for (const Property& property : element.properties) {
      min_bytes += source_.min_bytes_of(property.list ? property.count_type : property.type);
    }
    if (min_bytes == 0 ? element.count > kMaxElements
                       : element.count > source_.remaining() / min_bytes) {
      input_.fail("header",
                  "it declares " + std::to_string(element.count) + " elements \"" +
                      printable(element.name) + "\", more than the file can hold (truncated)",
                  "Copy or export it again.");
    }
  }

  /// The values of one vertex or face, one for each Role of properties.
  class ElementValues {
   public:
    explicit ElementValues(const Element& element) : has_color(has(element, Role::red)) {
      for (const Property& property : element.properties) {
        if (property.role != Role::red) continue;
        float_color = !is_integer_type(property.type);
        if (property.type == Type::uint16) color_scale_ = 1 / 257.0;
      }
      (*this)[Role::alpha] = MeshBuilder::kFullAlpha;
    }
    double& operator[](Role role) { return values_[static_cast<std::size_t>(role)]; }
    double operator[](Role role) const { return values_[static_cast<std::size_t>(role)]; }
    std::array<double, 4> color() const {
      return {(*this)[Role::red], (*this)[Role::green], (*this)[Role::blue], (*this)[Role::alpha]};
    }
    std::array<std::uint8_t, 4> color_bytes() const {
      const auto channel = [&](double value) {
        const double c = value * color_scale_;
        return static_cast<std::uint8_t>(std::lround(c > 0 ? std::min(c, 255.0) : 0.0));
      };
      const auto [red, green, blue, alpha] = color();
      return {channel(red), channel(green), channel(blue), channel(alpha)};
    }
    bool has_color, float_color = false;

   private:
    std::array<double, static_cast<std::size_t>(Role::wedge_uvs) + 1> values_{};
    double color_scale_ = 1;
  };

  /// Reads vertices on all threads, if they have a constant size, and only coordinates, normals,
  /// UVs and 8-bit colours.
  /// \returns false for other vertices; in this case nothing is read
  bool read_fixed_size_vertices(const Element& element, MeshBuilder& builder) {
    if constexpr (!std::is_same_v<Source, BinarySource>) {
      return false;
    } else {
      struct Field {
        Role role;
        Type type;
        std::size_t offset;
      };
      std::vector<Field> record_fields;
      std::size_t size = 0;
      for (const Property& property : element.properties) {
        const Role role = property.role;
        const bool is_byte =
            role == Role::red || role == Role::green || role == Role::blue || role == Role::alpha;
        if (property.list || (is_byte ? property.type != Type::uint8 : role > Role::v))
          return false;
        if (role != Role::unused) record_fields.push_back({role, property.type, size});
        size += size_of(property.type);
      }
      if (size == 0 || reserved_uvs_ != 0 || element.count > source_.remaining() / size)
        return false;
      const bool colors = has(element, Role::red);
      builder.positions.resize(element.count);
      if (vertex_normals_) builder.normals.resize(element.count);
      if (vertex_uvs_) builder.uvs.resize(element.count);
      if (colors) builder.colors.resize(element.count, {0, 0, 0, 255});
      const char* const first = source_.cursor();
      parallel_for(element.count, kElementsAtOnce, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          for (const Field& field : record_fields) {
            const char* const at = first + i * size + field.offset;
            const auto single = [&] { return narrow(source_.number_at(at, field.type)); };
            switch (field.role) {
              case Role::x:
              case Role::y:
              case Role::z:
                builder.positions[i][index_from(field.role, Role::x)] =
                    source_.number_at(at, field.type);
                break;
              case Role::nx:
                builder.normals[i].x = single();
                break;
              case Role::ny:
                builder.normals[i].y = single();
                break;
              case Role::nz:
                builder.normals[i].z = single();
                break;
              case Role::u:
                builder.uvs[i].x = single();
                break;
              case Role::v:
                builder.uvs[i].y = single();
                break;
              default:
                if (!colors) break;
                builder.colors[i][index_from(field.role, Role::red)] =
                    static_cast<std::uint8_t>(*at);
            }
          }
        }
      });
      source_.skip(Type::uint8, size * element.count);
      return true;
    }
  }

  /// Reads faces on all threads, if all are triangles that have only indices.
  /// \returns false for other faces, or if an index is invalid; in this case nothing is read
  bool read_triangles(const Element& element, MeshBuilder& builder) {
    if constexpr (!std::is_same_v<Source, BinarySource>) {
      return false;
    } else {
      constexpr std::size_t kTriangleBytes = 13;
      if (element.properties.size() != 1 || element.count == 0 || !textures_.empty()) return false;
      const Property& list = element.properties[0];
      const bool has_only_triangles = list.list && list.role == Role::indices &&
                                      size_of(list.count_type) == 1 &&
                                      (list.type == Type::int32 || list.type == Type::uint32);
      if (!has_only_triangles || element.count > source_.remaining() / kTriangleBytes) return false;
      const char* const first = source_.cursor();
      if (*first != 3) return false;  // Checks the first face before memory is allocated for all
      const auto read_all = [&](std::span<Triangle> triangles) {
        std::atomic<bool> is_valid = true;
        parallel_for(triangles.size(), kElementsAtOnce, [&](std::size_t begin, std::size_t end) {
          bool is_good = is_valid;
          for (std::size_t i = begin; i < end && is_good; ++i) {
            const char* const at = first + i * kTriangleBytes;
            is_good = *at == 3;
            for (std::size_t k = 0; k < 3; ++k) {
              triangles[i][k] = source_.index_at(at + 1 + 4 * k);
              is_good = is_good && triangles[i][k] < vertices_;
            }
          }
          if (!is_good) is_valid = false;
        });
        return is_valid.load();
      };
      if (!builder.add_triangles(element.count, vertex_uvs_, vertex_normals_, read_all))
        return false;
      source_.skip(Type::uint8, kTriangleBytes * element.count);
      return true;
    }
  }

  void read_vertices(const Element& element, MeshBuilder& builder) {
    ElementValues value(element);
    const auto get = [&value](Role role) { return value[role]; };
    const auto single = [&](Role role) { return narrow(get(role)); };
    const bool tangents = has(element, Role::tx);
    builder.tangent_signs = has(element, Role::tw);
    builder.positions.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& property : element.properties) {
        if (property.list) {
          skip_list(element, property, i);
        } else {
          if (!source_.has(source_.min_bytes_of(property.type))) truncated(element, i);
          value[property.role] = source_.number(property.type);
        }
      }
      builder.positions.push_back({get(Role::x), get(Role::y), get(Role::z)});
      if (vertex_normals_) {
        builder.normals.push_back({single(Role::nx), single(Role::ny), single(Role::nz)});
      }
      if (vertex_uvs_ && i < reserved_uvs_) {
        builder.uvs[i] = {single(Role::u), single(Role::v)};
      } else if (vertex_uvs_) {
        builder.uvs.push_back({single(Role::u), single(Role::v)});
      }
      if (tangents) {
        builder.tangents.push_back(
            {{single(Role::tx), single(Role::ty), single(Role::tz)}, single(Role::tw)});
      }
      if (value.float_color) {
        builder.set_color(i, value.color());
      } else if (value.has_color) {
        builder.colors.push_back(value.color_bytes());
      }
    }
  }

  std::uint64_t list_length(const Element& element, const Property& property, std::uint64_t index) {
    if (!source_.has(source_.min_bytes_of(property.count_type))) truncated(element, index);
    const double length = source_.number(property.count_type);
    if (!(length >= 0) || length != std::floor(length)) {
      input_.fail(source_.place(),
                  printable(element.name) + " " + std::to_string(index) + " has a list of length " +
                      decimal(length),
                  "Export the mesh again.");
    }
    // All lengths that can pass this check are exact in double precision; larger ones fail it.
    if (length * static_cast<double>(source_.min_bytes_of(property.type)) >
        static_cast<double>(source_.remaining())) {
      truncated(element, index);
    }
    return static_cast<std::uint64_t>(length);
  }

  void skip_list(const Element& element, const Property& property, std::uint64_t index) {
    source_.skip(property.type, list_length(element, property, index));
  }

  void read_faces(const Element& element, MeshBuilder& builder, bool check_only) {
    if (element.properties.empty()) return;
    ElementValues value(element);
    const bool numbered = has(element, Role::texture_number),
               has_wedges = has(element, Role::wedge_uvs);
    if (!check_only) name_first_texture(builder, numbered);
    if (!check_only && vertex_uvs_ && has_wedges && builder.uvs.empty()) {
      // The vertices may follow later in the file. The UV of a vertex will have the same index as the vertex.
      for (const Element& other : header_.elements) {
        if (other.name == "vertex") check_size(other);
      }
      builder.uvs.resize(vertices_);
      reserved_uvs_ = vertices_;
    }
    std::vector<std::uint32_t> uv;
    using Indices = std::span<const std::uint32_t>;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      corners_.clear();
      wedge_uvs_.clear();
      for (const Property& property : element.properties) {
        if (!property.list) {
          if (!source_.has(source_.min_bytes_of(property.type))) truncated(element, i);
          if (property.role == Role::unused) {
            source_.skip(property.type, 1);
          } else {
            value[property.role] = source_.number(property.type);
          }
        } else if (property.role == Role::indices) {
          read_corners(element, property, i);
        } else if (property.role == Role::wedge_uvs && !check_only) {
          const std::uint64_t length = list_length(element, property, i);
          for (std::uint64_t k = 0; k < length; ++k) {
            wedge_uvs_.push_back(narrow(source_.number(property.type)));
          }
        } else {
          skip_list(element, property, i);
        }
      }
      if (check_only) continue;
      Indices uvs;
      if (vertex_uvs_) uvs = corners_;
      // UVs of corners (u and v alternating) take precedence over those of vertices, which cannot
      // represent seams.
      if (!corners_.empty() && wedge_uvs_.size() == 2 * corners_.size()) {
        uv.clear();
        for (std::size_t k = 0; k < corners_.size(); ++k) {
          uv.push_back(static_cast<std::uint32_t>(builder.uvs.size()));
          builder.uvs.push_back({wedge_uvs_[2 * k], wedge_uvs_[2 * k + 1]});
        }
        uvs = uv;
      } else if (has_wedges && corners_.size() >= 3) {
        bad_wedges_.add(i);
      }
      if (value.float_color) {
        builder.set_face_color(value.color());
      } else if (value.has_color) {
        builder.set_face_color_bytes(value.color_bytes());
      }
      if (numbered && !textures_.empty()) set_texture(builder, value[Role::texture_number], i);
      builder.add_face(corners_, uvs, vertex_normals_ ? Indices(corners_) : Indices());
    }
  }

  /// Assigns the first picture to faces that have no number of a picture.
  void name_first_texture(MeshBuilder& builder, bool numbered) {
    if (textures_.empty() || numbered) return;
    builder.set_material(textures_[0]);
    if (textures_.size() == 1) return;
    input_.warn("texture-numbers",
                "header: it names " + std::to_string(textures_.size()) +
                    " pictures (TextureFile), but its faces have no \"texnumber\": the first "
                    "picture is used for all faces.",
                textures_.size() - 1);
  }

  void set_texture(MeshBuilder& builder, double number, std::uint64_t face) {
    const bool is_valid_number = number >= 0 && number < static_cast<double>(textures_.size()) &&
                                 number == std::floor(number);
    if (!is_valid_number) bad_numbers_.add(face);
    const std::string& name =
        is_valid_number ? textures_[static_cast<std::size_t>(number)] : untextured_;
    if (&name == texture_) return;
    texture_ = &name;
    builder.set_material(name);
  }

  /// Removes the pictures of a mesh without UVs. Warns once about invalid UVs, and once about
  /// invalid numbers of pictures.
  void finish_textures(MeshBuilder& builder) {
    const auto warn = [&](const char* code, const FaceCount& what, const std::string& text) {
      if (what.count == 0) return;
      input_.warn(code,
                  counted(what.count, "face") + " (face " + std::to_string(what.first) +
                      (what.count == 1 ? ") " : " for one) ") + text,
                  what.count);
    };
    warn("bad-texcoords", bad_wedges_,
         std::string("without two numbers in \"texcoord\" for each corner: ") +
             (vertex_uvs_ ? "the UVs of the vertices are used there."
                          : "these corners have no UVs."));
    if (textures_.empty()) return;
    warn("texture-numbers", bad_numbers_,
         "with a \"texnumber\" that is none of its " + counted(textures_.size(), "picture") +
             " (TextureFile), numbered from 0: no picture is used there" +
             (has_colors(header_) ? ", and the colours of faces or vertices count." : "."));
    if (builder.uvs.empty()) {
      input_.warn("texture-without-uvs",
                  "header: it names " + counted(textures_.size(), "picture") +
                      " (TextureFile), but no UVs for them, so they are not read. Export the mesh "
                      "with texture coordinates.",
                  textures_.size());
      return;
    }
    builder.material_files.push_back(std::filesystem::path(input_.file).filename().string());
  }

  void read_corners(const Element& element, const Property& property, std::uint64_t face) {
    const std::uint64_t length = list_length(element, property, face);
    for (std::uint64_t k = 0; k < length; ++k) {
      add_corner(source_.number(property.type), "face ", face);
    }
  }

  void add_corner(double index, const char* kind, std::uint64_t number) {
    if (!(index >= 0 && index < static_cast<double>(vertices_)) || index != std::floor(index)) {
      const std::string text = formatted("%.12g", index);
      input_.fail(source_.place(),
                  kind + std::to_string(number) + " uses vertex " + text + ", but there are " +
                      std::to_string(vertices_) + ", numbered from 0",
                  "Export the mesh again.");
    }
    corners_.push_back(static_cast<std::uint32_t>(index));
  }

  /// Reads triangle strips, which scan archives use: lists of vertices in which -1 ends a strip.
  void read_strips(const Element& element, MeshBuilder& builder) {
    std::uint64_t strip_index = 0;
    name_first_texture(builder, false);
    corners_.clear();  // Discards the corners of the previous face
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& property : element.properties) {
        if (!property.list) {
          if (!source_.has(source_.min_bytes_of(property.type))) truncated(element, i);
          source_.skip(property.type, 1);
        } else if (property.role != Role::indices) {
          skip_list(element, property, i);
        } else {
          const std::uint64_t length = list_length(element, property, i);
          for (std::uint64_t k = 0; k < length; ++k) {
            const double index = source_.number(property.type);
            const bool ends = index == (property.type == Type::uint32 ? 4294967295.0 : -1.0);
            if (!ends) add_corner(index, "strip ", strip_index);
            if (ends || k + 1 == length) {
              add_strip(builder);
              ++strip_index;
            }
          }
        }
      }
    }
  }

  /// Adds the triangles of a strip. Every second one is reversed. Degenerate triangles only serve
  /// to change the direction of the strip, and are left out.
  void add_strip(MeshBuilder& builder) {
    const auto add = [&](std::span<const std::uint32_t> corners) {
      using Indices = std::span<const std::uint32_t>;
      builder.add_face(corners, vertex_uvs_ ? corners : Indices(),
                       vertex_normals_ ? corners : Indices());
    };
    // A strip that is too short is counted as a face with too few corners
    if (!corners_.empty() && corners_.size() < 3) add(corners_);
    for (std::size_t k = 2; k < corners_.size(); ++k) {
      std::array<std::uint32_t, 3> t{corners_[k - 2], corners_[k - 1], corners_[k]};
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      if (k % 2 != 0) std::swap(t[0], t[1]);
      add(t);
    }
    corners_.clear();
  }

  static std::size_t index_from(Role role, Role first) {
    return static_cast<std::size_t>(role) - static_cast<std::size_t>(first);
  }

  static constexpr std::uint64_t kMaxElements = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t kElementsAtOnce = std::size_t{1} << 16;

  const MeshInput& input_;
  const Header& header_;
  Source source_;
  std::uint64_t vertices_ = 0, reserved_uvs_ = 0;
  bool vertex_normals_ = false, vertex_uvs_ = false;
  std::vector<std::uint32_t> corners_;
  std::vector<float> wedge_uvs_;
  std::vector<std::string> textures_;  ///< Names of the materials
  /// Name of the material of the last face; null if there is none
  const std::string* texture_ = nullptr;
  const std::string untextured_ = kUntexturedMaterialName;
  /// Faces that a warning reports together.
  struct FaceCount {
    std::uint64_t count = 0, first = 0;
    void add(std::uint64_t face) {
      if (count++ == 0) first = face;
    }
  };
  FaceCount bad_wedges_, bad_numbers_;
};

/// Rejects headers without vertices, and faces or strips without a list of indices.
/// \throws Error(input)
void check_elements(const MeshInput& input, const Header& header) {
  const auto find = [&header](std::string_view name) {
    return std::find_if(header.elements.begin(), header.elements.end(),
                        [name](const Element& element) { return element.name == name; });
  };
  const auto vertex = find("vertex"), face = find("face"), missing = header.elements.end();
  if (vertex == missing) {
    input.fail("header", "it has no element \"vertex\"", "Export the mesh again.");
  }
  const auto strips = find("tristrips");
  const auto check_list = [&](const Element& element, const char* faces) {
    const auto lists = std::count_if(element.properties.begin(), element.properties.end(),
                                     [](const Property& p) { return p.role == Role::indices; });
    if (lists == 1) return;
    input.fail("header", std::string("its ") + faces + " need exactly one list \"vertex_indices\"",
               "Export the mesh again.");
  };
  if (face != missing && face->count != 0) check_list(*face, "faces");
  if (strips != missing && strips->count != 0) check_list(*strips, "triangle strips");
}

}  // namespace

std::vector<Material> read_ply_materials(const MeshInput& given,
                                         const std::filesystem::path& folder, FileFinder* finder) {
  MeshInput input = given;
  std::string converted;
  input.bytes = as_utf8(input.bytes, converted);
  input.warnings = nullptr;  // load_mesh() has reported these warnings already
  const Header header = parse_header(input);
  const std::vector<std::string> names = texture_names(header);
  std::vector<Material> materials;
  for (std::size_t i = 0; i < names.size(); ++i) {
    Material& material = materials.emplace_back();
    material.name = names[i];
    material.place = input.file + ": TextureFile " + std::to_string(i);
    std::string file = header.texture_files[i];
    std::replace(file.begin(), file.end(), '\\', '/');
    material.color_map.file = folder / std::filesystem::path(file);
    if (finder != nullptr) {
      material.color_map.file = finder->find(material.color_map.file, input.file + ": TextureFile");
    }
  }
  if (names.empty()) return materials;
  Material& untextured = materials.emplace_back();
  untextured.name = kUntexturedMaterialName;
  untextured.place = input.file + ": no TextureFile";
  untextured.vertex_color = has_colors(header);
  if (untextured.vertex_color) untextured.color_from = MaterialNumber::given;
  return materials;
}

Mesh read_ply(const MeshInput& input) {
  const Header header = parse_header(input);
  check_elements(input, header);
  MeshBuilder builder(input);
  if (header.encoding == Encoding::ascii) {
    BodyReader<AsciiSource>(input, header).read(builder);
  } else {
    BodyReader<BinarySource>(input, header).read(builder);
  }
  return builder.finish();
}

}  // namespace kiln
