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
  linear,  ///< Plain numbers: roughness, metalness, masks
  normal,  ///< Tangent-space normals of the high poly as n/2 + 1/2 (MikkTSpace, +Y up)
};

/// Channel conventions of a normal texture. The green channel's sign is not detected: a bake warns if slopes suggest +Y
/// down ("normal-map-green").
enum class NormalTextureFormat {
  /// opengl; two_channel if blue cannot be the z of a unit vector ("two-channel-normals")
  automatic,
  opengl,              ///< Three channels, +Y up
  directx,             ///< Three channels, +Y down
  two_channel,         ///< Two channels, +Y up
  two_channel_directx  ///< Two channels, +Y down
};

/// Wrap modes: continuation of a picture beyond its border.
enum class TextureWrap {
  repeat,  ///< Repeat the picture
  clamp,   ///< Repeat the border texels
  mirror,  ///< Repeat the picture, mirrored every other time
};

/// A picture of a UDIM set.
struct TextureTile {
  /// Index into Texture::images that represents the set (Texture::image_of)
  std::uint32_t set = 0;
  std::uint32_t tile = 1001;  ///< 1001 + u + 10 v, u to 9
  std::uint32_t image = 0;    ///< Index into Texture::images
};

/// Pictures over the high poly's UVs: one for the whole mesh, or one per material. Copies, and sessions, share
/// the pictures, which must not change while a bake runs or a session exists.
struct Texture {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();  ///< No picture

  TextureKind kind = TextureKind::srgb;                   ///< Kind of all pictures
  std::vector<std::shared_ptr<const Image>> images = {};  ///< Any sizes
  /// Per material of the high poly (Mesh::materials), index into images, or kNone. Empty: images[0] is
  /// used for the whole mesh.
  std::vector<std::uint32_t> image_of = {};
  /// Per material, the value where it has no picture, or the mesh no UVs, in linear light. Empty: 0.
  std::vector<std::array<float, 4>> plain = {};
  /// Per material, transform from the mesh's UVs to its picture's, as MaterialPicture::uv_transform. Empty:
  /// identity.
  std::vector<std::array<float, 6>> uv_transforms = {};
  std::vector<std::array<TextureWrap, 2>> wraps =
      {};  ///< Per material, wrap modes beyond [0, 1]^2. Empty: all repeat
  /// Per material, the UV set of its picture: Mesh::uv_set, or one of Mesh::other_uvs. Empty: all use Mesh::uvs.
  std::vector<std::uint32_t> uv_sets = {};
  /// Affine function of a filtered value, in linear light or of vectors: times * value + plus.
  struct Factor {
    std::array<float, 4> times{1, 1, 1, 1};  ///< Factor of each channel
    float plus = 0;                          ///< Added to all channels but the fourth
    bool operator==(const Factor&) const = default;
  };
  std::vector<Factor> factors = {};  ///< Per material. Empty: values are unchanged
  /// Per material, whether it is multiplied with the vertices' colours (srgb) or alpha (linear), if the mesh has any.
  /// Empty: none is.
  std::vector<bool> times_vertex_colors = {};
  /// Channel for maps of one channel, 0 to 3; channels beyond the picture's own are 1.
  std::uint32_t channel = 0;
  /// UDIM sets; tiles without a picture are treated like materials without one ("tile-missing").
  /// Empty: none.
  std::vector<TextureTile> tiles = {};
  std::vector<bool> weighted_by_alpha =
      {};  ///< Per picture, whether colours are weighted by alpha. Empty: none
  NormalTextureFormat normal_format =
      NormalTextureFormat::automatic;  ///< Convention of all pictures, if kind is normal
};

/// A texture of the high poly that is baked into one of the low poly: averages over each texel's footprint on it,
/// integrated from mip chains (McCormack et al. 1999, "Feline").
struct Transfer {
  std::string name = "texture";  ///< Name of the map: a letter, then letters, digits and _
  Texture texture = {};          ///< The texture to transfer
};

}  // namespace kiln
