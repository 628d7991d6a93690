#include "detail/surface_texture.h"

#include <algorithm>
#include <string>

#include "base/memory.h"
#include "detail/vertex_colors.h"
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
  if (picture == nullptr || !point.has_uv) {
    if (plain_.empty()) return;
    const std::uint32_t material = source_.materials.of[point.triangle];
    if (material < plain_.size()) std::copy_n(plain_[material].begin(), 4, value);
    return;
  }
  const auto wraps =
      wraps_.empty() ? FilteredTexture::Wraps{} : wraps_[source_.materials.of[point.triangle]];
  const auto [u, v] = moved(point.triangle, point.uv[0], point.uv[1]);
  const auto& sides = point.uv_sides;
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
