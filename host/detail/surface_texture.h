// Textures of the high poly, filtered over a texel's footprint.
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

/// How a map reads a texture: which channel, and whether background is excluded.
struct TextureUseOfMap {
  std::string_view map;  ///< Name of the map, for messages
  bool fill = true;      ///< BakeOptions::fill_high
  std::optional<std::uint32_t> channel =
      std::nullopt;  ///< The channel that is read; unset: all channels
};

class SurfaceTexture {
 public:
  /// \throws Error(input) if the high poly lacks the UVs or materials, or a picture is unusable
  SurfaceTexture(const Source::Impl& source, const Texture& texture, const TextureUseOfMap& use);

  /// Mean of the texture over the point's footprint, multiplied by the vertex colours if the
  /// texture says so.
  /// \param value  four numbers; channels that the picture lacks are equal to the first one (grey),
  ///   or 1 (alpha)
  /// \returns the weight of the value in means: for colours weighted by opacity, the opacity, but
  ///   at least FilteredTexture::kMinWeight; otherwise 1
  float read(const HighPoint& point, float* value) const;

  /// True if the weights that read() returns may differ from 1.
  bool has_weights() const { return has_weights_; }

  /// UV of a corner, from the UV set that the triangle's picture uses.
  const Vec2& uv_of(std::uint32_t triangle, std::size_t corner) const;

  /// Applies the UV transform of a triangle's picture.
  /// \param translation  1 for a UV; 0 for a difference of two UVs, which is not translated
  std::array<double, 2> transform_uv(std::uint32_t triangle, double u, double v,
                                     double translation = 1) const;

  /// True if the texture has pictures, so that UVs are required.
  bool needs_uvs() const { return !pictures_.empty(); }
  /// True if some pictures use other UV sets than the mesh's own.
  bool needs_other_uvs() const { return !uv_sets_.empty(); }

  /// Adds warnings about imperfect input: non-finite values, doubtful formats of normals, missing
  /// tiles.
  void report(std::vector<Warning>& warnings) const;

 private:
  // Part of the vertex colours by which the texture is multiplied
  enum class Factor { color, alpha };
  /// UV of a point and the sides of its footprint, in the UV set of its picture.
  struct UvPoint {
    bool has_uv = false;
    std::array<double, 2> uv;
    std::array<std::array<double, 2>, 2> sides;
  };
  /// Where a texture is read for a point: the picture, and the UV in it.
  struct PicturePoint {
    const FilteredTexture* picture = nullptr;
    double u = 0, v = 0;
    /// Sides of the footprint in UVs, before the texture's transform is applied
    std::array<std::array<double, 2>, 2> sides{};
    bool is_tile = false;
    bool is_channel = false;
    bool is_weighted = false;
  };
  /// Number and picture of each tile of a UDIM set; empty if the material has a single picture.
  using UdimTiles = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

  void check(const Texture& texture) const;
  void choose_sets(const Texture& texture);
  void group_tiles(const Texture& texture);
  std::vector<std::optional<TexelBits>> find_background_texels(const Texture& texture) const;
  void warn_about_missing_tiles();
  float read_pictures(const HighPoint& point, float* value) const;
  std::uint32_t picture_of(std::uint32_t triangle) const;
  std::array<double, 2> uv_center_of(std::uint32_t triangle) const;
  UvPoint uv_point_of(const HighPoint& point) const;
  PicturePoint picture_point_of(const HighPoint& point) const;
  std::string describe_picture_user(std::size_t image) const;

  const Source::Impl& source_;
  std::string map_;
  std::vector<std::unique_ptr<FilteredTexture>> pictures_;
  /// For each picture, true if only the channel that the map reads is kept
  std::vector<bool> is_single_channel_;
  /// For each picture, true if means over its texels are weighted by alpha
  std::vector<bool> is_alpha_weighted_;
  bool has_weights_ = false;
  /// UDIM tiles of each picture; empty if no picture has tiles
  std::vector<UdimTiles> udim_tiles_;
  std::vector<std::uint32_t> picture_of_material_;
  std::vector<std::array<float, 4>> constant_color_;
  std::vector<std::array<float, 6>> uv_transforms_;
  std::vector<FilteredTexture::Wraps> wraps_;
  // For each material, the UVs that it uses; null: the mesh's own UVs. Empty if all materials use
  // the mesh's own UVs
  std::vector<const std::vector<Vec2>*> uv_sets_;
  std::vector<Texture::Factor> factors_;
  std::vector<bool> multiplies_vertices_;
  Factor vertex_factor_;
  NormalTextureFormat normal_format_;
  std::vector<NormalChannels> normals_;  ///< Channel layout of each normal map
  /// Normal maps whose green channel probably points down
  std::vector<std::size_t> flipped_green_suspects_;
  /// Number of triangles on each UDIM tile that has no picture; tile 0 stands for UVs outside of
  /// all tiles
  std::map<std::uint32_t, std::uint64_t> missing_tiles_;
};

}  // namespace kiln
