// Checks sizes and counts in an OpenVDB file, which the library itself does not check.
#include <array>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "io/volume/volume_reader.h"

namespace kiln {
namespace {

// Oldest version whose root nodes have the present layout
constexpr std::uint32_t kMinFileVersion = 213;
// Since this version, descriptors name a parent, and the transform comes first
constexpr std::uint32_t kInstanceVersion = 216;
// Before this version, the UUID is 16 binary bytes
constexpr std::uint32_t kTextUuidVersion = 218;
// Since this version, the header has a byte for the compression, until kGridCompressionVersion
constexpr std::uint32_t kHeaderCompressionVersion = 220;
// Since this version, each grid has compression flags
constexpr std::uint32_t kGridCompressionVersion = 222;

/// Reads consecutive little-endian values, and checks that the file does not end before.
class GridFrame {
 public:
  explicit GridFrame(const VolumeInput& input) : input_(input), size_(input.source->size()) {}

  std::uint64_t place() const { return place_; }
  std::uint64_t remaining_bytes() const { return size_ - place_; }

  [[noreturn]] void fail(const std::string& what) const {
    input_.fail("byte " + std::to_string(place_), "the file is damaged: " + what,
                "Copy or export the file again.");
  }
  void skip(std::uint64_t bytes, const std::string& what) {
    if (bytes > remaining_bytes()) {
      fail(what + " of " + std::to_string(bytes) +
           " bytes reaches beyond the file's end, which is " + std::to_string(remaining_bytes()) +
           " bytes on");
    }
    place_ += bytes;
  }
  void go(std::uint64_t place) { place_ = place; }
  template <typename T>
  T value(const char* what) {
    std::array<unsigned char, sizeof(T)> bytes{};
    const std::uint64_t at = place_;
    skip(sizeof(T), what);
    if (input_.source->read_at(at, bytes.data(), sizeof(T)) != sizeof(T)) fail("it cannot be read");
    std::uint64_t number = 0;
    for (std::size_t k = 0; k < sizeof(T); ++k) number |= std::uint64_t{bytes[k]} << (8 * k);
    return static_cast<T>(static_cast<std::make_unsigned_t<T>>(number));
  }
  std::string text(const std::string& what) {
    const std::uint64_t at = place_;
    const auto length = value<std::uint32_t>("a length");
    if (length > remaining_bytes()) {
      place_ = at;
      fail(what + " claims " + std::to_string(length) + " bytes, but only " +
           std::to_string(remaining_bytes() - sizeof length) + " are left in the file");
    }
    std::string result(length, '\0');
    if (input_.source->read_at(place_, result.data(), length) != length) fail("it cannot be read");
    place_ += length;
    return result;
  }
  /// Checks that `count` elements, of at least `least` bytes each, fit in the rest of the file.
  void check_count(std::uint64_t count, std::uint64_t least, const char* what) const {
    if (count > remaining_bytes() / least) {
      fail(std::to_string(count) + " " + what + " need more than the " +
           std::to_string(remaining_bytes()) + " bytes that follow");
    }
  }

