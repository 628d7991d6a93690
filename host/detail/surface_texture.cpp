#include "detail/surface_texture.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "base/counted.h"
#include "base/memory.h"
#include "base/option.h"
#include "base/parallel.h"
#include "detail/empty_texels.h"
#include "detail/vertex_colors.h"
#include "io/file/text_scanner.h"
#include "mesh/udim.h"
#include "mesh/uv_grid.h"
#include "source/high_poly_uvs.h"

namespace kiln {
namespace {

/// Makes a picture of one channel from the alpha channel of another.
std::shared_ptr<const Image> alpha_channel_of(const Image& image) {
  auto alpha_image = std::make_shared<Image>();
  alpha_image->width = image.width;
  alpha_image->height = image.height;
  alpha_image->channels = 1;
  alpha_image->pixels.reserve(image.pixels.size() / image.channels);
  for (std::size_t i = image.channels - 1; i < image.pixels.size(); i += image.channels) {
    alpha_image->pixels.push_back(image.pixels[i]);
  }
  return alpha_image;
}

}  // namespace

SurfaceTexture::SurfaceTexture(const Source::Impl& source, const Texture& texture,
                               const TextureUseOfMap& use)
    : source_(source),
      map_(use.map),
      picture_of_material_(texture.image_of),
      constant_color_(texture.plain),
      uv_transforms_(texture.uv_transforms),
      wraps_(texture.wraps),
      factors_(texture.factors),
      vertex_factor_(texture.kind == TextureKind::srgb ? Factor::color : Factor::alpha),
      normal_format_(texture.normal_format) {
  check(texture);
  if (!source.colors.empty() && source.colors.size() == source.positions.size()) {
    multiplies_vertices_ = texture.times_vertex_colors;
  }
  choose_sets(texture);
  group_tiles(texture);
  std::vector<std::optional<TexelBits>> empty(texture.images.size());
  if (use.fill) empty = find_background_texels(texture);
  for (std::size_t i = 0; i < texture.images.size(); ++i) {
    std::shared_ptr<const Image> image = texture.images[i];
    TextureReading texture_reading;
    if (texture.kind == TextureKind::normal) {
      texture_reading.normals = NormalChannels::of(*image, texture.normal_format);
      normals_.push_back(texture_reading.normals);
      if (GreenEvidence::of(*image, texture_reading.normals).suggests_down())
        flipped_green_suspects_.push_back(i);
    }
    texture_reading.by_alpha = i < texture.weighted_by_alpha.size() && texture.weighted_by_alpha[i];
    if (empty[i]) texture_reading.empty = &*empty[i];
    // If background is excluded, the alpha that FilteredTexture returns is the mean of its weights,
    // in which background counts like transparent texels (image/texture_filter.h). A map of alpha
    // therefore reads alpha from a separate picture.
    const bool weighs_separately =
        texture_reading.empty != nullptr && use.channel == 3U && image->channels % 2 == 0;
    if (weighs_separately) image = alpha_channel_of(*image);
    is_single_channel_.push_back(weighs_separately);
    require_memory("Filtering the " + std::to_string(image->width) + " x " +
                       std::to_string(image->height) + " pixels of the texture of the map " + map_,
                   FilteredTexture::most_bytes(*image, texture.kind, texture_reading),
                   [](const std::string& problem) {
                     throw Error(ErrorCode::input, problem +
                                                       ". Scale the picture down, or raise the " +
                                                       option("memory_limit") + ".");
                   });
    pictures_.push_back(std::make_unique<FilteredTexture>(image, texture.kind, texture_reading));
    is_alpha_weighted_.push_back(texture_reading.by_alpha && image->channels % 2 == 0);
    has_weights_ = has_weights_ || (is_alpha_weighted_.back() && pictures_.back()->is_weighted());
  }
  warn_about_missing_tiles();
}

void SurfaceTexture::check(const Texture& texture) const {
  const auto fail = [&](const std::string& problem) {
    throw Error(ErrorCode::input, "The texture of the map " + map_ + problem);
  };
  if (!texture.images.empty() && !has_uvs(source_)) {
    throw Error(ErrorCode::input, "The high poly has no UVs, which the texture of the map " + map_ +
                                      " needs: give it a layout, or leave the map out.");
  }
  if (texture.image_of.empty() && texture.images.size() != 1 && texture.tiles.empty()) {
    fail(" has " + std::to_string(texture.images.size()) +
         " pictures, but no assignment of pictures to materials.");
  }
  const std::size_t names = source_.materials.names.size(), materials = texture.image_of.size();
  if (materials != 0 && materials != names) {
    fail(" is for " + std::to_string(materials) + " materials, but the high poly has " +
         std::to_string(names) + ".");
  }
  if (!uv_transforms_.empty() && uv_transforms_.size() != materials) {
    fail(" has " + std::to_string(uv_transforms_.size()) + " transforms of UVs for " +
         std::to_string(materials) + " materials.");
  }
  if ((!wraps_.empty() && wraps_.size() != materials) ||
      (!factors_.empty() && factors_.size() != materials) ||
      (!texture.times_vertex_colors.empty() && texture.times_vertex_colors.size() != materials)) {
    fail(" must have a wrap mode and a factor for each material that it assigns pictures to.");
  }
  for (const std::shared_ptr<const Image>& image : texture.images) {
    if (image == nullptr)
      throw Error(ErrorCode::input, "A picture of the texture of the map " + map_ + " is missing.");
    if (image->width == 0 || image->height == 0 || image->channels < 1 || image->channels > 4 ||
        image->pixels.size() != std::size_t{image->width} * image->height * image->channels) {
      throw Error(ErrorCode::input, "A picture of the texture of the map " + map_ +
                                        " has no pixels, or their number does not match its size.");
    }
  }
  const auto check_picture = [&](std::uint32_t picture) {
    if (picture < texture.images.size()) return;
    fail(" has no picture " + std::to_string(picture) + ".");
  };
  for (const std::uint32_t picture : texture.image_of) {
    if (picture != Texture::kNone) check_picture(picture);
  }
  for (const TextureTile& tile : texture.tiles) {
    check_picture(tile.set);
    check_picture(tile.image);
  }
}

void SurfaceTexture::choose_sets(const Texture& texture) {
  if (texture.uv_sets.empty()) return;
  if (texture.uv_sets.size() != picture_of_material_.size()) {
    throw Error(ErrorCode::input, "The texture of the map " + map_ +
                                      " must have a UV set for each material that it assigns "
                                      "pictures to.");
  }
  for (std::size_t i = 0; i < texture.uv_sets.size(); ++i) {
    const std::uint32_t uv_set = texture.uv_sets[i];
    uv_sets_.push_back(nullptr);
    if (uv_set == source_.uv_set || picture_of_material_[i] == Texture::kNone) continue;
    for (const UvSet& set : source_.other_uvs) {
      if (set.set == uv_set && set.uvs.size() == source_.uvs.size()) uv_sets_.back() = &set.uvs;
    }
    if (uv_sets_.back() != nullptr) continue;
    throw Error(ErrorCode::input, "The texture of the map " + map_ + " uses the UV set " +
                                      std::to_string(uv_set) + " for the material \"" +
                                      source_.materials.names[i] +
                                      "\", but the high poly has no such set.");
  }
}

void SurfaceTexture::group_tiles(const Texture& texture) {
  if (texture.tiles.empty()) return;
  udim_tiles_.resize(texture.images.size());
  for (const TextureTile& tile : texture.tiles)
    udim_tiles_[tile.set].emplace_back(tile.tile, tile.image);
  for (UdimTiles& set : udim_tiles_) {
    std::stable_sort(set.begin(), set.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
  }
}

/// Finds the background texels of each picture. Charts of all pictures that share an image are
/// united.
std::vector<std::optional<TexelBits>> SurfaceTexture::find_background_texels(
    const Texture& texture) const {
  std::vector<std::optional<TexelBits>> empty(texture.images.size());
  if (texture.images.empty()) return empty;
  std::map<const Image*, std::unique_ptr<ChartTexels>> by_image;
  std::vector<ChartTexels*> charts;
  for (const std::shared_ptr<const Image>& image : texture.images) {
    std::unique_ptr<ChartTexels>& entry = by_image[image.get()];
    if (entry == nullptr) entry = std::make_unique<ChartTexels>(image->width, image->height);
    charts.push_back(entry.get());
  }
  // Calls add(charts, corners, wraps) for each picture that a triangle is mapped to.
  const auto for_each_picture = [&](std::uint32_t triangle, const auto& add) {
    const std::uint32_t set = picture_of(triangle);
    if (set == Texture::kNone) return;
    ChartTexels::Corners corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2& uv = uv_of(triangle, k);
      corners[k] = transform_uv(triangle, uv.x, uv.y);
    }
    if (udim_tiles_.empty() || udim_tiles_[set].empty()) {
      const bool are_wraps_default = wraps_.empty();
      add(*charts[set], corners,
          ChartTexels::Wraps(are_wraps_default ? FilteredTexture::Wraps{}
                                               : wraps_[source_.materials.of[triangle]]));
      return;
    }
    for (const auto& [number, image] : udim_tiles_[set]) {
      const std::array<double, 2> corner = udim_corner(number);
      ChartTexels::Corners in_tile = corners;
      for (auto& at : in_tile) at[0] -= corner[0], at[1] -= corner[1];
      add(*charts[image], in_tile, ChartTexels::Wraps());
    }
  };
  constexpr std::size_t kTrianglesPerTask = std::size_t{1} << 12;
  const std::size_t count = source_.triangles.size();
  std::vector<std::uint8_t> holds_centre(count);
  parallel_for(count, kTrianglesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      for_each_picture(static_cast<std::uint32_t>(t),
                       [&](ChartTexels& on, const auto& corners, const auto& wraps) {
                         if (on.add(corners, wraps)) holds_centre[t] = 1;
                       });
    }
  });
  const auto find = [&] {
    std::map<const Image*, std::optional<TexelBits>> found;
    bool has_any = false;
    for (std::size_t i = 0; i < empty.size(); ++i) {
      const auto [entry, added] = found.try_emplace(texture.images[i].get());
      if (added) entry->second = find_empty_texels(*texture.images[i], charts[i]->bits());
      empty[i] = entry->second;
      has_any = has_any || empty[i];
    }
    return has_any;
  };
  if (!find()) return empty;
  // Charts that contain no texel's centre keep all texels that they touch.
  std::vector<std::uint32_t> chart_of(source_.uvs.size());
  std::iota(chart_of.begin(), chart_of.end(), 0U);
  const auto root = [&](std::uint32_t uv) {
    while (chart_of[uv] != uv) uv = chart_of[uv] = chart_of[chart_of[uv]];
    return uv;
  };
  for (const Triangle& uv : source_.uv_triangles) {
    chart_of[root(uv[1])] = root(uv[0]);
    chart_of[root(uv[2])] = root(uv[0]);
  }
  std::vector<bool> has_centre(source_.uvs.size());
  for (std::size_t t = 0; t < count; ++t) {
    if (holds_centre[t] != 0) has_centre[root(source_.uv_triangles[t][0])] = true;
  }
  bool is_touched = false;
  for (std::size_t t = 0; t < count; ++t) {
    if (has_centre[root(source_.uv_triangles[t][0])]) continue;
    is_touched = true;
    for_each_picture(static_cast<std::uint32_t>(t),
                     [](ChartTexels& on, const auto& corners, const auto& wraps) {
                       on.add_touched(corners, wraps);
                     });
  }
  if (is_touched) find();
  return empty;
}

