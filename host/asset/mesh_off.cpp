// Reads OFF (Geomview's object file format, ASCII). Kiln has its own reader because a half-edge mesh would drop faces
// at non-manifold edges, and because errors must name the line.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "asset/mesh_builder.h"
#include "base/counted.h"
#include "io/file/text_scanner.h"

namespace kiln {
namespace {

class OffReader {
 public:
  explicit OffReader(const MeshInput& input)
      : input_(input), scan_(input.bytes, '#'), builder_(input) {}

  Mesh read() {
    header();
    if (colors_ && normals_ && has_negative_colors()) are_colors_first_ = !are_colors_first_;
    for (std::uint64_t i = 0; i < vertices_; ++i) parse_vertex(i);
    for (std::uint64_t i = 0; i < faces_; ++i) parse_face(i);
    if (indexed_color_count_ != 0) {
      input_.warn("color-indices",
                  counted(indexed_color_count_, "face") +
                      (indexed_color_count_ == 1 ? " has" : " have") +
                      " an index into a colour map that the file does not contain (face " +
                      std::to_string(first_indexed_color_) +
                      " for example): these faces get no colour. Export colours as three numbers.",
                  indexed_color_count_);
    }
    return builder_.finish();
  }

 private:
  [[noreturn]] void fail(const std::string& problem) {
    input_.fail(scan_.place(), problem, "Correct the line or export the mesh again.");
  }

  /// Parses the keyword "OFF", which prefix letters for vertex attributes may precede in any order.
  void parse_keyword(std::string_view word) {
    std::string_view attribute_letters = word;
    if (attribute_letters.ends_with("OFF") || attribute_letters == "off") {
      attribute_letters.remove_suffix(3);
    } else {
      fail("\"" + printable(word) + "\" is not the keyword of an OFF file");
    }
    while (!attribute_letters.empty()) {
      const std::size_t length = attribute_letters.starts_with("ST") ? 2 : 1;
      bool* const has = length == 2                   ? &has_uvs_
                        : attribute_letters[0] == 'C' ? &colors_
                        : attribute_letters[0] == 'N' ? &normals_
                        : attribute_letters[0] == '4' ? &is_homogeneous_
                        : attribute_letters[0] == 'n' ? &states_dimension_
                                                      : nullptr;
      if (has == nullptr || *has) {
        fail("\"" + printable(word) + "\" is not the keyword of an OFF file");
      }
      // With "CN", Geomview writes normals before colours, and MeshLab colours before normals.
      if (has == &colors_) are_colors_first_ = normals_;
      *has = true;
      attribute_letters.remove_prefix(length);
    }
  }

  void header() {
    std::string_view word = scan_.token();
    // The keyword is optional. If the first word is a number, it is the number of vertices
    if (!to_integer(word)) {
      parse_keyword(word);
      word = scan_.token();
      if (word == "BINARY") {
        input_.fail(scan_.place(), "it is a binary OFF file",
                    "Convert it to ASCII OFF or to PLY, for example with MeshLab.");
      }
      if (states_dimension_) {
        if (to_integer(word) != 3) {
          fail("its vertices have \"" + printable(word) + "\" dimensions; Kiln reads three");
        }
        word = scan_.token();
      }
    }
    const auto vertices = to_integer(word);
    const auto faces = to_integer(scan_.token_in_line());
    if (!vertices || !faces || *vertices < 0 || *faces < 0) {
      fail("the numbers of vertices and faces are missing");
    }
    vertices_ = static_cast<std::uint64_t>(*vertices);
    faces_ = static_cast<std::uint64_t>(*faces);
    scan_.next_line();
    // A vertex takes at least "0 0 0\n", and a face "0\n". The last line end may be missing, so one
    // byte is added.
    const std::uint64_t remaining_bytes = scan_.remaining() + 1;
    if (vertices_ > remaining_bytes / 6 || faces_ > remaining_bytes / 2) {
      fail("the header declares " + std::to_string(vertices_) + " vertices and " +
           std::to_string(faces_) + " faces, more than the " + std::to_string(remaining_bytes - 1) +
           " bytes after it can hold (truncated)");
    }
  }

  double number(std::string_view token, std::uint64_t i) {
    const auto value = to_double(token);
    if (value) return *value;
    if (scan_.remaining() == 0 && token.empty()) {
      fail("the file ends at vertex " + std::to_string(i) + " of " + std::to_string(vertices_) +
           " (truncated)");
    }
    fail("vertex " + std::to_string(i) + " has \"" + printable(token) +
         "\" where a number belongs");
  }

  /// Reads the numbers in the line of a vertex to `values_`.
  void read_numbers(std::uint64_t i) {
    values_.clear();
    std::string_view token = scan_.token();
    do {
      values_.push_back(number(token, i));
      token = scan_.token_in_line();
    } while (!token.empty());
    const std::size_t needed = corner_numbers() + (normals_ ? 3 : 0);
    if (values_.size() < needed) number({}, i);
    if (values_.size() < needed + (has_uvs_ ? 2 : 0)) {
      fail("vertex " + std::to_string(i) + " has no texture coordinate");
    }
  }
  std::size_t corner_numbers() const { return is_homogeneous_ ? 4 : 3; }
  /// Number of channels of the colour in `values_`: 0, 3 or 4.
  std::size_t channels() const {
    const std::size_t color_channels =
        values_.size() - corner_numbers() - (normals_ ? 3 : 0) - (has_uvs_ ? 2 : 0);
    return !colors_ || color_channels < 3 ? 0 : std::min<std::size_t>(color_channels, 4);
  }

