// OFF (Geomview's object file format, ASCII), read by Kiln itself: a half-edge mesh drops faces at edges
// that more than two share, and what is wrong with a file is said with its line.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "io/file/text_scanner.h"
#include "io/mesh/mesh_builder.h"

namespace kiln {
namespace {

class OffReader {
 public:
  explicit OffReader(const MeshInput& input)
      : input_(input), scan_(input.bytes, '#'), builder_(input) {}

  Mesh read() {
    header();
    for (std::uint64_t i = 0; i < vertices_; ++i) vertex(i);
    for (std::uint64_t i = 0; i < faces_; ++i) face(i);
    if (colored_ != 0) {
      if (const std::uint64_t bare = vertices_ - colored_) {
        input_.warn("missing-colors",
                    std::to_string(bare) + " vertices have no colour; they are white.", bare);
      }
    } else {
      builder_.colors.clear();
    }
    return builder_.finish();
  }

 private:
  [[noreturn]] void fail(const std::string& problem) {
    input_.fail(scan_.place(), problem, "Correct the line or export the mesh again.");
  }

  void header() {
    std::string_view word = scan_.token();
    if (!to_integer(word)) {  // the keyword may be absent
      std::string_view flags = word;
      const auto take = [&flags](std::string_view prefix) {
        if (!flags.starts_with(prefix)) return false;
        flags.remove_prefix(prefix.size());
        return true;
      };
      textured_ = take("ST");
      colors_ = take("C");
      normals_ = take("N");
      if (flags == "4OFF" || flags == "nOFF" || flags == "4nOFF") {
        fail("\"" + printable(word) + "\" has vertices of other than three dimensions");
      }
      if (flags != "OFF") fail("\"" + printable(word) + "\" is not the keyword of an OFF file");
      word = scan_.token();
      if (word == "BINARY") {
        input_.fail(scan_.place(), "it is a binary OFF file",
                    "Convert it to ASCII OFF or to PLY, for example with MeshLab.");
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
    // A vertex takes at least "0 0 0\n", a face "0\n"; the last line's end may be missing.
    const std::uint64_t left = scan_.remaining() + 1;
    if (vertices_ > left / 6 || faces_ > left / 2) {
      fail("the header promises " + std::to_string(vertices_) + " vertices and " +
           std::to_string(faces_) + " faces, more than the " + std::to_string(left - 1) +
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

  void vertex(std::uint64_t i) {
    MeshBuilder::Position p;
    p[0] = number(scan_.token(), i);
    p[1] = number(scan_.token_in_line(), i);
    p[2] = number(scan_.token_in_line(), i);
    builder_.positions.push_back(p);
    if (normals_) {
      double n[3];
      for (double& value : n) value = number(scan_.token_in_line(), i);
      builder_.normals.push_back({narrow(n[0]), narrow(n[1]), narrow(n[2])});
    }
    rest_.clear();
    for (std::string_view token = scan_.token_in_line(); !token.empty();
         token = scan_.token_in_line()) {
      rest_.push_back(token);
    }
    if (textured_) {
      if (rest_.size() < 2) fail("vertex " + std::to_string(i) + " has no texture coordinate");
      const double u = number(rest_[rest_.size() - 2], i), v = number(rest_[rest_.size() - 1], i);
      builder_.uvs.push_back({narrow(u), narrow(v)});
      rest_.resize(rest_.size() - 2);
    }
    std::array<std::uint8_t, 4> rgba{255, 255, 255, 255};
    if (colors_ && rest_.size() >= 3) {
      // Fractions where a token looks like one, else 0 to 255.
      const std::size_t channels = std::min<std::size_t>(rest_.size(), 4);
      double scale = 1;
      for (std::size_t k = 0; k < channels; ++k) {
        if (rest_[k].find_first_of(".eE") != std::string_view::npos) scale = 255;
      }
      for (std::size_t k = 0; k < channels; ++k) {
        const double value = number(rest_[k], i) * scale;
        rgba[k] = static_cast<std::uint8_t>(std::lround(value > 0 ? std::min(value, 255.0) : 0.0));
      }
      ++colored_;
    }
    if (colors_) builder_.colors.push_back(rgba);
  }

  void face(std::uint64_t i) {
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
             std::to_string(vertices_) + ", counted from 0");
      }
      corners_.push_back(static_cast<std::uint32_t>(*index));
    }
    scan_.next_line();  // a face's colour is not used
    using Indices = std::span<const std::uint32_t>;
    builder_.add_face(corners_, textured_ ? Indices(corners_) : Indices(),
                      normals_ ? Indices(corners_) : Indices());
  }

  const MeshInput& input_;
  TextScanner scan_;
  MeshBuilder builder_;
  bool textured_ = false, colors_ = false, normals_ = false;
  std::uint64_t vertices_ = 0, faces_ = 0, colored_ = 0;
  std::vector<std::string_view> rest_;
  std::vector<std::uint32_t> corners_;
};

}  // namespace

Mesh read_off(const MeshInput& input) { return OffReader(input).read(); }

}  // namespace kiln
