#include <algorithm>
#include <cmath>
#include <cstdio>

#include "lab/canvas.h"
#include "lab/study_output.h"

namespace kiln::cli {
namespace {

constexpr Color kWhite = {1, 1, 1}, kInk = {0.13F, 0.13F, 0.15F}, kSoft = {0.42F, 0.42F, 0.45F},
                kOneSided = {0.72F, 0.74F, 0.78F};
constexpr std::uint32_t kMargin = 28, kTitle = 80, kGap = 20, kFoot = 58;
constexpr std::uint32_t kBar = 30, kBarRoom = 175;
constexpr double kLarge = 17, kSmall = 12.5;

/// The bar's end: the round number that at most 3% of the worst picture's pixels exceed.
double scale_end(const Image& degrees) {
  std::vector<float> values;
  std::copy_if(degrees.pixels.begin(), degrees.pixels.end(), std::back_inserter(values),
               [](float v) { return v >= 0; });
  constexpr double kEnds[] = {1, 2, 5, 10, 20, 30, 45, 60, 90};
  for (const double end : kEnds) {
    const auto above =
        std::count_if(values.begin(), values.end(), [&](float v) { return v > end; });
    if (static_cast<double>(above) <= 0.03 * static_cast<double>(values.size())) return end;
  }
  return 180;
}

Image colored(const Image& degrees, double end) {
  std::vector<Color> colors(1025);
  for (std::size_t i = 0; i < colors.size(); ++i) colors[i] = heat(static_cast<double>(i) / 1024);
  Image result{degrees.width, degrees.height, 3, {}};
  for (const float value : degrees.pixels) {
    const Color color = value == -1 ? kWhite
                        : value < 0
                            ? kOneSided
                            : colors[static_cast<std::size_t>(std::min(1.0, value / end) * 1024)];
    result.pixels.insert(result.pixels.end(), color.begin(), color.end());
  }
  return result;
}

std::string plural(std::uint64_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

/// Three lines over a panel: what it is, how it was made, its figures.
void caption(Canvas& canvas, std::uint32_t x, const std::string& title, const std::string& how,
             const std::string& figures) {
  canvas.text(x, kMargin + 16, kLarge, kInk, title);
  canvas.text(x, kMargin + 41, kSmall, kSoft, how);
  canvas.text(x, kMargin + 63, kSmall, kSoft, figures);
}

std::string title(const char* rank, const Setting& setting) {
  return std::string(rank) + ": " +
         (setting.curve == Curve::paper ? "as in the paper, " : "Kiln's own matching, ") +
         plural(setting.views, "view");
}

std::string how(const Setting& setting) {
  return plural(setting.faces, "face") + ", " + std::to_string(setting.size) + " x " +
         std::to_string(setting.size) + " map";
}

std::string figures(const Setting& setting) {
  char text[96];
  std::snprintf(text, sizeof text, "mean %.2f degrees, 95%% under %.1f, over %u views",
                setting.normal.mean_degrees, setting.normal.p95_degrees, kHeldOutViews);
  return text;
}

}  // namespace

Image study_picture(const Study& study) {
  const std::uint32_t side = study.original.width;
  const std::uint32_t top = kMargin + kTitle;
  Canvas canvas(2 * kMargin + 3 * side + 3 * kGap + kBarRoom, top + side + kFoot, kWhite);
  const double end = scale_end(study.worst.degrees);
  const Setting& worst = study.settings[study.worst.setting];
  const Setting& best = study.settings[study.best.setting];

  std::uint32_t x = kMargin;
  canvas.place(study.original, x, top);
  caption(canvas, x, "the dense mesh", "the original: its normals are the reference", "");
  x += side + kGap;
  canvas.place(colored(study.worst.degrees, end), x, top);
  caption(canvas, x, title("worst", worst), how(worst), figures(worst));
  x += side + kGap;
  canvas.place(colored(study.best.degrees, end), x, top);
  caption(canvas, x, title("best", best), how(best), figures(best));
  x += side + kGap;

  canvas.text(x, kMargin + 16, kSmall, kInk, "error of the");
  canvas.text(x, kMargin + 36, kSmall, kInk, "normal, degrees");
  const std::uint32_t bar_top = top + 20;
  const std::uint32_t length = side - 40;
  for (std::uint32_t i = 0; i < length; ++i) {
    canvas.fill(x, bar_top + i, kBar, 1, heat(1 - (i + 0.5) / length));
  }
  constexpr int kTicks = 5;
  for (int i = 0; i <= kTicks; ++i) {
    const double share = static_cast<double>(i) / kTicks;
    const std::uint32_t y = bar_top + static_cast<std::uint32_t>(std::lround((1 - share) * length));
    canvas.fill(x + kBar, y - 1, 7, 2, kInk);
    char text[32];
    std::snprintf(text, sizeof text, "%g%s", share * end, i == kTicks ? " and more" : "");
    canvas.text(x + kBar + 13, y + kSmall / 2, kSmall, kInk, text);
  }
  const double foot = top + side + 32;
  canvas.fill(kMargin + side + kGap, static_cast<std::uint32_t>(foot) - 12, 14, 14, kOneSided);
  canvas.text(kMargin + side + kGap + 24, foot, kSmall, kSoft,
              "seen of only one of the two meshes: not measured");
  return canvas.image();
}

}  // namespace kiln::cli
