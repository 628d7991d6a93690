// Textures of the high poly, read at its points over a texel's footprint.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "detail/point_map.h"
#include "image/texel_bits.h"
#include "image/texture_filter.h"
#include "kiln/texture.h"

namespace kiln {

/// How a map reads a texture.
struct TextureUseOfMap {
  std::string_view map;  ///< Its name, for messages
  bool fill = true;      ///< BakeOptions::fill_high
  std::optional<std::uint32_t> channel =
      std::nullopt;  ///< The one that counts; none: colours or vectors
};

class SurfaceTexture {
 public:
  /// \throws Error(input) where the high poly has no UVs or materials for it, or a picture is unusable
  SurfaceTexture(const Source::Impl& source, const Texture& texture, const TextureUseOfMap& use);

  /// The texture's mean over the point's sides, times the vertices' colour where that is asked for. \param value  four numbers: those that the picture lacks are
  /// its first one (colours of one channel) or 1 (alpha)
  /// \returns the value's weight in means: opacity where colours are weighted by it, FilteredTexture::kLeastWeight at
  ///          least; else 1
  float read(const HighPoint& point, float* value) const;

  /// True if not all weights are 1.
  bool has_weights() const { return has_weights_; }

  /// A corner's UV in the set that the triangle's picture lies on.
  const Vec2& uv_of(std::uint32_t triangle, std::size_t corner) const;

  /// From the UVs of that set to those of a triangle's picture. \param unit  0: of a difference
  std::array<double, 2> moved(std::uint32_t triangle, double u, double v, double unit = 1) const;

  /// True if it has pictures: what they show depends on UVs.
  bool needs_uvs() const { return !pictures_.empty(); }
  /// True if some of them lie on other sets of UVs than the mesh's own.
  bool needs_other_uvs() const { return !sets_.empty(); }

  /// Adds warnings of what was imperfect: numbers that are not finite, formats of normals, tiles that are missing.
  void report(std::vector<Warning>& warnings) const;

 private:
  enum class Factor { color, alpha };  // of the vertices
  /// A point's UV, and the sides around it, in the set of its picture.
  struct UvPoint {
    bool is_there = false;
    std::array<double, 2> uv;
    std::array<std::array<double, 2>, 2> sides;
  };
  struct Place {
    const FilteredTexture* picture = nullptr;
    double u = 0, v = 0;
    std::array<std::array<double, 2>, 2> sides{};  ///< In the set of UVs, not moved
    bool is_tile = false;
    bool is_channel = false;
    bool is_weighted = false;
  };
  /// Tiles of a set, by their numbers. None: it is a picture by itself.
  using Tiles = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

  void check(const Texture& texture) const;
  void choose_sets(const Texture& texture);
  void group_tiles(const Texture& texture);
  std::vector<std::optional<TexelBits>> find_empty(const Texture& texture) const;
  void note_missing_tiles();
  float read_pictures(const HighPoint& point, float* value) const;
  std::uint32_t set_of(std::uint32_t triangle) const;
  std::array<double, 2> middle_of(std::uint32_t triangle) const;
  UvPoint uv_point_of(const HighPoint& point) const;
  Place place_of(const HighPoint& point) const;
  std::string user_of(std::size_t image) const;

  const Source::Impl& source_;
  std::string map_;
  std::vector<std::unique_ptr<FilteredTexture>> pictures_;
  std::vector<bool> is_channel_;   ///< Per picture: it is the channel that counts, taken out of it
  std::vector<bool> is_weighted_;  ///< Per picture: by its alpha
  bool has_weights_ = false;
  std::vector<Tiles> tiles_;  ///< Per picture; empty: no picture has any
  std::vector<std::uint32_t> picture_of_material_;
  std::vector<std::array<float, 4>> plain_;
  std::vector<std::array<float, 6>> uv_transforms_;
  std::vector<FilteredTexture::Wraps> wraps_;
  std::vector<const std::vector<Vec2>*> sets_;  // of materials; null: the mesh's own; none: of all
  std::vector<Texture::Factor> factors_;
  std::vector<bool> times_vertices_;
  Factor by_vertices_;
  NormalTextureFormat normal_format_;
  std::vector<NormalChannels> normals_;      ///< Per picture of normals
  std::vector<std::size_t> doubtful_green_;  ///< Pictures that look as if green pointed down
  std::map<std::uint32_t, std::uint64_t>
      missing_tiles_;  ///< Triangles, by tile; 0: beyond UDIM's squares
};

}  // namespace kiln
