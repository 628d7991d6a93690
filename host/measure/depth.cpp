#include <algorithm>
#include <cmath>
#include <utility>

#include "kiln/measure.h"
#include "mesh/frame.h"

namespace kiln {

DepthReference::DepthReference(const Scene& reference, const Mesh& frame,
                               std::vector<ViewAngles> views, std::uint32_t size, bool z_up)
    : frame_(&frame),
      views_(std::move(views)),
      size_(size),
      z_up_(z_up),
      unit_(Frame::of(frame).diagonal) {
  for (const ViewAngles& view : views_) pictures_.push_back(draw(reference, view));
}

Image DepthReference::draw(const Scene& scene, const ViewAngles& view) const {
  RenderOptions options;
  options.size = size_;
  options.azimuth_degrees = view.azimuth_degrees;
  options.elevation_degrees = view.elevation_degrees;
  options.z_up = z_up_;
  options.frame = frame_;
  return scene.draw_depth(options);
}

DepthError DepthReference::compare(const Scene& other) const {
  DepthError error;
  double sum = 0, squares = 0;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const Image shown = draw(other, views_[v]);
    for (std::size_t i = 0; i < shown.pixels.size(); ++i) {
      const float a = pictures_[v].pixels[i], b = shown.pixels[i];
      const bool is_covered = b != Scene::kNoDepth;
      if ((a != Scene::kNoDepth) != is_covered) ++error.one_sided;
      if (a == Scene::kNoDepth || !is_covered) continue;
      const double difference = std::abs(double{a} - double{b}) / unit_;
      ++error.pixels;
      sum += difference;
      squares += difference * difference;
      error.max = std::max(error.max, difference);
    }
  }
  if (error.pixels == 0) return error;
  const auto count = static_cast<double>(error.pixels);
  error.mean = sum / count;
  error.rms = std::sqrt(squares / count);
  return error;
}

}  // namespace kiln
