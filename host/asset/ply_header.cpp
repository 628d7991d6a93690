#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <utility>

#include "asset/mesh_ply.h"
#include "base/counted.h"
#include "base/lower_case.h"
#include "io/file/text_scanner.h"

namespace kiln::ply {
namespace {

std::optional<Type> parse_type(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, Type>, 16> kTypes{
      {{"char", Type::int8},
       {"int8", Type::int8},
       {"uchar", Type::uint8},
       {"uint8", Type::uint8},
       {"short", Type::int16},
       {"int16", Type::int16},
       {"ushort", Type::uint16},
       {"uint16", Type::uint16},
       {"int", Type::int32},
       {"int32", Type::int32},
       {"uint", Type::uint32},
       {"uint32", Type::uint32},
       {"float", Type::float32},
       {"float32", Type::float32},
       {"double", Type::float64},
       {"float64", Type::float64}}};
  for (const auto& [known, type] : kTypes) {
    if (known == name) return type;
  }
  return std::nullopt;
}

Role vertex_role(std::string_view name) {
  static constexpr std::pair<std::string_view, Role> kRoles[] = {{"x", Role::x},
                                                                 {"y", Role::y},
                                                                 {"z", Role::z},
                                                                 {"nx", Role::nx},
                                                                 {"ny", Role::ny},
                                                                 {"nz", Role::nz},
                                                                 {"normal_x", Role::nx},
                                                                 {"normal_y", Role::ny},
                                                                 {"normal_z", Role::nz},
                                                                 {"u", Role::u},
                                                                 {"v", Role::v},
                                                                 {"s", Role::u},
                                                                 {"t", Role::v},
                                                                 {"texture_u", Role::u},
                                                                 {"texture_v", Role::v},
                                                                 {"texture_s", Role::u},
                                                                 {"texture_t", Role::v},
                                                                 {"texcoord_u", Role::u},
                                                                 {"texcoord_v", Role::v},
                                                                 {"tex_u", Role::u},
                                                                 {"tex_v", Role::v},
                                                                 {"tex_s", Role::u},
                                                                 {"tex_t", Role::v},
                                                                 {"texcoord_s", Role::u},
                                                                 {"texcoord_t", Role::v},
                                                                 {"texcoord_x", Role::u},
                                                                 {"texcoord_y", Role::v},
                                                                 {"tu", Role::u},
                                                                 {"tv", Role::v},
                                                                 {"s0", Role::u},
                                                                 {"t0", Role::v},
                                                                 {"u0", Role::u},
                                                                 {"v0", Role::v},
                                                                 {"uv_u", Role::u},
                                                                 {"uv_v", Role::v},
                                                                 {"red", Role::red},
                                                                 {"green", Role::green},
                                                                 {"blue", Role::blue},
                                                                 {"diffuse_red", Role::red},
                                                                 {"diffuse_green", Role::green},
                                                                 {"diffuse_blue", Role::blue},
                                                                 {"r", Role::red},
                                                                 {"g", Role::green},
                                                                 {"b", Role::blue},
                                                                 {"alpha", Role::alpha},
                                                                 {"diffuse_alpha", Role::alpha},
                                                                 {"tx", Role::tx},
                                                                 {"ty", Role::ty},
                                                                 {"tz", Role::tz},
                                                                 {"tw", Role::tw},
                                                                 {"tangent_x", Role::tx},
                                                                 {"tangent_y", Role::ty},
                                                                 {"tangent_z", Role::tz},
                                                                 {"tangent_w", Role::tw}};
  for (const auto& [known, role] : kRoles) {
    if (known == name) return role;
  }
  return Role::unused;
}

/// Splits the header into lines. They end with LF, CR LF or CR, as the first line does. In a binary
/// file, the byte after "end_header" may have any value.
class HeaderLines {
 public:
  explicit HeaderLines(std::string_view text) : text_(text) {
    const std::size_t end = text.find_first_of("\r\n");
    if (end == std::string_view::npos) return;
    ending_ = text[end] == '\n'                                ? "\n"
              : end + 1 < text.size() && text[end + 1] == '\n' ? "\r\n"
                                                               : "\r";
  }
  std::optional<std::string_view> next() {
    if (ending_.empty()) return std::nullopt;
    const std::size_t end = text_.find(ending_, at_);
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view line = text_.substr(at_, end - at_);
    at_ = end + ending_.size();
    ++number_;
    return line;
  }
  std::size_t offset() const { return at_; }
  std::uint64_t number() const { return number_; }