void SurfaceTexture::warn_about_missing_tiles() {
  if (udim_tiles_.empty()) return;
  for (std::uint32_t t = 0; t < source_.triangles.size(); ++t) {
    const std::uint32_t set = picture_of(t);
    if (set == Texture::kNone || udim_tiles_[set].empty()) continue;
    const auto [u, v] = uv_center_of(t);
    const std::uint32_t tile = udim_of(u, v);
    const bool has_tile = std::any_of(udim_tiles_[set].begin(), udim_tiles_[set].end(),
                                      [&](const auto& entry) { return entry.first == tile; });
    if (!has_tile) ++missing_tiles_[tile];
  }
}

std::uint32_t SurfaceTexture::picture_of(std::uint32_t triangle) const {
  if (picture_of_material_.empty()) return 0;
  return picture_of_material_[source_.materials.of[triangle]];
}

std::array<double, 2> SurfaceTexture::uv_center_of(std::uint32_t triangle) const {
  double u = 0, v = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2& uv = uv_of(triangle, k);
    u += double{uv.x} / 3, v += double{uv.y} / 3;
  }
  return transform_uv(triangle, u, v);
}

const Vec2& SurfaceTexture::uv_of(std::uint32_t triangle, std::size_t corner) const {
  const std::vector<Vec2>* const set =
      uv_sets_.empty() ? nullptr : uv_sets_[source_.materials.of[triangle]];
  return (set != nullptr ? *set : source_.uvs)[source_.uv_triangles[triangle][corner]];
}

