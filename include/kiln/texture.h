#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

struct Image;

/// Meaning of a texture's values, which decides how they are filtered.
enum class TextureKind {
  srgb,    ///< Colours, sRGB-encoded: filtered in linear light
  linear,  ///< Plain numbers, such as roughness, metalness and masks
  normal,  ///< Tangent-space normals of the high poly as n/2 + 1/2 (MikkTSpace, +Y up)
};

/// Channel conventions of a normal texture. The green channel's sign is not detected: a bake warns if slopes suggest +Y
/// down ("normal-map-green").
enum class NormalTextureFormat {
  /// opengl, or two_channel if blue cannot be the z of a unit vector; the warning
  /// "two-channel-normals" reports the latter
  automatic,
  opengl,              ///< Three channels, green up (+Y)
  directx,             ///< Three channels, green down (-Y)
  two_channel,         ///< Two channels, green up (+Y)
  two_channel_directx  ///< Two channels, green down (-Y)
};

/// Wrap modes: continuation of a picture beyond its border.
enum class TextureWrap {
  repeat,  ///< Repeat the picture
  clamp,   ///< Repeat the border texels
  mirror,  ///< Repeat the picture, mirrored every other time
};

/// The picture of one tile of a UDIM set.
struct TextureTile {
  /// Index into Texture::images that represents the set (Texture::image_of)
  std::uint32_t set = 0;
  std::uint32_t tile = 1001;  ///< Number of the tile: 1001 + u + 10 v, with u from 0 to 9
  std::uint32_t image = 0;    ///< Index into Texture::images
};

/// Pictures over the high poly's UVs: one for the whole mesh, or one per material. Copies, and sessions, share
/// the pictures, which must not change while a bake runs or a session exists.
struct Texture {
  /// Marks a material without a picture
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  TextureKind kind = TextureKind::srgb;  ///< Kind of all pictures
  /// Pictures, which may have different sizes
  std::vector<std::shared_ptr<const Image>> images = {};
  /// Per material of the high poly (Mesh::materials), index into images, or kNone. Empty: images[0] is
  /// used for the whole mesh.
  std::vector<std::uint32_t> image_of = {};
  /// Per material, the value if it has no picture or the mesh has no UVs, in linear light. Empty: 0.
  std::vector<std::array<float, 4>> plain = {};
  /// Per material, transform from the mesh's UVs to its picture's, as MaterialPicture::uv_transform. Empty:
  /// identity.
  std::vector<std::array<float, 6>> uv_transforms = {};
  std::vector<std::array<TextureWrap, 2>> wraps =
      {};  ///< Wrap modes outside of the unit square, for each material. Empty: all repeat
  /// Per material, the UV set of its picture: Mesh::uv_set, or one of Mesh::other_uvs. Empty: all use Mesh::uvs.
  std::vector<std::uint32_t> uv_sets = {};
  /// Affine function of a filtered value (a vector, or a colour in linear light): times * value +
  /// plus.
  struct Factor {
    std::array<float, 4> times{1, 1, 1, 1};  ///< Factor of each channel
    float plus = 0;                          ///< Added to all channels but the fourth
    bool operator==(const Factor&) const = default;
  };
  /// Per material, the function that is applied to filtered values. Empty: values are unchanged
  std::vector<Factor> factors = {};
  /// Per material, whether its values are multiplied by the vertices' colours (srgb) or alpha (linear), if the mesh
  /// has any. Empty: no material's are.
  std::vector<bool> times_vertex_colors = {};
  /// Channel that maps of one channel read, 0 to 3; channels that the picture lacks are 1.
  std::uint32_t channel = 0;
  /// UDIM sets; tiles without a picture are treated like materials without one ("tile-missing").
  /// Empty: none.
  std::vector<TextureTile> tiles = {};
  /// Per picture, whether colours are weighted by alpha when they are averaged. Empty: no picture's
  /// are
  std::vector<bool> weighted_by_alpha = {};
  NormalTextureFormat normal_format =
      NormalTextureFormat::automatic;  ///< Channel convention of all pictures, if `kind` is normal
};

/// A texture of the high poly that is baked into one of the low poly: each texel gets the average over its
/// footprint on the texture, integrated from mip chains (McCormack et al. 1999, "Feline").
struct Transfer {
  std::string name = "texture";  ///< Name of the map: a letter, then letters, digits and _
  Texture texture = {};          ///< The texture to transfer
};

}  // namespace kiln
