#include "asset/udim_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <system_error>

#include "base/input_log.h"
#include "base/lower_case.h"
#include "kiln/material.h"
#include "mesh/udim.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

// Largest tile number in names without a token. Larger numbers probably are years or sizes.
constexpr std::uint32_t kMaxNumberedTile = 1999;
constexpr std::uint32_t kMaxTileRows = 100;  // Number of rows of tiles for which files are searched

bool is_file(const fs::path& path) { return register_file_check(path); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_word(char c) { return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// The number at a position in a text.
/// \param end  [out] position after the number
std::uint32_t number_at(const std::string& text, std::size_t at, std::size_t& end) {
  std::uint32_t value = 0;
  const char* const first = text.data() + at;
  const auto [last, error] = std::from_chars(first, text.data() + text.size(), value);
  end = error == std::errc() ? static_cast<std::size_t>(last - text.data()) : at;
  return value;
}

/// The tile that is written as "u1_v1" at a position in a text; 0 if there is none.
/// \param end  [out] position after it
std::uint32_t parse_columns_at(const std::string& name, std::size_t at, std::size_t& end) {
  const std::string text = lower_case(name);
  if (text[at] != 'u' || (at > 0 && is_word(text[at - 1]))) return 0;
  std::size_t tile_separator = 0;
  const std::uint32_t u = number_at(text, at + 1, tile_separator);
  if (tile_separator == at + 1 || text.compare(tile_separator, 2, "_v") != 0) return 0;
  const std::uint32_t v = number_at(text, tile_separator + 2, end);
  if (end == tile_separator + 2 || (end < text.size() && is_word(text[end]))) return 0;
  if (u < 1 || u > kUdimColumns || v < 1 || v > kMaxTileRows) return 0;
  return kFirstUdim + u - 1 + kUdimColumns * (v - 1);
}

}  // namespace

std::optional<TileName> TileName::parse_token(const fs::path& path) {
  struct Token {
    const char* text;  // The placeholder for the tile, in lower case
    bool by_columns;
  };
  static constexpr std::array<Token, 3> kTokens = {
      {{"<udim>", false}, {"<uvtile>", true}, {"%(udim)d", false}}};
  const std::string name = path.filename().string(), lower_name = lower_case(name);
  for (const Token& token : kTokens) {
    const std::size_t at = lower_name.find(token.text);
    if (at == std::string::npos) continue;
    if (is_file(path)) return std::nullopt;
    const std::size_t length = std::char_traits<char>::length(token.text);
    TileName result;
    result.folder_ = path.parent_path();
    result.prefix_ = name.substr(0, at);
    result.token_ = name.substr(at, length);
    result.suffix_ = name.substr(at + length);
    result.by_columns_ = token.by_columns;
    return result;
  }
  return std::nullopt;
}

std::optional<TileName> TileName::parse_number(const fs::path& path) {
  const std::string name = path.filename().string();
  TileName result;
  std::size_t end = 0;
  for (std::size_t at = name.size(); at-- > 0;) {
    std::uint32_t tile = parse_columns_at(name, at, end);
    const bool by_columns = tile != 0;
    if (tile == 0 && is_digit(name[at]) && (at == 0 || !is_digit(name[at - 1]))) {
      const std::uint32_t number = number_at(name, at, end);
      if (end - at == 4 && number >= kFirstUdim && number <= kMaxNumberedTile) tile = number;
    }
    if (tile == 0) continue;
    result.folder_ = path.parent_path();
    result.prefix_ = name.substr(0, at);
    result.suffix_ = name.substr(end);
    result.token_ = by_columns ? "<UVTILE>" : "<UDIM>";
    result.by_columns_ = by_columns;
    result.number_ = tile;
    return result;
  }
  return std::nullopt;
}

fs::path TileName::file_of(std::uint32_t tile) const {
  const std::uint32_t tile_index = tile - kFirstUdim;
  const std::string number = by_columns_ ? "u" + std::to_string(tile_index % kUdimColumns + 1) +
                                               "_v" + std::to_string(tile_index / kUdimColumns + 1)
                                         : std::to_string(tile);
  return folder_ / fs::path(prefix_ + number + suffix_);
}

fs::path TileName::token_path() const { return folder_ / fs::path(prefix_ + token_ + suffix_); }

std::vector<std::uint32_t> TileName::files() const {
  std::vector<std::uint32_t> tiles;
  std::string found_tiles;
  for (std::uint32_t tile_index = 0; tile_index < kUdimColumns * kMaxTileRows; ++tile_index) {
    std::error_code error;
    if (!fs::is_regular_file(file_of(kFirstUdim + tile_index), error)) continue;
    tiles.push_back(kFirstUdim + tile_index);
    found_tiles += std::to_string(tiles.back()) + " ";
  }
  // The input log gets one record for the whole set: a thousand names are tested, of which few
  // exist.
  register_query(token_path(), kTilesAnswerKey, found_tiles);
  return tiles;
}

bool names_tile(const fs::path& path) {
  return TileName::parse_token(path) || TileName::parse_number(path);
}

bool is_picture_file(const fs::path& path) {
  if (is_file(path)) return true;
  const auto name = TileName::parse_token(path);
  return name && !name->files().empty();
}

namespace {

const std::vector<Vec2>& uvs_of(const Mesh& mesh, std::uint32_t set) {
  const auto other = std::find_if(mesh.other_uvs.begin(), mesh.other_uvs.end(),
                                  [set](const UvSet& uvs) { return uvs.set == set; });
  return set == mesh.uv_set || other == mesh.other_uvs.end() ? mesh.uvs : other->uvs;
}

std::uint32_t tile_of(const Mesh& mesh, std::size_t triangle, const PicturePlace& place) {
  const std::vector<Vec2>& uvs = uvs_of(mesh, place.uv_set);
  const std::array<float, 6>& m = place.uv_transform;
  double u = 0, v = 0;
  for (const std::uint32_t corner : mesh.uv_triangles[triangle]) {
    // This index is invalid, which the check of the mesh reports
    if (corner >= uvs.size()) return 0;
    u += double{uvs[corner].x} / 3;
    v += double{uvs[corner].y} / 3;
  }
  return udim_of(m[0] * u + m[1] * v + m[2], m[3] * u + m[4] * v + m[5]);
}

}  // namespace

std::vector<TileCounts> count_tiles(const Mesh& mesh, std::span<const PicturePlace> places) {
  std::vector<TileCounts> counts(places.size());
  for (std::size_t t = 0; t < std::min(mesh.uv_triangles.size(), mesh.materials.size()); ++t) {
    const std::uint32_t material = mesh.materials[t];
    if (material < counts.size()) ++counts[material][tile_of(mesh, t, places[material])];
  }
  return counts;
}

TileCounts count_tiles(const Mesh& mesh) {
  TileCounts counts;
  for (std::size_t t = 0; t < mesh.uv_triangles.size(); ++t) {
    ++counts[tile_of(mesh, t, {.uv_set = mesh.uv_set})];
  }
  return counts;
}

TileFiles find_tiles(const fs::path& picture, const TileCounts* counts,
                     const std::function<bool(const fs::path&)>& is_others) {
  TileFiles result;
  if (const auto name = TileName::parse_token(picture)) {
    const std::vector<std::uint32_t> files = name->files();
    for (const bool all : {false, true}) {
      for (const std::uint32_t tile : files) {
        if (!all && counts != nullptr && !counts->contains(tile)) continue;
        result.tiles.emplace_back(tile, name->file_of(tile));
      }
      if (!result.tiles.empty()) break;
    }
    return result;
  }
  if (counts == nullptr) return result;
  const auto name = TileName::parse_number(picture);
  if (!name) return result;
  std::uint64_t outside_first_tile = 0, triangles_with_files = 0, all_triangles = 0;
  bool named_by_others = false;
  std::string found;
  for (const auto& [tile, count] : *counts) {
    all_triangles += count;
    if (tile != kFirstUdim) outside_first_tile += count;
    if (tile == 0) continue;
    const fs::path file = name->file_of(tile);
    if (!is_file(file)) continue;
    triangles_with_files += count;
    result.tiles.emplace_back(tile, file);
    if (tile == name->number()) continue;
    found += (found.empty() ? "" : ", ") + std::to_string(tile);
    named_by_others = named_by_others || (is_others && is_others(file));
  }
  if (outside_first_tile == 0 || found.empty()) {  // A single picture, which may repeat
    result.tiles.clear();
    return result;
  }
  const std::string quoted = "'" + picture.string() + "'";
  const std::string token = "'" + name->token_path().filename().string() + "'";
  if (2 * triangles_with_files < all_triangles || named_by_others) {
    result.tiles.clear();
    result.note =
        quoted +
        " is repeated over all UV tiles, although UVs leave the first tile and pictures of other "
        "tiles exist beside it (" +
        found + "): " +
        (named_by_others ? "other materials use those" : "most of the used tiles have no picture") +
        ". If it is part of a UDIM set, name it " + token + ".";
    return result;
  }
  result.note =
      quoted +
      " is read as part of a UDIM set, since UVs use the tiles of the pictures beside it (" +
      found + "). To state this, name it " + token +
      "; if it should repeat instead, move the other pictures away.";
  return result;
}

}  // namespace kiln
