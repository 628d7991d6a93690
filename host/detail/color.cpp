// The high poly's own colour, and how opaque it is.
#include <algorithm>

#include "detail/surface_texture.h"
#include "detail/vertex_colors.h"

namespace kiln {
namespace {

/// Channels of a texture, or of the vertices' colours where there is none.
class OwnColor : public PointFunction {
 public:
  OwnColor(const Source::Impl& source, const std::optional<Texture>& texture, const char* map)
      : source_(source), map_(map) {
    if (texture) {
      texture_.emplace(source, *texture, map);
      channel_ = std::min(texture->channel, 3U);
    } else {
      check_vertex_colors(source, map, "give it a texture, or leave the map out.");
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
    if (texture_) warn_replaced(*texture_, map_, warnings);
  }

 protected:
  void color_at(const HighPoint& point, float* color) const {
    if (texture_) {
      texture_->read(point, color);
    } else {
      read_vertex_color(source_, point, color);
    }
  }
  std::uint32_t channel_ = 3;

 private:
  const Source::Impl& source_;
  const char* map_;
  std::optional<SurfaceTexture> texture_;
};

class Color : public OwnColor {
 public:
  using OwnColor::OwnColor;
  void operator()(const HighPoint& point, float* value) const override {
    if (!point.found) return;
    float color[4];
    color_at(point, color);
    std::copy_n(color, 3, value);
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
              "colour of the high poly: its textures, filtered over each texel's footprint, or "
              "else its vertex colours",
              0,
              1};
  row.info.options = "color";
  row.info.missed = MissedTexels::neighbours;
  row.info.other_names = "albedo base_color basecolor colour diffuse diffuse_color";
  row.weighted = true;
  row.follows_positions = true;
  row.make = [](const MapRequest& request) {
    return make_point_map(request, color_map().info,
                          std::unique_ptr<PointFunction>(std::make_unique<Color>(
                              request.source, request.options.color, "color")));
  };
  return row;
}

MapRow opacity_map() {
  MapRow row;
  row.info = {MapKind{"opacity"},
              1,
              MapType::scalar,
              "how opaque the high poly is, 0 to 1: its texture's alpha, or else its vertices'; 0 "
              "where nothing was found",
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
                              request.source, request.options.opacity, "opacity")));
  };
  return row;
}

}  // namespace kiln