SurfaceTexture::UvPoint SurfaceTexture::uv_point_of(const HighPoint& point) const {
  if (uv_sets_.empty() || uv_sets_[source_.materials.of[point.triangle]] == nullptr) {
    return {point.has_uv, point.uv, point.uv_sides};
  }
  const Vec2 &a = uv_of(point.triangle, 0), &b = uv_of(point.triangle, 1),
             &c = uv_of(point.triangle, 2);
  UvPoint place;
  place.has_uv = is_finite(a) && is_finite(b) && is_finite(c);
  if (!place.has_uv) return place;
  const std::array<double, 2> at{a.x, a.y}, to_b{double{b.x} - a.x, double{b.y} - a.y},
      to_c{double{c.x} - a.x, double{c.y} - a.y};
  for (std::size_t k = 0; k < 2; ++k) {
    place.uv[k] = at[k] + to_b[k] * point.u + to_c[k] * point.v;
    for (std::size_t side = 0; side < 2; ++side) {
      place.sides[side][k] =
          to_b[k] * point.weight_sides[side][0] + to_c[k] * point.weight_sides[side][1];
    }
  }
  return place;
}

SurfaceTexture::PicturePoint SurfaceTexture::picture_point_of(const HighPoint& point) const {
  const std::uint32_t set = picture_of(point.triangle);
  if (set == Texture::kNone) return {};
  const UvPoint at = uv_point_of(point);
  if (!at.has_uv) return {};
  const auto [u, v] = transform_uv(point.triangle, at.uv[0], at.uv[1]);
  if (udim_tiles_.empty() || udim_tiles_[set].empty())
    return {pictures_[set].get(),   u, v, at.sides, false, is_single_channel_[set],
            is_alpha_weighted_[set]};
  // A point on the border of two UDIM tiles belongs to the tile of its triangle, regardless of
  // rounding.
  constexpr double kTileInset = 1e-4;
  const std::array<double, 2> middle = uv_center_of(point.triangle);
  const std::uint32_t tile =
      udim_of(u + (middle[0] - u) * kTileInset, v + (middle[1] - v) * kTileInset);
  const UdimTiles& tiles = udim_tiles_[set];
  const auto found = std::lower_bound(tiles.begin(), tiles.end(), tile,
                                      [](const auto& a, std::uint32_t b) { return a.first < b; });
  if (found == tiles.end() || found->first != tile) return {};
  const std::array<double, 2> corner = udim_corner(tile);
  return {pictures_[found->second].get(),
          u - corner[0],
          v - corner[1],
          at.sides,
          true,
          is_single_channel_[found->second],
          is_alpha_weighted_[found->second]};
}

