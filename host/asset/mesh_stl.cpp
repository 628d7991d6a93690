// Reads STL. Kiln has its own reader because OpenMesh's drops degenerate triangles silently: it sorts corners in an
// ordered map, whose order NaN breaks.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "asset/mesh_builder.h"
#include "asset/stl_text.h"
#include "asset/stl_triangles.h"
#include "base/counted.h"

namespace kiln {
namespace {

/// Decodes the colours that some programs store in the two bytes after each triangle of a binary
/// STL, with 5 bits per channel. There are two conventions. VisCAM and SolidView set bit 15 of
/// triangles that have a colour; blue is in the lowest bits. Materialise Magics writes "COLOR=" and
/// a default colour to the header, and clears bit 15 of triangles that have their own colour; red
/// is in the lowest bits. MeshLab writes the header and the order of Magics, but sets bit 15 of all
/// triangles, which for Magics means that no triangle has a colour of its own. So if bit 15 is set
/// everywhere, the colours of triangles are used only if they differ.
class StlColors {
 public:
  explicit StlColors(const MeshInput& input) : bytes_(input.bytes) {
    constexpr std::string_view kMagicsPrefix = kStlColorPrefix;
    const std::string_view header = bytes_.substr(0, kStlHeaderBytes - 4);
    const std::size_t at = header.find(kMagicsPrefix);
    if (at == std::string_view::npos || at + kMagicsPrefix.size() + 4 > header.size()) return;
    std::array<std::uint8_t, 4> color;
    std::memcpy(color.data(), header.data() + at + kMagicsPrefix.size(), 4);
    default_color_ = color;
    // Programs that write only a default colour leave these bytes 0, which would otherwise mean
    // black triangles.
    const Bits bits = scan_bits();
    by_triangle_ = !bits.are_alike || bits.first != 0;
    mark_counts_ = !bits.are_all_marked;
    if (mark_counts_ || !by_triangle_) return;
    // After the colour in the header, MeshLab writes a blank, and Magics an alpha value.
    const bool is_meshlabs = header.substr(at + kMagicsPrefix.size() + 3).starts_with(" MATERIAL=");
    if (!bits.are_alike || is_meshlabs) return;
    mark_counts_ = true;
    const std::uint32_t color_bits = bits.first & ~kDefaultColorBit;
    const std::array<std::uint8_t, 3> channels = channels_of(color_bits);
    // Largest rounding error of 5-bit channels, in units of 1/255
    constexpr int kMaxRoundingError = 5;
    const bool matches_default = std::equal(channels.begin(), channels.end(), color.begin(),
                                            [](std::uint8_t a, std::uint8_t b) {
                                              return std::abs(int{a} - int{b}) <= kMaxRoundingError;
                                            });
    // Programs that write only a default colour set bit 15 of all triangles, or of none.
    if (matches_default || color_bits == 0 || color_bits == kDefaultColorBit - 1) return;
    input.warn(
        "stl-colors",
        "all triangles have the same colour, and are marked to use the colour in the header "
        "(COLOR=), which is used. To use their own colour, export PLY, or clear bit 15 of their "
        "attributes.",
        bits.count);
  }

  /// The colour of a triangle; nullopt if it has none.
  std::optional<std::array<std::uint8_t, 4>> of(std::uint64_t triangle) const {
    const std::uint32_t bits = attribute(triangle);
    const bool is_marked = (bits & kDefaultColorBit) != 0;
    const std::array<std::uint8_t, 3> channels = channels_of(bits);
    if (default_color_) {
      if ((is_marked && mark_counts_) || !by_triangle_) return default_color_;
      return std::array<std::uint8_t, 4>{channels[0], channels[1], channels[2], 255};
    }
    if (!is_marked) return std::nullopt;
    return std::array<std::uint8_t, 4>{channels[2], channels[1], channels[0], 255};
  }

 private:
  static constexpr std::uint32_t kDefaultColorBit = 0x8000;

