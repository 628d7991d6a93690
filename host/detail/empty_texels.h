// Finds background texels of the high poly's pictures: those outside all charts that padding does not fill.
//
// Texture filters read texels around a chart: up to half a texel away if the picture is as fine as the map, many
// texels away if it is finer. In an atlas without padding these are background, which would bleed into charts as
// seams. So texels that (1) lie in no chart of the mesh and (2) show the background are excluded from all means, like
// transparent texels (image/texture_filter.h). A chart that holds no texel's centre, such as a face on a cell of a
// palette, keeps all texels that it touches, since no others could replace them. Any other content outside charts is
// kept: it is padding, charts of other objects, or a photograph that extends beyond the charts. A picture that charts
// cover completely, such as a repeating tile, stays as it is.
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
  using Corners = std::array<std::array<double, 2>, 3>;  ///< u and v of each corner

  using Wraps = std::optional<std::array<TextureWrap, 2>>;

  ChartTexels(std::uint32_t width, std::uint32_t height) : chart_bits_(width, height) {}

  /// Adds texels with centres in a triangle, with a tolerance of 1e-4 texels. UVs that are not finite add none.
  /// Thread-safe.
  /// \param wraps how UVs outside the picture repeat; axes that do not repeat ignore such UVs
  /// \returns true if the triangle contains any centre
  bool add(const Corners& uvs, const Wraps& wraps);
  /// Adds all texels that the triangle touches. Thread-safe.
  void add_touched(const Corners& uvs, const Wraps& wraps);

  const TexelBits& bits() const { return chart_bits_; }

 private:
  bool add_row(std::int64_t y, double left, double right, const Wraps& wraps);
  bool add_rows(const Corners& uvs, const Wraps& wraps, double reach);

  TexelBits chart_bits_;
};

/// Finds the texels that hold background. Returns nothing if the picture has no background, or no background
/// near a chart.
///
/// The background is the most frequent colour outside of charts, if at least a quarter of those texels have it; all
/// transparent texels count as one colour. Texels next to background count as background, too, since filters may have
/// blended them with it. Cost: two passes over the picture.
std::optional<TexelBits> find_empty_texels(const Image& image, const TexelBits& charts);

}  // namespace kiln