std::array<double, 2> SurfaceTexture::transform_uv(std::uint32_t triangle, double u, double v,
                                                   double translation) const {
  if (uv_transforms_.empty()) return {u, v};
  const std::array<float, 6>& m = uv_transforms_[source_.materials.of[triangle]];
  return {m[0] * u + m[1] * v + m[2] * translation, m[3] * u + m[4] * v + m[5] * translation};
}

float SurfaceTexture::read(const HighPoint& point, float* value) const {
  const float weight = read_pictures(point, value);
  if (multiplies_vertices_.empty() || !multiplies_vertices_[source_.materials.of[point.triangle]]) {
    return weight;
  }
  float vertices[4];
  read_vertex_color(source_, point, vertices);
  for (std::size_t c = 0; c < 4; ++c) {
    value[c] *= vertices[vertex_factor_ == Factor::color ? c : 3];
  }
  return weight;
}

float SurfaceTexture::read_pictures(const HighPoint& point, float* value) const {
  std::fill_n(value, 4, 0.0F);
  const PicturePoint place = picture_point_of(point);
  if (place.picture == nullptr) {
    if (constant_color_.empty()) return 1;
    const std::uint32_t material = source_.materials.of[point.triangle];
    if (material < constant_color_.size()) std::copy_n(constant_color_[material].begin(), 4, value);
    return 1;
  }
  FilteredTexture::Wraps wraps{};
  if (place.is_tile) {
    wraps = {TextureWrap::clamp, TextureWrap::clamp};
  } else if (!wraps_.empty()) {
    wraps = wraps_[source_.materials.of[point.triangle]];
  }
  const auto& sides = place.sides;
  place.picture->mean(place.u, place.v,
                      {transform_uv(point.triangle, sides[0][0], sides[0][1], 0),
                       transform_uv(point.triangle, sides[1][0], sides[1][1], 0)},
                      value, wraps);
  if (place.picture->channels() < 3) {
    value[3] = place.picture->channels() == 2 ? value[1] : place.is_channel ? value[0] : 1;
    value[1] = value[2] = value[0];
  } else if (place.picture->channels() == 3) {
    value[3] = 1;
  }
  const float weight = place.is_weighted ? std::max(value[3], FilteredTexture::kMinWeight) : 1.0F;
  if (factors_.empty()) return weight;
  const Texture::Factor& factor = factors_[source_.materials.of[point.triangle]];
  for (std::size_t c = 0; c < 4; ++c) {
    value[c] = value[c] * factor.times[c] + (c < 3 ? factor.plus : 0);
  }
  return weight;
}

