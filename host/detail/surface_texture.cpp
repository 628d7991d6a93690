#include "detail/surface_texture.h"

#include <algorithm>
#include <string>

#include "base/memory.h"
#include "detail/vertex_colors.h"
#include "mesh/uv_grid.h"
#include "source/high_poly_uvs.h"

namespace kiln {

SurfaceTexture::SurfaceTexture(const Source::Impl& source, const Texture& texture,
                               std::string_view name)
    : source_(source),
      picture_of_material_(texture.image_of),
      plain_(texture.plain),
      uv_transforms_(texture.uv_transforms),
      wraps_(texture.wraps),
      factors_(texture.factors),
      by_vertices_(texture.kind == TextureKind::srgb ? Factor::color : Factor::alpha) {
  const std::string map(name);
  if (!texture.images.empty() && !has_uvs(source)) {
    throw Error(ErrorCode::input, "The high poly has no UVs, over which the texture of the map " +
                                      map + " lies: give it a layout, or leave the map out.");
  }
  if (picture_of_material_.empty() && texture.images.size() != 1) {
    throw Error(ErrorCode::input, "The texture of the map " + map + " has " +
                                      std::to_string(texture.images.size()) +
                                      " pictures, but nothing says which material has which.");
  }
  const std::size_t names = source.materials.names.size();
  if (!picture_of_material_.empty() && picture_of_material_.size() != names) {
    throw Error(ErrorCode::input, "The texture of the map " + map + " is for " +
                                      std::to_string(picture_of_material_.size()) +
                                      " materials, but the high poly has " + std::to_string(names) +
                                      ".");
  }
  if (!uv_transforms_.empty() && uv_transforms_.size() != picture_of_material_.size()) {
    throw Error(ErrorCode::input, "The texture of the map " + map + " has " +
                                      std::to_string(uv_transforms_.size()) +
                                      " transforms of UVs for " +
                                      std::to_string(picture_of_material_.size()) + " materials.");
  }
  if ((!wraps_.empty() && wraps_.size() != picture_of_material_.size()) ||
      (!factors_.empty() && factors_.size() != picture_of_material_.size()) ||
      (!texture.times_vertex_colors.empty() &&
       texture.times_vertex_colors.size() != picture_of_material_.size())) {
    throw Error(ErrorCode::input, "The texture of the map " + map +
                                      " has wraps or factors for other than its materials.");
  }
  if (!source.colors.empty() && source.colors.size() == source.positions.size()) {
    times_vertices_ = texture.times_vertex_colors;
  }
  choose_sets(texture, map);
  for (const std::shared_ptr<const Image>& image : texture.images) {
    if (image == nullptr) throw Error(ErrorCode::input, "A texture of " + map + " is missing.");
    require_memory(
        "Filtering the " + std::to_string(image->width) + " x " + std::to_string(image->height) +
            " pixels of the texture of the map " + map,
        FilteredTexture::most_bytes(*image, texture.kind), [](const std::string& problem) {
          throw Error(ErrorCode::input,
                      problem + ". Scale the picture down, or raise the `memory_limit`.");
        });
    pictures_.push_back(std::make_unique<FilteredTexture>(image, texture.kind));
  }
  for (const std::uint32_t picture : picture_of_material_) {
    if (picture == Texture::kNone || picture < pictures_.size()) continue;
    throw Error(ErrorCode::input, "The texture of the map " + map + " has no picture " +
                                      std::to_string(picture) + ".");
  }
}

void SurfaceTexture::choose_sets(const Texture& texture, const std::string& map) {
  if (texture.uv_sets.empty()) return;
  if (texture.uv_sets.size() != picture_of_material_.size()) {
    throw Error(ErrorCode::input,
                "The texture of the map " + map + " has sets of UVs for other than its materials.");
  }
  for (std::size_t i = 0; i < texture.uv_sets.size(); ++i) {
    const std::uint32_t wanted = texture.uv_sets[i];
    sets_.push_back(nullptr);
    if (wanted == source_.uv_set || picture_of_material_[i] == Texture::kNone) continue;
    for (const UvSet& set : source_.other_uvs) {
      if (set.set == wanted && set.uvs.size() == source_.uvs.size()) sets_.back() = &set.uvs;
    }
    if (sets_.back() != nullptr) continue;
    throw Error(ErrorCode::input, "The texture of the map " + map + " lies on the set of UVs " +
                                      std::to_string(wanted) + " where the material is \"" +
                                      source_.materials.names[i] +
                                      "\", but the high poly has no such set.");
  }
}

const Vec2& SurfaceTexture::uv_of(std::uint32_t triangle, std::size_t corner) const {
  const std::vector<Vec2>* const set =
      sets_.empty() ? nullptr : sets_[source_.materials.of[triangle]];
  return (set != nullptr ? *set : source_.uvs)[source_.uv_triangles[triangle][corner]];
}

SurfaceTexture::Place SurfaceTexture::place_of(const HighPoint& point) const {
  if (sets_.empty() || sets_[source_.materials.of[point.triangle]] == nullptr) {
    return {point.has_uv, point.uv, point.uv_sides};
  }
  const Vec2 &a = uv_of(point.triangle, 0), &b = uv_of(point.triangle, 1),
             &c = uv_of(point.triangle, 2);
  Place place;
  place.is_there = is_finite(a) && is_finite(b) && is_finite(c);
  if (!place.is_there) return place;
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

const FilteredTexture* SurfaceTexture::picture_of(std::uint32_t triangle) const {
  if (picture_of_material_.empty()) return pictures_[0].get();
  const std::uint32_t picture = picture_of_material_[source_.materials.of[triangle]];
  return picture == Texture::kNone ? nullptr : pictures_[picture].get();
}

std::array<double, 2> SurfaceTexture::moved(std::uint32_t triangle, double u, double v,
                                            double unit) const {
  if (uv_transforms_.empty()) return {u, v};
  const std::array<float, 6>& m = uv_transforms_[source_.materials.of[triangle]];
  return {m[0] * u + m[1] * v + m[2] * unit, m[3] * u + m[4] * v + m[5] * unit};
}

void SurfaceTexture::read(const HighPoint& point, float* value) const {
  read_pictures(point, value);
  if (times_vertices_.empty() || !times_vertices_[source_.materials.of[point.triangle]]) return;
  float vertices[4];
  read_vertex_color(source_, point, vertices);
  for (std::size_t c = 0; c < 4; ++c) {
    value[c] *= vertices[by_vertices_ == Factor::color ? c : 3];
  }
}

void SurfaceTexture::read_pictures(const HighPoint& point, float* value) const {
  std::fill_n(value, 4, 0.0F);
  const FilteredTexture* picture = picture_of(point.triangle);
  const Place place = picture == nullptr ? Place() : place_of(point);
  if (!place.is_there) {
    if (plain_.empty()) return;
    const std::uint32_t material = source_.materials.of[point.triangle];
    if (material < plain_.size()) std::copy_n(plain_[material].begin(), 4, value);
    return;
  }
  const auto wraps =
      wraps_.empty() ? FilteredTexture::Wraps{} : wraps_[source_.materials.of[point.triangle]];
  const auto [u, v] = moved(point.triangle, place.uv[0], place.uv[1]);
  const auto& sides = place.sides;
  picture->mean(u, v,
                {moved(point.triangle, sides[0][0], sides[0][1], 0),
                 moved(point.triangle, sides[1][0], sides[1][1], 0)},
                value, wraps);
  if (picture->channels() < 3) {
    value[3] = picture->channels() == 2 ? value[1] : 1;
    value[1] = value[2] = value[0];
  } else if (picture->channels() == 3) {
    value[3] = 1;
  }
  if (factors_.empty()) return;
  const Texture::Factor& factor = factors_[source_.materials.of[point.triangle]];
  for (std::size_t c = 0; c < 4; ++c) {
    value[c] = value[c] * factor.times[c] + (c < 3 ? factor.plus : 0);
  }
}

std::uint64_t SurfaceTexture::replaced() const {
  std::uint64_t count = 0;
  for (const auto& picture : pictures_) count += picture->replaced();
  return count;
}

void warn_replaced(const SurfaceTexture& texture, std::string_view name,
                   std::vector<Warning>& warnings) {
  if (texture.replaced() == 0) return;
  warnings.push_back({"texture-non-finite",
                      "The texture of the map " + std::string(name) + " has " +
                          std::to_string(texture.replaced()) +
                          " numbers that are NaN or infinite; they count as 0.",
                      texture.replaced()});
}

}  // namespace kiln
