#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "lab/canvas.h"
#include "lab/rating.h"

namespace kiln::cli {
namespace {

constexpr Color kWhite = {1, 1, 1}, kInk = {0.13F, 0.13F, 0.15F}, kSoft = {0.42F, 0.42F, 0.45F},
                kMissed = {0.55F, 0.60F, 0.68F}, kFolded = {0.10F, 0.75F, 0.85F};
constexpr std::uint32_t kMargin = 28, kHead = 70, kGap = 16, kBarHeight = 16, kFoot = 90;
constexpr double kLarge = 17, kSmall = 12.5;
constexpr float kBeside = -99;

/// One measure: how to get its picture and what its values mean.
struct Column {
  std::string title, unit;
  std::function<const Image&(const Rating&)> image;
  std::function<double(const Rating&, float)> value;  ///< Of a pixel; below 0: none
};

/// A round number that few values exceed.
double scale_end(const Ratings& ratings, const Column& column) {
  std::vector<double> values;
  for (const Rating& row : ratings.rows) {
    for (const float pixel : column.image(row).pixels) {
      const double value = column.value(row, pixel);
      if (value >= 0) values.push_back(value);
    }
  }
  if (values.empty()) return 1;
  const std::size_t rank = values.size() * 97 / 100;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank),
                   values.end());
  const double wanted = std::max(values[rank], 1e-12);
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= wanted) return step * power;
  }
  return 10 * power;
}

Image colored(const Rating& row, const Column& column, double end) {
  const Image& values = column.image(row);
  Image result{values.width, values.height, 3, {}};
  for (std::size_t i = 0; i < values.pixels.size(); ++i) {
    const float pixel = values.pixels[i];
    Color color = kWhite;
    if (pixel != kBeside && !(column.unit == "degrees" && pixel == -1)) {
      const double value = column.value(row, pixel);
      color = value == -2 ? kFolded : value < 0 ? kMissed : heat(std::min(1.0, value / end));
      // The shape shows through, but does not darken much: the scale's colours stay readable.
      const float light = 0.65F + 0.35F * std::min(1.0F, row.shape.pixels[i] / 0.75F);
      for (float& channel : color) channel *= light;
    }
    result.pixels.insert(result.pixels.end(), color.begin(), color.end());
  }
  return result;
}

void scale_bar(Canvas& canvas, std::uint32_t x, std::uint32_t y, std::uint32_t width, double end) {
  for (std::uint32_t i = 0; i < width; ++i) {
    canvas.fill(x + i, y, 1, kBarHeight, heat((i + 0.5) / width));
  }
  char text[48];
  canvas.text(x, y + kBarHeight + 18, kSmall, kInk, "0");
  std::snprintf(text, sizeof text, "%g and more", end);
  canvas.text(x + width - Canvas::text_width(kSmall, text), y + kBarHeight + 18, kSmall, kInk,
              text);
}

}  // namespace

Image ratings_picture(const Ratings& ratings) {
  const auto share = [](const Rating& row, float pixel) {
    return pixel < 0 ? -1.0 : 100 * pixel / row.match.diagonal;
  };
  const std::vector<Column> columns = {
      {"distance in space", "% of the diagonal",
       [](const Rating& row) -> const Image& { return row.object_distance; }, share},
      {"distance in pictures", "% of the diagonal",
       [](const Rating& row) -> const Image& { return row.image_distance; }, share},
      {"uneven sampling", "octaves", [](const Rating& row) -> const Image& { return row.stretch; },
       [](const Rating& row, float pixel) {
         // Between folded (-63) and what is there, the map's filter makes values that are neither.
         if (pixel < -63.5F) return -1.0;
         if (pixel < -17) return -2.0;
         return std::abs(pixel - row.match.mean_stretch);
       }},
      {"error of the normal", "degrees",
       [](const Rating& row) -> const Image& { return row.angle; },
       [](const Rating&, float pixel) { return pixel < 0 ? -1.0 : double{pixel}; }},
  };
  const std::uint32_t side = ratings.rows.front().shape.width;
  const auto count = static_cast<std::uint32_t>(columns.size());
  const auto rows = static_cast<std::uint32_t>(ratings.rows.size());
  constexpr std::uint32_t kNames = 130;
  Canvas canvas(2 * kMargin + kNames + count * side + (count - 1) * kGap,
                kMargin + kHead + rows * (side + kGap) + kFoot, kWhite);
  for (std::uint32_t c = 0; c < count; ++c) {
    const std::uint32_t x = kMargin + kNames + c * (side + kGap);
    const double end = scale_end(ratings, columns[c]);
    canvas.text(x, kMargin + 18, kLarge, kInk, columns[c].title);
    canvas.text(x, kMargin + 44, kSmall, kSoft, columns[c].unit);
    for (std::uint32_t r = 0; r < rows; ++r) {
      canvas.place(colored(ratings.rows[r], columns[c], end), x,
                   kMargin + kHead + r * (side + kGap));
    }
    scale_bar(canvas, x, kMargin + kHead + rows * (side + kGap), side, end);
  }
  for (std::uint32_t r = 0; r < rows; ++r) {
    const double y = kMargin + kHead + r * (side + kGap) + side / 2.0;
    canvas.text(kMargin, y, kLarge, kInk, ratings.rows[r].method);
  }
  const double foot = kMargin + kHead + rows * (side + kGap) + kFoot - 14;
  const auto at = static_cast<std::uint32_t>(foot) - 12;
  canvas.fill(kMargin + kNames, at, 14, 14, kMissed);
  canvas.text(kMargin + kNames + 22, foot, kSmall, kSoft,
              "missed, never visible, or seen of one mesh only");
  canvas.fill(kMargin + kNames + 640, at, 14, 14, kFolded);
  canvas.text(kMargin + kNames + 662, foot, kSmall, kSoft, "folded over");
  return canvas.image();
}

}  // namespace kiln::cli
