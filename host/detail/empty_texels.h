// Texels of the high poly's pictures that hold nothing, since no chart reaches them and nobody filled them.
//
// Filters read texels around a chart: half a texel out of it where the picture is as fine as the map, many where it is
// finer. An atlas that was painted or rendered without padding has its background there, and charts get seams of its
// colour. So texels that (1) lie in no chart of the mesh and (2) show the background are left out of all means, as
// transparent texels are (image/texture_filter.h). A chart that holds no texel's centre, such as a face on a cell of a
// palette, has all texels that it touches: nothing else could stand in for them.
//  Texels out of charts that hold anything else stay: they are padding,
// or other objects' charts, or a photograph that goes on. A picture that charts cover whole, such as a tile that
// repeats, stays as it is.
#pragma once

#include <array>
#include <optional>

#include "image/texel_bits.h"
#include "kiln/image.h"
#include "kiln/texture.h"

namespace kiln {

/// The texels of a picture whose centres lie in triangles of UV space.
class ChartTexels {
 public:
  using Corners = std::array<std::array<double, 2>, 3>;  ///< u and v each

  using Wraps = std::optional<std::array<TextureWrap, 2>>;

  ChartTexels(std::uint32_t width, std::uint32_t height) : bits_(width, height) {}

  /// Within a ten-thousandth of a texel. Nothing for UVs that are not finite. For several threads at once.
  /// \param wraps  beyond the picture; none: what lies beyond is left out
  /// \returns true if the triangle holds any centre
  bool add(const Corners& uvs, const Wraps& wraps);
  /// Also those of which a triangle holds any part. For several threads at once.
  void add_touched(const Corners& uvs, const Wraps& wraps);

  const TexelBits& bits() const { return bits_; }

 private:
  bool add_row(std::int64_t y, double left, double right, const Wraps& wraps);
  bool add_rows(const Corners& uvs, const Wraps& wraps, double reach);

  TexelBits bits_;
};

/// The texels that hold nothing; none where there are none, or none is near a chart.
///
/// The background is the colour that most texels out of charts have, if a quarter of them have it; texels without opacity
/// are one colour. Beside background, within a texel, is what was blended with it. Cost: two walks over the picture.
std::optional<TexelBits> find_empty_texels(const Image& image, const TexelBits& charts);

}  // namespace kiln
