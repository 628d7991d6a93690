#include "lab/canvas.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

namespace kiln::cli {
namespace {

// Letters as strokes through points "xy": x from 0, y up, with the base line at 2, small letters up to 6
// and digits up to 8; strokes are separated by blanks. '~' makes a smooth curve of the points (a quadratic
// B-spline that starts and ends at the first and last), '@' a closed one. The number is the width.
struct Glyph {
  int width;
  const char* strokes;
};
const std::map<char, Glyph> kGlyphs = {
    {' ', {3, ""}},
    {'0', {4, "@08484202"}},
    {'1', {3, "172822 1232"}},
    {'2', {4, "~0708484502 0242"}},
    {'3', {4, "~0708484525 ~2545420203"}},
    {'4', {4, "380444 3832"}},
    {'5', {4, "480805 ~0526464202 0203"}},
    {'6', {4, "~380804 @06464202"}},
    {'7', {4, "084812"}},
    {'8', {4, "@08484505 @05454202"}},
    {'9', {4, "@08484404 ~46434202"}},
    {'a', {4, "@06464202 4642"}},
    {'b', {4, "0802 @06464202"}},
    {'c', {4, "~454606024243"}},
    {'d', {4, "4842 @06464202"}},
    {'e', {4, "0444 ~444606024243"}},
    {'f', {3, "~381815 1512 0636"}},
    {'g', {4, "@06464202 ~46404000"}},
    {'h', {4, "0802 ~04064643 4342"}},
    {'i', {0, "0602 0808"}},
    {'j', {1, "~16111000 1818"}},
    {'k', {4, "0802 3603 1442"}},
    {'l', {1, "~08020212"}},
    {'m', {6, "0602 ~04063633 3332 ~34366663 6362"}},
    {'n', {4, "0602 ~04064643 4342"}},
    {'o', {4, "@06464202"}},
    {'p', {4, "0600 @06464202"}},
    {'q', {4, "4640 @06464202"}},
    {'r', {3, "0602 ~040636"}},
    {'s', {4, "~4546060444420203"}},
    {'t', {3, "1813 ~131232 0636"}},
    {'u', {4, "4642 ~44420205 0506"}},
    {'v', {4, "062246"}},
    {'w', {6, "0622354266"}},
    {'x', {4, "0642 0246"}},
    {'y', {4, "0622 4610"}},
    {'z', {4, "06460242"}},
    {'.', {0, "0202"}},
    {':', {0, "0202 0505"}},
    {',', {1, "1201"}},
    {'\'', {0, "0806"}},
    {'%', {6, "@08282505 4812 @45656242"}},
    {'(', {1, "~19060411"}},
    {')', {1, "~09161401"}},
    {'-', {3, "0535"}},
    {'+', {4, "2622 0444"}},
    {'=', {4, "0545 0343"}},
    {'/', {4, "0148"}},
};
constexpr Glyph kUnknown = {4, "0848420208"};
constexpr double kDigit = 6;   // units from the base line to a digit's top
constexpr double kSpace = 2;   // units between glyphs
constexpr double kStroke = 1;  // width of a stroke, units

struct Point {
  double x, y;
};

const Glyph& glyph(char c) {
  if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  const auto found = kGlyphs.find(c);
  return found == kGlyphs.end() ? kUnknown : found->second;
}

/// A quadratic B-spline through the middles of the control polygon's sides.
std::vector<Point> smooth(const std::vector<Point>& control, bool closed) {
  constexpr int kSteps = 10;
  const auto middle = [](const Point& a, const Point& b) {
    return Point{(a.x + b.x) / 2, (a.y + b.y) / 2};
  };
  std::vector<Point> curve;
  const std::size_t count = control.size();
  for (std::size_t i = closed ? 0 : 1; i < (closed ? count : count - 1); ++i) {
    const Point& before = control[(i + count - 1) % count];
    const Point& after = control[(i + 1) % count];
    const Point from = !closed && i == 1 ? before : middle(before, control[i]);
    const Point to = !closed && i + 2 == count ? after : middle(control[i], after);
    for (int k = 0; k <= kSteps; ++k) {
      const double t = static_cast<double>(k) / kSteps;
      const double a = (1 - t) * (1 - t), b = 2 * t * (1 - t), c = t * t;
      curve.push_back(
          {a * from.x + b * control[i].x + c * to.x, a * from.y + b * control[i].y + c * to.y});
    }
  }
  return curve;
}

/// The strokes of a glyph as lines through points, in units with the base line at 0.
std::vector<std::vector<Point>> lines(const Glyph& glyph) {
  std::vector<std::vector<Point>> result;
  const std::string strokes = std::string(glyph.strokes) + ' ';
  char kind = ' ';
  std::vector<Point> points;
  for (std::size_t i = 0; i < strokes.size(); ++i) {
    if (strokes[i] == ' ') {
      if (!points.empty()) result.push_back(kind == ' ' ? points : smooth(points, kind == '@'));
      points.clear();
      kind = ' ';
    } else if (strokes[i] == '~' || strokes[i] == '@') {
      kind = strokes[i];
    } else {
      points.push_back(
          {static_cast<double>(strokes[i] - '0'), static_cast<double>(strokes[i + 1] - '0' - 2)});
      ++i;
    }
  }
  return result;
}

double distance_to(const Point& p, const Point& a, const Point& b) {
  const double dx = b.x - a.x, dy = b.y - a.y;
  const double square = dx * dx + dy * dy;
  const double t =
      square > 0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / square, 0.0, 1.0) : 0.0;
  return std::hypot(p.x - a.x - t * dx, p.y - a.y - t * dy);
}

/// Oklab with lightness, chroma and hue, to linear RGB.
std::array<double, 3> oklch_to_linear(double lightness, double chroma, double hue) {
  const double a = chroma * std::cos(hue), b = chroma * std::sin(hue);
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
  const double m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
  const double s = std::pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
  return {4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
          -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
          -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s};
}

}  // namespace

