#include "picture/angles.h"

#include "kiln/measure.h"
#include "kiln/render.h"

namespace kiln::cli {
namespace {

constexpr Colour kOneSided = {0.55F, 0.60F, 0.68F};

}  // namespace

void AnglePictures::add(const Scene& high, const Scene& low, RenderOptions view) {
  view.show_normals = true;
  view.samples = 1;
  angles_.push_back(normal_angles(high.draw(view), low.draw(view)));
}

double AnglePictures::mean(std::size_t index) const {
  double sum = 0;
  std::size_t count = 0;
  for (const float angle : angles_[index].pixels) {
    if (angle < 0) continue;
    sum += angle;
    ++count;
  }
  return count != 0 ? sum / static_cast<double>(count) : 0;
}

Scale AnglePictures::scale() const {
  std::vector<double> values;
  for (const Image& angles : angles_) {
    for (const float angle : angles.pixels) {
      if (angle >= 0) values.push_back(angle);
    }
  }
  return {scale_end(std::move(values)), "degrees", {{kOneSided, "seen of one mesh only"}}};
}

Image AnglePictures::picture(std::size_t index, const Scale& scale) const {
  return coloured(angles_[index], scale, [](float angle) -> std::optional<Colour> {
    if (angle >= 0) return std::nullopt;
    return angle == -1 ? kWhite : kOneSided;
  });
}

}  // namespace kiln::cli
