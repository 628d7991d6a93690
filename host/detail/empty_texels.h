// Finds background texels of the high poly's pictures: texels outside of all charts that are not
// padding.
//
// Texture filters read texels around a chart: up to half a texel away if the picture is as fine as
// the map, many texels away if it is finer. In an atlas without padding, these texels are
// background, whose colour would bleed into charts and show as seams. Therefore texels that (1) lie
// outside of all charts of the mesh and (2) have the background's colour are excluded from all
// means, like transparent texels (image/texture_filter.h). A chart that covers no texel's centre,
// such as a face mapped into one cell of a palette, keeps all texels that it touches, since no
// others could replace them. Any other content outside of charts is kept: it may be padding, belong
// to charts of other objects, or be a photograph that extends beyond the charts. A picture without
// texels outside of charts, such as a repeating tile, stays as it is.
#pragma once

#include <array>
#include <optional>

#include "image/texel_bits.h"
#include "kiln/image_data.h"
#include "kiln/texture.h"

namespace kiln {

/// The texels of a picture whose centres lie in triangles of UV space.
class ChartTexels {
 public:
  using Corners = std::array<std::array<double, 2>, 3>;  ///< u and v of each of the three corners

  using Wraps = std::optional<std::array<TextureWrap, 2>>;

  ChartTexels(std::uint32_t width, std::uint32_t height) : chart_bits_(width, height) {}

  /// Adds the texels whose centres lie in a triangle, with a tolerance of 1e-4 texels. A triangle
  /// with non-finite UVs adds none. Thread-safe.
  /// \param wraps  wrap modes for UVs outside of the picture; null: such UVs are ignored
  /// \returns true if the triangle contains the centre of any texel
  bool add(const Corners& uvs, const Wraps& wraps);
  /// Adds all texels that the triangle touches. Thread-safe.
  void add_touched(const Corners& uvs, const Wraps& wraps);

  const TexelBits& bits() const { return chart_bits_; }

 private:
  bool add_row(std::int64_t y, double left, double right, const Wraps& wraps);
  bool add_rows(const Corners& uvs, const Wraps& wraps, double reach);

  TexelBits chart_bits_;
};

/// Finds the background texels of a picture. Returns nothing if there is no background, or none
/// near a chart.
///
/// The background is the most frequent colour outside of charts, if at least a quarter of the
/// texels there have it. All fully transparent texels count as one colour. Texels adjacent to
/// background count as background, too, since filters may have blended them with it. The cost is
/// two passes over the picture.
std::optional<TexelBits> find_empty_texels(const Image& image, const TexelBits& charts);

}  // namespace kiln