 private:
  std::string_view text_, ending_;
  std::size_t at_ = 0;
  std::uint64_t number_ = 0;
};

/// Marks properties as unused if they occur twice, or if others of their set are missing, such as y of x, y, z.
class RoleCheck {
 public:
  explicit RoleCheck(Element& element) : element_(element) {
    auto& properties = element.properties;
    for (auto property = properties.begin(); property != properties.end(); ++property) {
      if (property->role == Role::unused || property->role == Role::indices) continue;
      const bool is_repeated =
          std::any_of(properties.begin(), property,
                      [&](const Property& other) { return other.role == property->role; });
      if (is_repeated) drop_role(*property);
    }
  }

  void keep_if_complete(std::initializer_list<Role> set, std::optional<Role> more = {}) {
    if (std::all_of(set.begin(), set.end(), [&](Role r) { return count(element_, r) == 1; }))
      return;
    for (Property& property : element_.properties) {
      if (std::find(set.begin(), set.end(), property.role) != set.end() || property.role == more) {
        drop_role(property);
      }
    }
  }

  /// Warns of the properties that are ignored.
  /// \param owners  "vertices" or "faces"
  void warn(const MeshInput& input, const char* owners) const {
    if (unused_properties_ == 0) return;
    input.warn(
        "unused-properties",
        "header: " + counted(unused_properties_, "property", "properties") + " of its " + owners +
            (unused_properties_ == 1 ? " occurs twice, or without the others of its set (\"" +
                                           example_ + "\"), and was ignored."
                                     : " occur twice, or without the others of their set (\"" +
                                           example_ + "\" for example), and were ignored."),
        unused_properties_);
  }

  static std::ptrdiff_t count(const Element& element, Role role) {
    return std::count_if(element.properties.begin(), element.properties.end(),
                         [role](const Property& property) { return property.role == role; });
  }

 private:
  void drop_role(Property& property) {
    property.role = Role::unused;
    if (unused_properties_++ == 0) example_ = printable(property.name);
  }

  Element& element_;
  std::uint64_t unused_properties_ = 0;
  std::string example_;
};

/// Checks that the vertices have positions, and ignores incomplete sets of properties, such as normals without nz. If
/// a set occurs several times, the first one is used.
void check_vertex_properties(const MeshInput& input, Element& vertex) {
  for (const Role role : {Role::x, Role::y, Role::z}) {
    const std::ptrdiff_t count = RoleCheck::count(vertex, role);
    if (count == 1) continue;
    const char name[] = {"xyz"[static_cast<int>(role) - static_cast<int>(Role::x)], 0};
    input.fail("header",
               std::string("its vertices have ") + (count == 0 ? "no" : "more than one") +
                   " property \"" + name + "\"",
               "A vertex needs exactly x, y and z; export the mesh again.");
  }
  RoleCheck check(vertex);
  check.keep_if_complete({Role::nx, Role::ny, Role::nz});
  check.keep_if_complete({Role::u, Role::v});
  check.keep_if_complete({Role::red, Role::green, Role::blue}, Role::alpha);
  check.keep_if_complete({Role::tx, Role::ty, Role::tz}, Role::tw);
  check.warn(input, "vertices");
}

void check_face_properties(const MeshInput& input, Element& face) {
  RoleCheck check(face);
  check.keep_if_complete({Role::red, Role::green, Role::blue}, Role::alpha);
  check.warn(input, "faces");
}

/// The role of a scalar property of faces, by its name.
Role face_role(std::string_view name) {
  if (name == "texnumber") return Role::texture_number;
  const Role role = vertex_role(name);
  const bool color =
      role == Role::red || role == Role::green || role == Role::blue || role == Role::alpha;
  return color ? role : Role::unused;
}

/// The picture that a comment names, by the convention of VCGLib and most photogrammetry programs;
/// empty if it names none.
std::string_view texture_file(TextScanner& scan) {
  if (lower_case(scan.token_in_line()) != "texturefile") return {};
  std::string_view name = scan.rest_of_line();
  if (name.size() > 1 && name.starts_with('"') && name.ends_with('"')) {
    name = name.substr(1, name.size() - 2);
  }
  return name;
}

}  // namespace

bool is_integer_type(Type type) { return type != Type::float32 && type != Type::float64; }

std::size_t size_of(Type type) {
  static constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<int>(type)];
}

