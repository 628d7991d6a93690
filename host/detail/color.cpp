// Colour and opacity of the high poly.
#include <algorithm>

#include "detail/surface_texture.h"
#include "detail/vertex_colors.h"

namespace kiln {
namespace {

/// Reads some channels of the high poly's texture, or of its vertex colours if it has no texture.
class OwnColor : public PointFunction {
 public:
  /// \param one_channel  true: reads only the channel that the texture selects
  OwnColor(const MapRequest& request, const std::optional<Texture>& texture, const char* map,
           bool one_channel)
      : source_(request.source) {
    if (texture) {
      channel_ = std::min(texture->channel, 3U);
      TextureUseOfMap use{map, request.options.fill_high};
      if (one_channel) use.channel = channel_;
      texture_.emplace(source_, *texture, use);
    } else {
      check_vertex_colors(source_, map, "give it a texture, or leave the map out.");
    }
  }

  PointNeeds needs() const override {
    return {.position = false,
            .normal = false,
            .uv = texture_ && texture_->needs_uvs(),
            .weight_sides = texture_ && texture_->needs_other_uvs(),
            .distance = false};
  }

  void report(BakedMap&, std::vector<Warning>& warnings) const override {
    if (texture_) texture_->report(warnings);
  }

 protected:
  /// \returns the weight of the colour in the average of a texel's samples
  float color_at(const HighPoint& point, float* color) const {
    if (texture_) return texture_->read(point, color);
    read_vertex_color(source_, point, color);
    return 1;
  }
  bool colors_have_weights() const { return texture_ && texture_->has_weights(); }
  std::uint32_t channel_ = 3;

 private:
  const Source::Impl& source_;
  std::optional<SurfaceTexture> texture_;
};

class Color : public OwnColor {
 public:
  using OwnColor::OwnColor;
  bool has_weights() const override { return colors_have_weights(); }
  void operator()(const HighPoint& point, float* value) const override {
    if (has_weights()) value[3] = 1;
    if (!point.found) return;
    float color[4];
    const float weight = color_at(point, color);
    std::copy_n(color, 3, value);
    if (has_weights()) value[3] = weight;
  }
};

class Opacity : public OwnColor {
 public:
  using OwnColor::OwnColor;
  void operator()(const HighPoint& point, float* value) const override {
    if (!point.found) return;
    float color[4];
    color_at(point, color);
    value[0] = color[channel_];
  }
};

}  // namespace

MapRow color_map() {
  MapRow row;
  row.info = {MapKind{"color"},
              3,
              MapType::color,
              "colour of the high poly: its textures, filtered over each texel's footprint, or its "
              "vertex colours if it has no texture",
              0,
              1};
  row.info.options = "color";
  row.info.missed = MissedTexels::neighbours;
  row.info.other_names = "albedo base_color basecolor colour diffuse diffuse_color";
  row.weighted = true;
  row.follows_positions = true;
  row.supports_streaming = true;  // of vertex colours only; streaming_obstacle() rejects pictures
  row.make = [](const MapRequest& request) {
    return make_point_map(request, color_map().info,
                          std::unique_ptr<PointFunction>(std::make_unique<Color>(
                              request, request.options.color, "color", false)));
  };
  return row;
}

MapRow opacity_map() {
  MapRow row;
  row.info = {MapKind{"opacity"},
              1,
              MapType::scalar,
              "opacity of the high poly, 0 to 1: the alpha of its texture, or of its vertices if "
              "it has no texture; 0 where no point was found",
              0,
              1};
  row.info.options = "opacity";
  row.info.missed = MissedTexels::zero;
  row.info.other_names = "alpha";
  row.weights = true;
  row.follows_positions = true;
  row.make = [](const MapRequest& request) {
    return make_point_map(request, opacity_map().info,
                          std::unique_ptr<PointFunction>(std::make_unique<Opacity>(
                              request, request.options.opacity, "opacity", true)));
  };
  return row;
}

}  // namespace kiln
