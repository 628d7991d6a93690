#include "asset/obj_parser.h"

#include <algorithm>
#include <charconv>

#include "base/counted.h"

namespace kiln {
namespace {

std::string describe_index_out_of_range(std::uint64_t face, std::int64_t index, const char* what,
                                        std::size_t pool) {
  return "face " + std::to_string(face) + " uses " + what + " " + std::to_string(index) +
         ", but there are " + std::to_string(pool);
}

}  // namespace

void ObjParser::parse(std::string_view lines) {
  scan_ = TextScanner(lines, '#', true, scan_.line());
  do {
    const std::string_view comment = scan_.comment();
    if (comment.starts_with("#MRGB ")) parse_polypaint(comment.substr(6));
    const std::string_view keyword = scan_.token_in_line();
    if (!keyword.empty()) parse_statement(keyword);
  } while (scan_.next_line());
}

void ObjParser::finish() {
  finish_polypaint();
  check_forward_references();
  if (ignored_ != 0) {
    input_.warn("ignored-statements",
                counted(ignored_, "statement") +
                    (ignored_ == 1 ? " of a kind that Kiln does not use (\""
                                   : " of kinds that Kiln does not use (\"") +
                    ignored_example_ +
                    (ignored_ == 1 ? "\") was ignored." : "\" for one) were ignored."),
                ignored_);
  }
  if (bad_polypaint_ != 0) {
    input_.warn("bad-polypaint",
                counted(bad_polypaint_, "colour") + " in its #MRGB lines (" +
                    bad_polypaint_example_ +
                    (bad_polypaint_ == 1 ? ") is not" : " for one) are not") +
                    " eight hexadecimal digits, or " +
                    (bad_polypaint_ == 1 ? "belongs to no vertex, and was ignored."
                                         : "belong to no vertex, and were ignored."),
                bad_polypaint_);
  }
  warn_of_zeros(zero_uvs_, "texture coordinate");
  warn_of_zeros(zero_normals_, "normal");
}

void ObjParser::parse_statement(std::string_view keyword) {
  if (keyword == "v") {
    parse_vertex();
  } else if (keyword == "vt") {
    parse_texture_coordinate();
  } else if (keyword == "vn") {
    double n[3];
    for (double& value : n) value = number("a normal has three numbers");
    add_normal({narrow(n[0]), narrow(n[1]), narrow(n[2])});
    ++normals_;
  } else if (keyword == "f") {
    parse_face();
  } else if (keyword == "g" || keyword == "o") {
    const std::string_view name = scan_.rest_of_line();
    set_group(name);
    if (keyword == "o") set_object(name);
  } else if (keyword == "usemtl") {
    set_material(scan_.rest_of_line());
  } else if (keyword == "mtllib") {
    parse_material_files(scan_.rest_of_line());
  } else if (keyword == "s") {
    set_smoothing(scan_.token_in_line());
  } else {
    if (ignored_++ == 0) ignored_example_ = scan_.place() + ": " + printable(keyword);
  }
}

/// Parses "mtllib": one name, which may contain blanks as some exporters write it, or several
/// names that end in ".mtl".
void ObjParser::parse_material_files(std::string_view names) {
  const auto add = [this](std::string_view name) {
    while (name.starts_with(' ') || name.starts_with('\t')) name.remove_prefix(1);
    if (name.size() > 1 && name.starts_with('"') && name.ends_with('"')) {
      name = name.substr(1, name.size() - 2);
    }
    if (!name.empty()) add_material_file(name);
  };
  for (std::size_t offset = 0; offset < names.size();) {
    offset = std::min(names.find_first_of(" \t", offset), names.size());
    std::string_view word = names.substr(0, offset);
    if (word.ends_with('"')) word.remove_suffix(1);
    const std::string_view ending =
        word.substr(word.size() - std::min<std::size_t>(4, word.size()));
    if (ending == ".mtl" || ending == ".MTL") {
      add(names.substr(0, offset));
      names.remove_prefix(offset);
      offset = 0;
    }
    offset = std::min(names.find_first_not_of(" \t", offset), names.size());
  }
  add(names);
}

/// Parses the colours that ZBrush writes: MMRRGGBB in hexadecimal digits for each vertex before,
/// where MM is a mask.
void ObjParser::parse_polypaint(std::string_view digits) {
  while (digits.starts_with(' ')) digits.remove_prefix(1);
  for (; digits.size() >= 8; digits.remove_prefix(8)) {
    std::uint32_t value = 0;
    const auto [stop, status] = std::from_chars(digits.data(), digits.data() + 8, value, 16);
    if (status != std::errc() || stop != digits.data() + 8) break;
    polypaint_.push_back(value);
  }
  if (!digits.empty() && bad_polypaint_++ == 0) bad_polypaint_example_ = scan_.place();
}

/// Assigns the colours that ZBrush wrote. There is a block of them after the vertices of each
/// object.
void ObjParser::finish_polypaint() {
  if (polypaint_.size() > vertices_) {
    bad_polypaint_ += polypaint_.size() - vertices_;
    if (bad_polypaint_example_.empty()) bad_polypaint_example_ = scan_.place();
    polypaint_.resize(vertices_);
  }
  std::size_t vertex = vertices_ - polypaint_.size();
  for (const std::uint32_t value : polypaint_) {
    const auto byte = [value](int shift) { return static_cast<std::uint8_t>(value >> shift); };
    set_color_bytes(vertex++, {byte(16), byte(8), byte(0), 255});
  }
  polypaint_.clear();
}

double ObjParser::number(const char* rule) {
  const std::string_view token = scan_.token_in_line();
  if (const auto value = to_double(token)) return *value;
  const std::string problem =
      token.empty() ? "a number is missing" : "\"" + printable(token) + "\" is not a number";
  input_.fail(scan_.place(), problem + " (" + rule + ")",
              "Correct the line or export the mesh again.");
}

void ObjParser::parse_vertex() {
  if (!polypaint_.empty()) finish_polypaint();
  MeshBuilder::Position p;
  for (double& value : p) value = number("a vertex has x, y and z");
  double extra_values[4];
  int count = 0;
  for (std::string_view token = scan_.token_in_line(); !token.empty() && count < 4;
       token = scan_.token_in_line()) {
    const auto value = to_double(token);
    if (!value) {
      input_.fail(scan_.place(), "\"" + printable(token) + "\" is not a number",
                  "Correct the line or export the mesh again.");
    }
    extra_values[count++] = *value;
  }
  if (count >= 3) {  // x y z r g b [a]; a single number after x y z is a weight
    add_color({extra_values[0], extra_values[1], extra_values[2],
               count == 4 ? extra_values[3] : MeshBuilder::kFullAlpha});
  }
  add_vertex(p);
  ++vertices_;
}

void ObjParser::parse_texture_coordinate() {
  const double u = number("a texture coordinate has u and v");
  double v = 0;
  if (const std::string_view token = scan_.token_in_line(); !token.empty()) {
    const auto value = to_double(token);
    if (!value) {
      input_.fail(scan_.place(), "\"" + printable(token) + "\" is not a number",
                  "Correct the line or export the mesh again.");
    }
    v = *value;
  }
  add_uv({narrow(u), narrow(v)});
  ++uvs_;
}

/// Converts an index in the file, which is 1-based or negative, to a 0-based one.
std::uint32_t ObjParser::resolve_index(std::string_view text, std::size_t pool, LargestIndex& reach,
                                       const char* what) {
  const auto index = to_integer(text);
  if (!index) {
    input_.fail(scan_.place(),
                "face " + std::to_string(faces_) + " has \"" + printable(text) + "\" where a " +
                    what + " index belongs",
                "Correct the line or export the mesh again.");
  }
  const auto size = static_cast<std::int64_t>(pool);
  if (*index == 0 || *index < -size || *index > 0x7FFFFFFF) {
    input_.fail(scan_.place(), describe_index_out_of_range(faces_, *index, what, pool),
                "Indices start at 1, or count backwards from -1; export the mesh again.");
  }
  if (*index < 0) return static_cast<std::uint32_t>(size + *index);
  if (static_cast<std::uint64_t>(*index) > reach.index) {
    reach = {static_cast<std::uint64_t>(*index), scan_.line()};
  }
  return static_cast<std::uint32_t>(*index - 1);
}

/// True if a corner has an index of a UV or a normal. Cinema 4D and other programs write 0 if
/// there is none.
bool ObjParser::has_index(std::string_view text, ZeroIndices& zeros) const {
  if (text.empty()) return false;
  if (to_integer(text) != 0) return true;
  if (zeros.count++ == 0) zeros.first = scan_.place();
  return false;
}
void ObjParser::warn_of_zeros(const ZeroIndices& zeros, const char* what) const {
  if (zeros.count == 0) return;
  input_.warn("zero-indices",
              zeros.first + ": " + counted(zeros.count, "corner") +
                  (zeros.count == 1 ? "" : " (this is the first)") +
                  (zeros.count == 1 ? " has" : " have") + " 0 for the index of a " + what +
                  ", which counts from 1: these corners get none.",
              zeros.count);
}

void ObjParser::parse_face() {
  vertex_.clear();
  uv_.clear();
  normal_.clear();
  bool has_any_uv = false, has_any_normal = false;
  for (std::string_view token = scan_.token_in_line(); !token.empty();
       token = scan_.token_in_line()) {
    std::string_view part[3];
    for (int i = 0; i < 3; ++i) {
      const std::size_t slash = i < 2 ? token.find('/') : std::string_view::npos;
      part[i] = token.substr(0, slash);
      if (slash == std::string_view::npos) break;
      token.remove_prefix(slash + 1);
    }
    vertex_.push_back(resolve_index(part[0], vertices_, largest_vertex_index_, "vertex"));
    uv_.push_back(MeshBuilder::kNone);
    normal_.push_back(MeshBuilder::kNone);
    if (has_index(part[1], zero_uvs_)) {
      uv_.back() = resolve_index(part[1], uvs_, largest_uv_index_, "texture coordinate");
      has_any_uv = true;
    }
    if (has_index(part[2], zero_normals_)) {
      normal_.back() = resolve_index(part[2], normals_, largest_normal_index_, "normal");
      has_any_normal = true;
    }
  }
  add_face(vertex_, has_any_uv ? Indices(uv_) : Indices(),
           has_any_normal ? Indices(normal_) : Indices());
  ++faces_;
}

void ObjParser::check_forward_references() {
  const auto check = [this](const LargestIndex& reach, std::size_t pool, const char* what) {
    if (reach.index <= pool) return;
    input_.fail("line " + std::to_string(reach.line),
                std::string("a face uses ") + what + " " + std::to_string(reach.index) +
                    ", but there are " + std::to_string(pool),
                "The file may be cut off; export the mesh again.");
  };
  check(largest_vertex_index_, vertices_, "vertex");
  check(largest_uv_index_, uvs_, "texture coordinate");
  check(largest_normal_index_, normals_, "normal");
}

}  // namespace kiln