Color heat(double value) {
  const double t = std::clamp(value, 0.0, 1.0);
  const double lightness = 0.16 + 0.80 * t;
  const double hue = (285 + 180 * t) * std::numbers::pi / 180;
  double chroma = 0.19;
  std::array<double, 3> linear{};
  // As colourful as a screen can show at this lightness.
  for (;; chroma *= 0.98) {
    linear = oklch_to_linear(lightness, chroma, hue);
    const auto [least, most] = std::minmax_element(linear.begin(), linear.end());
    if ((*least >= 0 && *most <= 1) || chroma < 1e-3) break;
  }
  Color color{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = std::clamp(linear[c], 0.0, 1.0);
    color[c] =
        static_cast<float>(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
  }
  return color;
}

Canvas::Canvas(std::uint32_t width, std::uint32_t height, const Color& background)
    : image_{width, height, 3, std::vector<float>(std::size_t{3} * width * height)} {
  fill(0, 0, width, height, background);
}

void Canvas::blend(std::uint32_t x, std::uint32_t y, float share, const Color& color) {
  float* pixel = image_.at(x, y);
  for (std::size_t c = 0; c < 3; ++c) pixel[c] += share * (color[c] - pixel[c]);
}

void Canvas::fill(std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height,
                  const Color& color) {
  for (std::uint32_t j = y; j < std::min(image_.height, y + height); ++j) {
    for (std::uint32_t i = x; i < std::min(image_.width, x + width); ++i) blend(i, j, 1, color);
  }
}

void Canvas::place(const Image& picture, std::uint32_t x, std::uint32_t y) {
  for (std::size_t row = 0; row < picture.height; ++row) {
    std::copy_n(picture.at(0, row), std::size_t{3} * picture.width, image_.at(x, y + row));
  }
}

double Canvas::text_width(double height, std::string_view words) {
  double units = 0;
  for (const char c : words) units += glyph(c).width + kSpace;
  return units * height / kDigit;
}

void Canvas::text(double x, double y, double height, const Color& color, std::string_view words) {
  const double unit = height / kDigit;
  for (const char c : words) {
    const Glyph& shape = glyph(c);
    const std::vector<std::vector<Point>> strokes = lines(shape);
    const auto clamp_to = [](double v, std::uint32_t limit) {
      return static_cast<std::uint32_t>(std::clamp(v, 0.0, static_cast<double>(limit)));
    };
    const std::uint32_t right = clamp_to(std::ceil(x + (shape.width + 1) * unit), image_.width);
    const std::uint32_t bottom = clamp_to(std::ceil(y + 3 * unit), image_.height);
    for (std::uint32_t j = clamp_to(y - 8 * unit, image_.height); j < bottom; ++j) {
      for (std::uint32_t i = clamp_to(x - unit, image_.width); i < right; ++i) {
        const Point p{(i + 0.5 - x) / unit, (y - j - 0.5) / unit};
        double nearest = 1e9;
        for (const std::vector<Point>& line : strokes) {
          for (std::size_t k = 0; k + 1 < line.size(); ++k) {
            nearest = std::min(nearest, distance_to(p, line[k], line[k + 1]));
          }
        }
        const double share = std::clamp((kStroke / 2 - nearest) * unit + 0.5, 0.0, 1.0);
        if (share > 0) blend(i, j, static_cast<float>(share), color);
      }
    }
    x += (shape.width + kSpace) * unit;
  }
}

}  // namespace kiln::cli