  std::uint32_t attribute(std::uint64_t triangle) const {
    const char* const at = bytes_.data() + kStlHeaderBytes + (triangle + 1) * kStlTriangleBytes - 2;
    return static_cast<std::uint8_t>(at[0]) | std::uint32_t{static_cast<std::uint8_t>(at[1])} << 8U;
  }
  struct Bits {
    std::uint64_t count = 0;
    std::uint32_t first = 0;
    bool are_alike = true, are_all_marked = true;
  };
  Bits scan_bits() const {
    Bits bits;
    bits.count = little_endian_word(bytes_.data() + kStlHeaderBytes - 4);
    if (bits.count != 0) bits.first = attribute(0);
    for (std::uint64_t t = 0; t < bits.count; ++t) {
      const std::uint32_t color_bits = attribute(t);
      bits.are_alike = bits.are_alike && color_bits == bits.first;
      bits.are_all_marked = bits.are_all_marked && (color_bits & kDefaultColorBit) != 0;
    }
    return bits;
  }
  /// The three channels of a colour, starting with the one in the lowest bits.
  static std::array<std::uint8_t, 3> channels_of(std::uint32_t bits) {
    return {expand_to_8_bits(bits), expand_to_8_bits(bits >> 5U), expand_to_8_bits(bits >> 10U)};
  }
  /// Expands a 5-bit channel to 8 bits, rounded.
  static std::uint8_t expand_to_8_bits(std::uint32_t bits) {
    return static_cast<std::uint8_t>(((bits & 31U) * 255 + 15) / 31);
  }

  std::string_view bytes_;
  /// The default colour in a header of Magics
  std::optional<std::array<std::uint8_t, 4>> default_color_;
  bool by_triangle_ = true, mark_counts_ = true;
};

Mesh read_binary(const MeshInput& input) {
  const std::string_view bytes = input.bytes;
  if (bytes.size() < kStlHeaderBytes) {
    input.fail("byte " + std::to_string(bytes.size()),
               "the file ends inside the header of 84 bytes (truncated)",
               "Copy or export it again.");
  }
  const std::uint64_t count = little_endian_word(bytes.data() + kStlHeaderBytes - 4);
  const std::uint64_t needed_bytes = kStlHeaderBytes + count * kStlTriangleBytes;
  if (needed_bytes > bytes.size()) {
    input.fail("header",
               "it declares " + std::to_string(count) + " triangles, which take " +
                   std::to_string(needed_bytes) + " bytes, but the file has " +
                   std::to_string(bytes.size()) + " (truncated, or not an STL file)",
               "Copy or export it again.");
  }
  if (needed_bytes < bytes.size()) {
    const std::uint64_t extra_bytes = bytes.size() - needed_bytes;
    input.warn("trailing-bytes",
               counted(extra_bytes, "byte") + " after the last triangle " +
                   (extra_bytes == 1 ? "was ignored." : "were ignored."),
               extra_bytes);
  }
  MeshBuilder builder(input);
  CornerWelder<MeshBuilder::Position> welder(builder.positions, count / 2);
  const StlColors colors(input);
  for (std::uint64_t t = 0; t < count; ++t) {
    // Address of the triangle's vertices, which follow its normal
    const char* at = bytes.data() + kStlHeaderBytes + t * kStlTriangleBytes + kStlNormalBytes;
    std::uint32_t corner[3];
    for (std::uint32_t& vertex : corner) {
      MeshBuilder::Position p;
      for (double& value : p) {
        value = double{std::bit_cast<float>(little_endian_word(at))};
        at += 4;
      }
      vertex = welder.add(p);
    }
    if (const auto color = colors.of(t)) builder.set_face_color_bytes(*color);
    builder.add_face(corner);
  }
  return builder.finish();
}

class StlTextReader : public StlTextParser {
 public:
  explicit StlTextReader(const MeshInput& input)
      : StlTextParser(input),
        builder_(input),
        welder_(builder_.positions, input.bytes.size() / 512) {}

  Mesh read() {
    parse(input().bytes);
    finish();
    builder_.describe_face = [this](std::uint32_t triangle) {
      return triangle < triangle_lines_.size() ? "line " + std::to_string(triangle_lines_[triangle])
                                               : std::string();
    };
    return builder_.finish();
  }

 private:
  std::uint32_t add_vertex(const MeshBuilder::Position& position) override {
    return welder_.add(position);
  }
  void add_facet(const std::vector<std::uint32_t>& corners) override {
    if (corners.size() >= 3)
      triangle_lines_.insert(triangle_lines_.end(), corners.size() - 2, line());
    builder_.add_face(corners);
  }
  void set_solid(std::string_view name) override { builder_.set_group(name); }

  MeshBuilder builder_;
  CornerWelder<MeshBuilder::Position> welder_;
  std::vector<std::uint64_t> triangle_lines_;
};

}  // namespace

Mesh read_stl(const MeshInput& input) {
  return StlTextParser::is_text(input.bytes, input.bytes.size()) ? StlTextReader(input).read()
                                                                 : read_binary(input);
}

}  // namespace kiln
