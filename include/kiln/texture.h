#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/export.h"
#include "kiln/image.h"

namespace KILN_PUBLIC kiln {

/// Meaning of a texture's numbers, by which they are filtered.
enum class TextureKind {
  srgb,    ///< Colours, sRGB-encoded: filtered in linear light
  linear,  ///< Numbers as they are: roughness, metalness, masks
  normal,  ///< Tangent-space normals of the high poly as n/2 + 1/2 (MikkTSpace, +Y up)
};

/// Channels of a normal texture (TextureKind::normal), and the direction of its green.
///
/// Two-channel maps hold x and y alone, since z = sqrt(1 - x^2 - y^2): BC5, whose blue decoders fill with 0 or 1, and
/// DXT5nm, which has x in alpha, y in green. Green is never found out from the pictures: where they speak for down, a bake
/// warns ("normal-map-green").
enum class NormalTextureFormat {
  /// As opengl; as two_channel where blue is below 0 all over, is constant so that vectors are not of unit length, or is
  /// not there, and where red is constant (or red, green and blue are one) and alpha holds x. A bake says so
  /// ("two-channel-normals")
  automatic,
  opengl,       ///< Three channels, +Y up
  directx,      ///< Three channels, +Y down
  two_channel,  ///< x and y, +Y up: of red and green, or, where red holds nothing, of alpha and green
  two_channel_directx,  ///< The same, +Y down
};

/// Extension of a picture beyond its border.
enum class TextureWrap {
  repeat,  ///< The picture again
  clamp,   ///< Its outermost texels
  mirror,  ///< Its mirror image, then the picture again
};

/// A picture of a UDIM set.
struct TextureTile {
  std::uint32_t set =
      0;  ///< Index into Texture::images that stands for all of the set (Texture::image_of)
  std::uint32_t tile =
      1001;  ///< Its square of UV space, from (u, v) on: 1001 + u + 10 v, u to 9, v to 99
  std::uint32_t image = 0;  ///< Index into Texture::images
};

/// Pictures over the high poly's UVs: one for all of it, or one a material.
/// Copies share the pictures, and so does a session; nobody may change them while a bake runs or a session lives.
struct Texture {
  /// Number of the picture of a material without one.
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  TextureKind kind = TextureKind::srgb;              ///< Kind of all pictures
  std::vector<std::shared_ptr<const Image>> images;  ///< Any sizes
  /// Per material of the high poly (Mesh::materials), index into images, or kNone. Empty: images[0] is for
  /// all of the mesh.
  std::vector<std::uint32_t> image_of;
  /// Per material, what it holds where it has no picture, or the mesh no UVs, in linear light. Empty: 0.
  std::vector<std::array<float, 4>> plain;
  /// Per material, from the mesh's UVs to its picture's, as MaterialPicture::uv_transform. Empty: none is moved.
  std::vector<std::array<float, 6>> uv_transforms;
  /// Per material, what is outside [0, 1]^2 along u and v. Empty: all repeat.
  std::vector<std::array<TextureWrap, 2>> wraps;
  /// Per material, the set of UVs that its picture lies on: Mesh::uv_set, or one of Mesh::other_uvs. Empty: all lie on
  /// Mesh::uvs.
  std::vector<std::uint32_t> uv_sets;
  /// Turns what a picture's mean is, in linear light or of vectors: number * times + plus.
  struct Factor {
    std::array<float, 4> times{1, 1, 1, 1};  ///< Factor of each channel
    float plus = 0;                          ///< Added to all channels but the fourth
    bool operator==(const Factor&) const = default;
  };
  std::vector<Factor> factors;  ///< Per material. Empty: means stay as they are
  /// Per material, whether it is multiplied with the vertices' colours (srgb) or their alpha (linear), where the mesh
  /// has any. Empty: none is.
  std::vector<bool> times_vertex_colors;
  /// The channel that counts where a map has one alone, 0 to 3; beyond the picture's own it is 1.
  std::uint32_t channel = 0;
  /// Pictures of UDIM sets. A set's pictures show on their own squares of UV space alone, after uv_transforms, and do not
  /// repeat; a point on the line between squares is of the one with its triangle's middle. On squares without a picture is what a material without one
  /// holds, and a bake warns of them ("tile-missing"). Empty: no picture is of a set.
  std::vector<TextureTile> tiles;
  /// Per picture, whether its colours are weighted by its alpha where they are averaged: colours of transparent texels do
  /// not show then. For pictures whose alpha is opacity. Empty: none is.
  std::vector<bool> weighted_by_alpha;
  NormalTextureFormat normal_format =
      NormalTextureFormat::automatic;  ///< Of all pictures, where kind is normal
};

/// A texture of the high poly that is baked into one of the low poly.
///
/// A texel's value is the mean of the picture over the texel's own area on it (its footprint): the
/// match carries the texel's sides onto the high poly's triangle and into its UVs. The
/// parallelogram there is integrated from mip chains (McCormack et al. 1999, "Feline"). One probe a
/// texel of the level takes the place of a Gaussian row.
struct Transfer {
  std::string name = "texture";  ///< Name of the map: a letter, then letters, digits and _
  Texture texture = {};          ///< Texture that is baked
};

}  // namespace kiln