 private:
  const VolumeInput& input_;
  std::uint64_t size_, place_ = 0;
};

/// Number of bytes of a metadata value, by its type; 0 if that varies.
std::uint32_t bytes_of(std::string_view type) {
  constexpr std::pair<std::string_view, std::uint32_t> kSizes[] = {
      {"bool", 1},   {"int32", 4},  {"int64", 8},  {"float", 4},  {"double", 8}, {"vec2i", 8},
      {"vec2s", 8},  {"vec2d", 16}, {"vec3i", 12}, {"vec3s", 12}, {"vec3d", 24}, {"vec4i", 16},
      {"vec4s", 16}, {"vec4d", 32}, {"mat4s", 64}, {"mat4d", 128}};
  for (const auto& [name, size] : kSizes) {
    if (name == type) return size;
  }
  return 0;
}

void check_metadata(GridFrame& frame) {
  const auto count = frame.value<std::uint32_t>("the number of metadata");
  frame.check_count(count, 12, "metadata");
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string name = frame.text("the name of metadata " + std::to_string(i));
    const std::string type = frame.text("the type of metadata " + std::to_string(i));
    const auto size = frame.value<std::uint32_t>("a length");
    const std::uint32_t wanted = bytes_of(type);
    if (wanted != 0 && size != wanted) {
      frame.fail("metadata " + std::to_string(i) + ", a " + type + ", claims " +
                 std::to_string(size) + " bytes instead of " + std::to_string(wanted));
    }
    frame.skip(size, "metadata " + std::to_string(i));
  }
}

/// Number of bytes of a transform, by the type of its map; 0 if the type is unknown.
std::uint64_t bytes_of_map(std::string_view type) {
  if (type == "AffineMap" || type == "UnitaryMap") return 128;
  if (type == "ScaleMap" || type == "UniformScaleMap") return 120;
  if (type == "ScaleTranslateMap" || type == "UniformScaleTranslateMap") return 144;
  if (type == "TranslationMap") return 24;
  return 0;
}

/// Checks a grid from its start to the table of its root node.
void check_grid(GridFrame& frame, std::uint32_t version, std::string_view tree, bool instance) {
  if (version >= kGridCompressionVersion) frame.skip(4, "compression flags");
  check_metadata(frame);
  if (version < kInstanceVersion) return;
  const std::uint64_t map = bytes_of_map(frame.text("the type of the transform"));
  // Only grids of scalars are supported.
  const std::uint64_t number = tree.starts_with("Tree_float_5_4_3")    ? 4
                               : tree.starts_with("Tree_double_5_4_3") ? 8
                                                                       : 0;
  if (map == 0 || number == 0 || instance) return;
  frame.skip(map, "the transform");
  frame.skip(4 + number, "the root node");
  const auto tiles = frame.value<std::uint32_t>("the number of tiles");
  const auto children = frame.value<std::uint32_t>("the number of nodes");
  // A tile has an origin, a value and an active flag; a child node has an origin and two masks of
  // 32^3 bits.
  frame.check_count(tiles, 12 + number + 1, "tiles");
  frame.check_count(children, 12 + 2 * 4096, "nodes");
}

}  // namespace

void check_openvdb_frame(const VolumeInput& input) {
  GridFrame frame(input);
  constexpr std::uint64_t kMagic = 0x56444220;
  if (frame.remaining_bytes() < 8 || frame.value<std::uint64_t>("the magic number") != kMagic) {
    input.fail("", "it does not begin as an OpenVDB file does",
               "Give it the extension of its format, or export the grid again.");
  }
  const auto version = frame.value<std::uint32_t>("the version");
  if (version < kMinFileVersion || version > 1000) {
    frame.fail("its version is " + std::to_string(version) +
               "; OpenVDB's files have versions from " + std::to_string(kMinFileVersion));
  }
  frame.skip(8, "the library's version");
  const bool has_offsets = frame.value<std::uint8_t>("a flag") != 0;
  if (version >= kHeaderCompressionVersion && version < kGridCompressionVersion)
    frame.skip(1, "the compression flag");
  frame.skip(version >= kTextUuidVersion ? 36 : 16, "the identifier");
  check_metadata(frame);
  const auto grids = frame.value<std::int32_t>("the number of grids");
  if (grids < 0) frame.fail("it claims " + std::to_string(grids) + " grids");
  // A descriptor takes at least 32 bytes: the lengths of two names, and three offsets.
  frame.check_count(static_cast<std::uint64_t>(grids), 32, "grids");
  for (std::int32_t i = 0; i < grids; ++i) {
    const std::string grid = "grid " + std::to_string(i);
    frame.text("the name of " + grid);
    const std::string tree = frame.text("the type of " + grid);
    const bool instance =
        version >= kInstanceVersion && !frame.text("the parent's name of " + grid).empty();
    const auto begin = frame.value<std::uint64_t>("an offset");
    const auto blocks = frame.value<std::uint64_t>("an offset");
    const auto end = frame.value<std::uint64_t>("an offset");
    // In files without offsets, a grid follows its descriptor, and the next descriptor follows the
    // tree of the grid.
    if (!has_offsets) {
      check_grid(frame, version, tree, instance);
      return;
    }
    if (begin < frame.place() || begin > blocks || blocks > end ||
        end > frame.place() + frame.remaining_bytes()) {
      frame.fail(grid + " is said to lie from byte " + std::to_string(begin) +
                 ", with its blocks from byte " + std::to_string(blocks) + ", to byte " +
                 std::to_string(end) + ", but the file ends at byte " +
                 std::to_string(frame.place() + frame.remaining_bytes()));
    }
    frame.go(begin);
    check_grid(frame, version, tree, instance);
    frame.go(end);
  }
}

}  // namespace kiln