std::vector<std::string> texture_names(const Header& header) {
  const auto stem = [](std::string file) {
    std::replace(file.begin(), file.end(), '\\', '/');
    return std::filesystem::path(file).stem().string();
  };
  std::vector<std::string> names;
  for (const std::string& file : header.texture_files) {
    const bool shared = std::any_of(
        header.texture_files.begin(), header.texture_files.end(),
        [&](const std::string& other) { return other != file && stem(other) == stem(file); });
    names.push_back(shared || stem(file) == kUntexturedMaterialName ? file : stem(file));
  }
  return names;
}

Header parse_header(const MeshInput& input) {
  Header header;
  HeaderLines lines(input.bytes);
  const auto fail = [&](const std::string& problem) {
    input.fail("line " + std::to_string(lines.number()), problem, "Export the mesh again.");
  };
  bool has_format = false;
  std::uint64_t unknown_lines = 0;
  std::string unknown_line_example;
  for (;;) {
    const auto line = lines.next();
    if (!line) fail("the header has no \"end_header\" (truncated)");
    TextScanner scan(*line);
    const std::string_view word = scan.token_in_line();
    if (lines.number() == 1) {
      if (word != "ply") fail("the file does not start with \"ply\"");
    } else if (word == "end_header") {
      break;
    } else if (word == "format") {
      const std::string_view name = scan.token_in_line();
      if (name == "ascii") {
        header.encoding = Encoding::ascii;
      } else if (name == "binary_little_endian") {
        header.encoding = Encoding::little_endian;
      } else if (name == "binary_big_endian") {
        header.encoding = Encoding::big_endian;
      } else {
        fail("unknown format \"" + printable(name) + "\"");
      }
      has_format = true;
    } else if (word == "element") {
      Element element;
      element.name = scan.token_in_line();
      const std::string_view count = scan.token_in_line();
      const auto value = to_integer(count);
      if (!value || *value < 0) {
        fail("element \"" + printable(element.name) + "\" has \"" + printable(count) +
             "\" instead of its count");
      }
      element.count = static_cast<std::uint64_t>(*value);
      for (const Element& other : header.elements) {
        if (other.name == element.name)
          fail("element \"" + printable(element.name) + "\" occurs twice");
      }
      header.elements.push_back(std::move(element));
    } else if (word == "property") {
      if (header.elements.empty()) fail("a property comes before any element");
      Property property;
      std::string_view type = scan.token_in_line();
      if (type == "list") {
        property.list = true;
        const std::string_view count_type = scan.token_in_line();
        const auto parsed_type = parse_type(count_type);
        if (!parsed_type || !is_integer_type(*parsed_type)) {
          fail("\"" + printable(count_type) +
               "\" is not an integer type, which the length of a list needs");
        }
        property.count_type = *parsed_type;
        type = scan.token_in_line();
      }
      const auto parsed_type = parse_type(type);
      if (!parsed_type) fail("\"" + printable(type) + "\" is not a type");
      property.type = *parsed_type;
      property.name = scan.token_in_line();
      if (property.name.empty()) fail("a property has no name");
      Element& element = header.elements.back();
      if (element.name == "vertex" && !property.list) property.role = vertex_role(property.name);
      if (element.name == "face" && !property.list) property.role = face_role(property.name);
      if ((element.name == "face" || element.name == "tristrips") && property.list) {
        if (property.name == "vertex_indices" || property.name == "vertex_index") {
          property.role = Role::indices;
          if (!is_integer_type(property.type)) fail("vertex indices must be of an integer type");
        } else if (property.name == "texcoord" && element.name == "face") {
          property.role = Role::wedge_uvs;
        }
      }
      element.properties.push_back(std::move(property));
    } else if (word == "comment" || word == "obj_info") {
      if (const std::string_view file = texture_file(scan); !file.empty()) {
        header.texture_files.emplace_back(file);
      }
    } else if (!word.empty()) {
      if (unknown_lines++ == 0) {
        unknown_line_example =
            "line " + std::to_string(lines.number()) + ": \"" + printable(*line) + "\"";
      }
    }
  }
  if (!has_format) fail("the header has no \"format\" line");
  for (Element& element : header.elements) {
    if (element.name == "vertex") check_vertex_properties(input, element);
    if (element.name == "face") check_face_properties(input, element);
  }
  if (unknown_lines != 0) {
    input.warn("ignored-header-lines",
               std::to_string(unknown_lines) + " lines of its header are no statements of PLY (" +
                   unknown_line_example + " for example) and were ignored.",
               unknown_lines);
  }
  header.body = lines.offset();
  header.body_line = lines.number() + 1;
  return header;
}

}  // namespace kiln::ply
