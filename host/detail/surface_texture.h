// Textures of the high poly, read at its points over a texel's footprint.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "detail/point_map.h"
#include "image/texture_filter.h"
#include "kiln/texture.h"

namespace kiln {

class SurfaceTexture {
 public:
  /// \param name  of the map, for messages
  /// \throws Error(input) where the high poly has no UVs or materials for it, or a picture is unusable
  SurfaceTexture(const Source::Impl& source, const Texture& texture, std::string_view name);

  /// The texture's mean over the point's sides, times the vertices' colour where that is asked for. \param value  four numbers: those that the picture lacks are
  /// its first one (colours of one channel) or 1 (alpha)
  void read(const HighPoint& point, float* value) const;

  /// A corner's UV in the set that the triangle's picture lies on.
  const Vec2& uv_of(std::uint32_t triangle, std::size_t corner) const;

  /// From the UVs of that set to those of a triangle's picture. \param unit  0: of a difference
  std::array<double, 2> moved(std::uint32_t triangle, double u, double v, double unit = 1) const;

  /// True if it has pictures: what they show depends on UVs.
  bool needs_uvs() const { return !pictures_.empty(); }
  /// True if some of them lie on other sets of UVs than the mesh's own.
  bool needs_other_uvs() const { return !sets_.empty(); }

  /// Numbers of the pictures that are not finite.
  std::uint64_t replaced() const;

 private:
  enum class Factor { color, alpha };  // of the vertices

  /// A point's UV, and the sides around it, in the set of its picture.
  struct Place {
    bool is_there = false;
    std::array<double, 2> uv;
    std::array<std::array<double, 2>, 2> sides;
  };

  void choose_sets(const Texture& texture, const std::string& map);
  Place place_of(const HighPoint& point) const;
  void read_pictures(const HighPoint& point, float* value) const;
  const FilteredTexture* picture_of(std::uint32_t triangle) const;

  const Source::Impl& source_;
  std::vector<std::unique_ptr<FilteredTexture>> pictures_;
  std::vector<std::uint32_t> picture_of_material_;
  std::vector<std::array<float, 4>> plain_;
  std::vector<std::array<float, 6>> uv_transforms_;
  std::vector<const std::vector<Vec2>*> sets_;  // of materials; null: the mesh's own; none: of all
  std::vector<FilteredTexture::Wraps> wraps_;
  std::vector<Texture::Factor> factors_;
  std::vector<bool> times_vertices_;
  Factor by_vertices_;
};

/// Adds a warning where a map's pictures have numbers that are not finite.
void warn_replaced(const SurfaceTexture& texture, std::string_view name,
                   std::vector<Warning>& warnings);

}  // namespace kiln