  /// True if some colour would be negative in the order of colours and normals that the keyword
  /// implies, so that the other order is used.
  bool has_negative_colors() {
    const TextScanner line_start = scan_;
    bool is_negative = false;
    for (std::uint64_t i = 0; i < vertices_ && !is_negative; ++i) {
      read_numbers(i);
      const auto color = values_.begin() + static_cast<std::ptrdiff_t>(corner_numbers() +
                                                                       (are_colors_first_ ? 0 : 3));
      is_negative = std::any_of(color, color + static_cast<std::ptrdiff_t>(channels()),
                                [](double value) { return value < 0; });
    }
    scan_ = line_start;
    return is_negative;
  }

  void parse_vertex(std::uint64_t i) {
    read_numbers(i);
    const double* at = values_.data();
    const double w = is_homogeneous_ ? at[3] : 1;
    builder_.positions.push_back({at[0] / w, at[1] / w, at[2] / w});
    at += corner_numbers();
    const std::size_t channels = this->channels();
    const double* const color = at + (normals_ && !are_colors_first_ ? 3 : 0);
    const double* const normal = at + (are_colors_first_ ? channels : 0);
    if (normals_) {
      builder_.normals.push_back({narrow(normal[0]), narrow(normal[1]), narrow(normal[2])});
    }
    if (channels != 0) {
      builder_.set_color(
          i, {color[0], color[1], color[2], channels == 4 ? color[3] : MeshBuilder::kFullAlpha});
    }
    if (has_uvs_) {
      const double* const uv = values_.data() + values_.size() - 2;
      builder_.uvs.push_back({narrow(uv[0]), narrow(uv[1])});
    }
  }

  void parse_face(std::uint64_t i) {
    const std::string name = "face " + std::to_string(i);
    const std::string_view token = scan_.token();
    if (token.empty())
      fail("the file ends at " + name + " of " + std::to_string(faces_) + " (truncated)");
    const auto corners = to_integer(token);
    if (!corners || *corners < 0 || static_cast<std::uint64_t>(*corners) > scan_.remaining()) {
      fail(name + " has \"" + printable(token) + "\" where its number of corners belongs");
    }
    corners_.clear();
    for (std::int64_t k = 0; k < *corners; ++k) {
      const std::string_view text = scan_.token();
      const auto index = to_integer(text);
      if (!index) {
        fail(name + " has \"" + printable(text) + "\" where a vertex index belongs" +
             (text.empty() ? " (truncated)" : ""));
      }
      if (*index < 0 || static_cast<std::uint64_t>(*index) >= vertices_) {
        fail(name + " uses vertex " + std::to_string(*index) + ", but there are " +
             std::to_string(vertices_) + ", numbered from 0");
      }
      corners_.push_back(static_cast<std::uint32_t>(*index));
    }
    face_color(i);
    scan_.next_line();
    using Indices = std::span<const std::uint32_t>;
    builder_.add_face(corners_, has_uvs_ ? Indices(corners_) : Indices(),
                      normals_ ? Indices(corners_) : Indices());
  }

  /// Parses the colour at the end of a face's line: nothing, an index into a colour map, or three
  /// or four channels. It ends at the first word that is not a number.
  void face_color(std::uint64_t i) {
    values_.clear();
    for (std::string_view token = scan_.token_in_line(); !token.empty() && values_.size() < 4;
         token = scan_.token_in_line()) {
      const auto value = to_double(token);
      if (!value) break;
      values_.push_back(*value);
    }
    if (values_.size() >= 3) {
      builder_.set_face_color({values_[0], values_[1], values_[2],
                               values_.size() == 4 ? values_[3] : MeshBuilder::kFullAlpha});
    } else if (!values_.empty() && indexed_color_count_++ == 0) {
      first_indexed_color_ = i;
    }
  }

  const MeshInput& input_;
  TextScanner scan_;
  MeshBuilder builder_;
  /// Number of faces whose colour is an index, and the first of them
  std::uint64_t indexed_color_count_ = 0, first_indexed_color_ = 0;
  bool has_uvs_ = false, colors_ = false, normals_ = false;
  bool is_homogeneous_ = false;    ///< True: positions are x y z w
  bool states_dimension_ = false;  ///< True: a line gives the number of coordinates per vertex
  bool are_colors_first_ = false;  ///< True: colours precede normals
  std::uint64_t vertices_ = 0, faces_ = 0;
  std::vector<double> values_;  ///< The numbers in the line of a vertex
  std::vector<std::uint32_t> corners_;
};

}  // namespace

Mesh read_off(const MeshInput& input) { return OffReader(input).read(); }

}  // namespace kiln