/// Describes a picture by the first material that uses it, for messages.
std::string SurfaceTexture::describe_picture_user(std::size_t image) const {
  std::size_t set = image;
  for (std::size_t s = 0; s < udim_tiles_.size(); ++s) {
    for (const auto& [tile, of] : udim_tiles_[s]) {
      if (of == image) set = s;
    }
  }
  const auto found = std::find(picture_of_material_.begin(), picture_of_material_.end(), set);
  if (found == picture_of_material_.end()) return "the texture of the map " + map_;
  const auto material = static_cast<std::size_t>(found - picture_of_material_.begin());
  return "the texture of the map " + map_ + ", of the material \"" +
         printable(source_.materials.names[material]) + "\"";
}

void SurfaceTexture::report(std::vector<Warning>& warnings) const {
  std::uint64_t replaced_count = 0;
  for (const auto& picture : pictures_) replaced_count += picture->replaced_values();
  if (replaced_count != 0) {
    warnings.push_back({"texture-non-finite",
                        "The texture of the map " + map_ + " has " +
                            counted(replaced_count, "number") +
                            (replaced_count == 1 ? " that is NaN or infinite; it counts as 0."
                                                 : " that are NaN or infinite; they count as 0."),
                        replaced_count});
  }
  const auto warn = [&](const char* code, const auto& holds, const Message& text) {
    std::uint64_t count = 0;
    std::size_t first = 0;
    for (std::size_t i = 0; i < normals_.size(); ++i) {
      if (holds(i) && count++ == 0) first = i;
    }
    if (count == 0) return;
    warnings.push_back({code,
                        counted(count, "normal map") + " (" + describe_picture_user(first) +
                            (count > 1 ? ", first) " : ") ") + text,
                        count});
  };
  // The format of a normal map is only reported if it was detected, not if the caller gave it.
  const auto is_detected = [&](std::size_t i) {
    return normal_format_ == NormalTextureFormat::automatic && normals_[i].computes_z;
  };
  warn(
      "two-channel-normals", [&](std::size_t i) { return is_detected(i) && !normals_[i].in_alpha; },
      "only held x and y (blue is constant, or below 0 everywhere): z was computed. If that is "
      "wrong, set its channels (" +
          option("high_normal_map", "gl") + ").");
  warn(
      "two-channel-normals", [&](std::size_t i) { return is_detected(i) && normals_[i].in_alpha; },
      "held x in alpha and y in green (DXT5nm): z was computed. If that is wrong, give the "
      "map's channels (" +
          option("high_normal_map", "gl") + ").");
  warn(
      "normal-map-channels", [&](std::size_t i) { return normals_[i].contradicts_format; },
      normal_format_ == NormalTextureFormat::two_channel ||
              normal_format_ == NormalTextureFormat::two_channel_directx
          ? "seem to hold x and y in other channels than two-channel maps do, but were read as "
            "requested: check " +
                option("high_normal_map") + "."
          : "seem to hold only x and y, but blue was read as z, as requested: check " +
                option("high_normal_map") + ".");
  warn(
      "normal-map-green",
      [&](std::size_t i) {
        return std::find(flipped_green_suspects_.begin(), flipped_green_suspects_.end(), i) !=
               flipped_green_suspects_.end();
      },
      "seem to have an inverted green channel: their slopes fit a surface only if green is "
      "inverted. As they are, bumps are baked as dents. Choose the other direction of green by " +
          option("high_normal_map") + " (dx: +Y down).");
  if (!missing_tiles_.empty()) {
    std::uint64_t triangles = 0;
    std::string list;
    std::size_t named_count = 0;
    constexpr std::size_t kMaxNamedTiles = 8;
    for (const auto& [tile, count] : missing_tiles_) {
      triangles += count;
      if (tile == 0 || ++named_count > kMaxNamedTiles) continue;
      list += (list.empty() ? "" : ", ") + std::to_string(tile);
    }
    if (named_count > kMaxNamedTiles)
      list += " and " + std::to_string(named_count - kMaxNamedTiles) + " more";
    const bool has_outside = missing_tiles_.contains(0);
    if (has_outside) list += list.empty() ? "UVs beyond all tiles" : ", and UVs beyond all tiles";
    warnings.push_back({"tile-missing",
                        "The texture of the map " + map_ + " has no picture for " +
                            counted(triangles, "triangle") + " of the high poly (" +
                            (named_count != 0 ? "UDIM " : "") + list +
                            "): " + (triangles == 1 ? "it gets its" : "these get their") +
                            " material's constant value there, or 0. Put the missing pictures "
                            "beside the others.",
                        triangles});
  }
}

}  // namespace kiln
