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
#include "asset/stl_triangles.h"
#include "base/counted.h"
#include "base/lower_case.h"
#include "io/file/text_scanner.h"

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
    by_triangle_ = !bits.are_all_equal || bits.first != 0;
    uses_default_if_marked_ = !bits.are_all_marked;
    if (uses_default_if_marked_ || !by_triangle_) return;
    // After the colour in the header, MeshLab writes a blank, and Magics an alpha value.
    const bool is_written_by_meshlab =
        header.substr(at + kMagicsPrefix.size() + 3).starts_with(" MATERIAL=");
    if (!bits.are_all_equal || is_written_by_meshlab) return;
    uses_default_if_marked_ = true;
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
      if ((is_marked && uses_default_if_marked_) || !by_triangle_) return default_color_;
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
    bool are_all_equal = true, are_all_marked = true;
  };
  Bits scan_bits() const {
    Bits bits;
    bits.count = little_endian_word(bytes_.data() + kStlHeaderBytes - 4);
    if (bits.count != 0) bits.first = attribute(0);
    for (std::uint64_t t = 0; t < bits.count; ++t) {
      const std::uint32_t color_bits = attribute(t);
      bits.are_all_equal = bits.are_all_equal && color_bits == bits.first;
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
  bool by_triangle_ = true, uses_default_if_marked_ = true;
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

/// True if a token is this keyword, in upper or lower case. The keyword is given in lower case.
bool is_word(std::string_view token, std::string_view keyword) {
  return token.size() == keyword.size() && lower_case(token) == keyword;
}

/// Reads the keyword of a statement. "end loop" becomes "endloop".
std::string keyword_at(TextScanner& scan) {
  const std::string word = lower_case(scan.token());
  if (word != "end") return word;
  const TextScanner token_start = scan;
  const std::string_view keyword = scan.token_in_line();
  for (const char* kind : {"solid", "facet", "loop"}) {
    if (is_word(keyword, kind)) return word + kind;
  }
  scan = token_start;
  return word;
}

Mesh read_ascii(const MeshInput& input) {
  TextScanner scan(input.bytes);
  MeshBuilder builder(input);
  CornerWelder<MeshBuilder::Position> welder(builder.positions, input.bytes.size() / 512);
  std::vector<std::uint64_t> triangle_lines;
  std::vector<std::uint32_t> corners;
  const char* const remedy = "Correct the line or export the mesh again.";
  bool is_in_facet = false;
  for (;;) {
    const std::string word = keyword_at(scan);
    if (word.empty()) break;
    if (word == "vertex") {
      if (!is_in_facet) input.fail(scan.place(), "a vertex lies outside of any facet", remedy);
      MeshBuilder::Position p;
      for (double& value : p) {
        const std::string_view token = scan.token_in_line();
        const auto number = to_double(token);
        if (!number) {
          input.fail(scan.place(),
                     "a vertex must have three numbers, but there is \"" + printable(token) + "\"",
                     remedy);
        }
        value = *number;
      }
      corners.push_back(welder.add(p));
    } else if (word == "facet") {
      if (is_in_facet) input.fail(scan.place(), "a facet starts inside another", remedy);
      is_in_facet = true;
      corners.clear();
      scan.rest_of_line();
    } else if (word == "endfacet") {
      if (!is_in_facet) input.fail(scan.place(), "endfacet without facet", remedy);
      is_in_facet = false;
      if (corners.size() >= 3)
        triangle_lines.insert(triangle_lines.end(), corners.size() - 2, scan.line());
      builder.add_face(corners);
    } else if (word == "solid" || word == "endsolid") {
      const std::string_view name = scan.rest_of_line();
      if (word == "solid" && !name.empty()) builder.set_group(name);
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      input.fail(scan.place(), "\"" + printable(word) + "\" is not a keyword of an ASCII STL file",
                 remedy);
    }
  }
  if (is_in_facet)
    input.fail(scan.place(), "the file ends inside a facet (truncated)", "Copy it again.");
  builder.describe_face = [&triangle_lines](std::uint32_t triangle) {
    return triangle < triangle_lines.size() ? "line " + std::to_string(triangle_lines[triangle])
                                            : std::string();
  };
  return builder.finish();
}

}  // namespace

Mesh read_stl(const MeshInput& input) {
  const std::string_view bytes = input.bytes;
  // A binary file's header may start with "solid", too, so its size decides first.
  const bool sized =
      bytes.size() >= kStlHeaderBytes &&
      bytes.size() == kStlHeaderBytes +
                          kStlTriangleBytes *
                              std::uint64_t{little_endian_word(bytes.data() + kStlHeaderBytes - 4)};
  const bool text = is_word(TextScanner(bytes).token(), "solid") &&
                    bytes.substr(0, 1024).find('\0') == std::string_view::npos;
  return !sized && text ? read_ascii(input) : read_binary(input);
}

}  // namespace kiln
