#include "picture/sheet.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/memory.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {

constexpr std::int64_t kGap = 12, kBarWidth = 260, kBarHeight = 16, kSwatchSide = 16;
constexpr auto kTextLineHeight = static_cast<std::int64_t>(kTextHeight);

std::string number(double value) { return formatted("%g", value); }

std::int64_t label_width(const std::string& text) {
  return static_cast<std::int64_t>(std::ceil(text_width(text)));
}

/// The layout of the colour scale's parts, which wrap to further lines if the sheet is too narrow.
struct Legend {
  struct Part {
    std::int64_t x, y, width;
  };
  std::vector<Part> parts;
  std::int64_t width = 0, height = 0;
};

std::int64_t scale_bar_width(const Scale& scale) {
  return label_width("0") + kBarWidth + label_width(number(scale.end) + " " + scale.unit) +
         2 * kGap;
}

Legend place_legend(const std::optional<Scale>& scale, std::int64_t room) {
  Legend legend;
  if (!scale) return legend;
  std::vector<std::int64_t> widths = {scale_bar_width(*scale)};
  for (const auto& [colour, text] : scale->others)
    widths.push_back(kSwatchSide + 6 + label_width(text));
  std::int64_t x = 0, y = 0;
  for (const std::int64_t width : widths) {
    if (x != 0 && x + width > room) {
      x = 0;
      y += kTextLineHeight + kGap / 2;
    }
    legend.parts.push_back({x, y, width});
    legend.width = std::max(legend.width, x + width);
    x += width + 2 * kGap;
  }
  legend.height = y + kTextLineHeight + kGap;
  return legend;
}

void draw_legend(Canvas& canvas, const Scale& scale, const Legend& legend, std::int64_t left,
                 std::int64_t top) {
  const std::int64_t bar = left + legend.parts[0].x + label_width("0") + kGap / 2;
  canvas.text(static_cast<double>(left + legend.parts[0].x), static_cast<double>(top), "0");
  for (std::int64_t i = 0; i < kBarWidth; ++i) {
    canvas.fill(bar + i, top + 2, 1, kBarHeight,
                scale_colour((static_cast<double>(i) + 0.5) / kBarWidth));
  }
  canvas.text(static_cast<double>(bar + kBarWidth) + 0.5 * kGap, static_cast<double>(top),
              number(scale.end) + " " + scale.unit);
  for (std::size_t k = 0; k < scale.others.size(); ++k) {
    const Legend::Part& part = legend.parts[k + 1];
    canvas.fill(left + part.x, top + part.y + 2, kSwatchSide, kSwatchSide, scale.others[k].first);
    canvas.text(static_cast<double>(left + part.x + kSwatchSide + 6),
                static_cast<double>(top + part.y), scale.others[k].second);
  }
}

/// Chooses the number of columns for which the sheet's aspect ratio is nearest to 8 : 5.
std::size_t choose_columns(std::size_t count, std::int64_t cell_width, std::int64_t cell_height) {
  std::size_t best = 1;
  double best_deviation = 1e300;
  for (std::size_t columns = 1; columns <= count; ++columns) {
    const std::size_t rows = (count + columns - 1) / columns;
    const double shape = static_cast<double>(columns) * static_cast<double>(cell_width) /
                         (static_cast<double>(rows) * static_cast<double>(cell_height));
    // Empty cells count like a deviation of the aspect ratio.
    const double empty = static_cast<double>(rows * columns - count) / static_cast<double>(count);
    const double off = std::abs(std::log(shape / 1.6)) + empty;
    if (off < best_deviation) {
      best_deviation = off;
      best = columns;
    }
  }
  return best;
}

}  // namespace

Colour scale_colour(double share) {
  constexpr std::array<Colour, 9> kScaleColours = {{{0.001F, 0.000F, 0.014F},
                                                    {0.122F, 0.047F, 0.282F},
                                                    {0.333F, 0.059F, 0.427F},
                                                    {0.533F, 0.134F, 0.415F},
                                                    {0.729F, 0.212F, 0.333F},
                                                    {0.890F, 0.349F, 0.200F},
                                                    {0.976F, 0.549F, 0.039F},
                                                    {0.976F, 0.789F, 0.198F},
                                                    {0.988F, 1.000F, 0.645F}}};
  const double stop = std::clamp(share, 0.0, 1.0) * (kScaleColours.size() - 1);
  const std::size_t first = std::min(static_cast<std::size_t>(stop), kScaleColours.size() - 2);
  const auto part = static_cast<float>(stop - static_cast<double>(first));
  Colour colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    colour[c] =
        kScaleColours[first][c] + (kScaleColours[first + 1][c] - kScaleColours[first][c]) * part;
  }
  return colour;
}

