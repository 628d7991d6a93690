#include "lab/value_tiles.h"

#include <algorithm>
#include <cmath>

#include "kiln/render.h"
#include "lab/table.h"

namespace kiln::cli {
namespace {

constexpr float kFirstValue = 3, kLastValue = 65535;
constexpr double kLongest = 950;  // pixels of a mesh in a picture

}  // namespace

Json ValueTiles::add(const Image& picture, const std::function<double(float)>& value) {
  width_ = picture.width;
  height_ = picture.height;
  std::vector<double> values;
  for (const float pixel : picture.pixels) values.push_back(value(pixel));
  const double most = std::max(*std::max_element(values.begin(), values.end()), 1e-12);
  std::vector<float> codes;
  for (const double v : values) {
    codes.push_back(v < 0
                        ? static_cast<float>(kBeside - v)
                        : kFirstValue + static_cast<float>(v / most) * (kLastValue - kFirstValue));
  }
  tiles_.push_back(std::move(codes));
  counts_.push_back(true);
  return {{"index", tiles_.size() - 1}, {"most", most}, {"gray", false}};
}

Json ValueTiles::add_gray(const Image& picture) {
  width_ = picture.width;
  height_ = picture.height;
  std::vector<float> levels;
  for (const float pixel : picture.pixels) levels.push_back(pixel * kLastValue);
  tiles_.push_back(std::move(levels));
  counts_.push_back(false);
  return {{"index", tiles_.size() - 1}, {"gray", true}};
}

ValueTiles::Box ValueTiles::box() const {
  Box box{width_, height_, 0, 0};
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    if (!counts_[t]) continue;
    for (std::size_t i = 0; i < tiles_[t].size(); ++i) {
      if (tiles_[t][i] == 0) continue;
      const std::size_t x = i % width_, y = i / width_;
      box = {std::min(box.left, x), std::min(box.top, y), std::max(box.right, x + 1),
             std::max(box.bottom, y + 1)};
    }
  }
  if (box.left >= box.right) return {0, 0, width_, height_};
  constexpr std::size_t kMargin = 2;
  return {box.left - std::min(box.left, kMargin), box.top - std::min(box.top, kMargin),
          std::min(width_, box.right + kMargin), std::min(height_, box.bottom + kMargin)};
}

Json ValueTiles::size() const {
  const Box b = box();
  return {b.right - b.left, b.bottom - b.top};
}

Image ValueTiles::image() const {
  const Box b = box();
  Image result{static_cast<std::uint32_t>(b.right - b.left),
               static_cast<std::uint32_t>((b.bottom - b.top) * tiles_.size()),
               1,
               {}};
  for (const std::vector<float>& tile : tiles_) {
    for (std::size_t y = b.top; y < b.bottom; ++y) {
      for (std::size_t x = b.left; x < b.right; ++x) {
        result.pixels.push_back(tile[y * width_ + x] / kLastValue);
      }
    }
  }
  return result;
}

Plot ValueTiles::plot(const std::string& name, const Json& blocks, const char* not_known) const {
  const Json legend = Json::array({fields("code text", {1, not_known})});
  return {name,
          fields("kind image tile blocks legend",
                 {"pictures", name + "_plot.png", size(), blocks, legend}),
          image()};
}

Image gray(const Image& picture) {
  Image result{picture.width, picture.height, 1, {}};
  for (std::size_t i = 0; i < picture.pixels.size(); i += 3) {
    result.pixels.push_back(picture.pixels[i] * 0.3F + picture.pixels[i + 1] * 0.6F +
                            picture.pixels[i + 2] * 0.1F);
  }
  return result;
}

std::uint32_t picture_size(const Scene& scene, RenderOptions view, double side) {
  view.size = 256;
  view.samples = 1;
  view.show_normals = true;
  ValueTiles tiles;
  tiles.add(gray(scene.draw(view)),
            [](float pixel) { return pixel > 0 ? double{pixel} : ValueTiles::kBeside; });
  const Json covered = tiles.size();
  const double width = covered[0].number() / view.size;
  const double height = covered[1].number() / view.size;
  return static_cast<std::uint32_t>(
      std::min(side / std::sqrt(width * height), kLongest / std::max(width, height)));
}

}  // namespace kiln::cli