double round_scale_end(std::vector<double> values) {
  double limit = 1e-9;
  if (!values.empty()) {
    const std::size_t rank = values.size() * 97 / 100 - (values.size() * 97 % 100 == 0 ? 1 : 0);
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank),
                     values.end());
    limit = std::max(limit, values[rank]);
  }
  const double power = std::pow(10, std::floor(std::log10(limit)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= limit * (1 - 1e-9)) return step * power;
  }
  return 10 * power;
}

Image map_to_colours(const Image& values, const Scale& scale,
                     const std::function<std::optional<Colour>(float)>& other) {
  Image result{values.width, values.height, 3, {}};
  result.pixels.reserve(values.pixels.size() * 3);
  for (const float value : values.pixels) {
    const std::optional<Colour> other_colour = other(value);
    const Colour colour = other_colour ? *other_colour : scale_colour(value / scale.end);
    result.pixels.insert(result.pixels.end(), colour.begin(), colour.end());
  }
  return result;
}

std::uint64_t bytes_of(const PictureGeometry& size, std::uint64_t count) {
  return std::uint64_t{size.width} * size.height * count * 3 * sizeof(float);
}

Image draw_with_room(const Scene& scene, const RenderOptions& options, std::uint64_t bytes) {
  constexpr std::uint64_t kBytesOfLaunches =
      8 << 20;  // PoCL keeps 6 MiB allocated after the first picture
  const ReservedMemory reserved(bytes == 0 ? 0 : bytes + kBytesOfLaunches);
  return scene.draw(options);
}

Image make_sheet(const std::vector<Panel>& panels, const std::optional<Scale>& scale,
                 std::size_t columns) {
  std::int64_t width = 0, height = 0, captions = 0;
  std::size_t lines = 0;
  for (const Panel& panel : panels) {
    width = std::max<std::int64_t>(width, panel.image.width);
    height = std::max<std::int64_t>(height, panel.image.height);
    lines = std::max(lines, panel.captions.size());
    for (const std::string& text : panel.captions) captions = std::max(captions, label_width(text));
  }
  const std::int64_t cell = std::max(width, captions) + kGap;
  const std::int64_t row = height + static_cast<std::int64_t>(lines) * kTextLineHeight + 2 * kGap;
  if (columns == 0) columns = choose_columns(panels.size(), cell, row);
  const auto across = static_cast<std::int64_t>(columns);
  const auto rows = static_cast<std::int64_t>((panels.size() + columns - 1) / columns);
  const Legend legend =
      place_legend(scale, std::max(across * cell, scale_bar_width(scale.value_or(Scale{}))));
  const std::int64_t page = std::max(across * cell, legend.width) + kGap;
  Canvas canvas(static_cast<std::uint32_t>(page),
                static_cast<std::uint32_t>(rows * row + legend.height + kGap));
  const std::int64_t margin = (page - across * cell + kGap) / 2;
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const std::int64_t left = margin + static_cast<std::int64_t>(i % columns) * cell;
    const std::int64_t top = kGap + static_cast<std::int64_t>(i / columns) * row;
    const Image& image = panels[i].image;
    canvas.put(image, left + (cell - kGap - image.width) / 2, top);
    double y = static_cast<double>(top + height) + 0.5 * kGap;
    for (const std::string& text : panels[i].captions) {
      canvas.text(
          static_cast<double>(left) + (static_cast<double>(cell - kGap) - text_width(text)) / 2, y,
          text);
      y += kTextHeight;
    }
  }
  if (scale) {
    draw_legend(canvas, *scale, legend, (page - legend.width) / 2, kGap + rows * row);
  }
  return canvas.take();
}

namespace {

constexpr Colour kOneMeshColour = {0.55F, 0.60F, 0.68F};

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
  return {round_scale_end(std::move(values)),
          "degrees",
          {{kOneMeshColour, "visible in only one mesh"}}};
}

Image AnglePictures::picture(std::size_t index, const Scale& scale) const {
  return map_to_colours(angles_[index], scale, [](float angle) -> std::optional<Colour> {
    if (angle >= 0) return std::nullopt;
    return angle == -1 ? kWhite : kOneMeshColour;
  });
}

}  // namespace kiln::cli
