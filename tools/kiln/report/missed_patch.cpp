#include "report/missed_patch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "arguments/parse.h"

namespace kiln::cli {
namespace {

constexpr std::uint8_t kMissed = 2;  // of BakeResult::coverage

/// Weights of a UV triangle's corners at a UV; none where it has no area.
std::optional<std::array<double, 3>> weights_at(const std::array<Vec2, 3>& corner, const Vec2& uv) {
  const auto doubled_area = [](const Vec2& a, const Vec2& b, const Vec2& c) {
    return (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x);
  };
  const double area = doubled_area(corner[0], corner[1], corner[2]);
  if (area == 0 || !std::isfinite(area)) return std::nullopt;
  return std::array<double, 3>{doubled_area(uv, corner[1], corner[2]) / area,
                               doubled_area(corner[0], uv, corner[2]) / area,
                               doubled_area(corner[0], corner[1], uv) / area};
}

/// The point of a mesh at a UV: in the first triangle that holds it, else in the one that nearly does.
std::array<double, 3> position_at(const Mesh& low, const Vec2& uv) {
  double best = -std::numeric_limits<double>::infinity();
  std::array<double, 3> position{};
  for (std::size_t t = 0; t < low.uv_triangles.size() && best < 0; ++t) {
    std::array<Vec2, 3> corner;
    for (std::size_t k = 0; k < 3; ++k) corner[k] = low.uvs[low.uv_triangles[t][k]];
    const auto weights = weights_at(corner, uv);
    if (!weights) continue;
    const double least = *std::min_element(weights->begin(), weights->end());
    if (!(least > best)) continue;
    best = least;
    position = low.origin;
    double sum = 0;
    for (const double weight : *weights) sum += std::max(weight, 0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = low.positions[low.triangles[t][k]];
      const double weight = std::max((*weights)[k], 0.0) / sum;
      position[0] += weight * double{p.x};
      position[1] += weight * double{p.y};
      position[2] += weight * double{p.z};
    }
  }
  return position;
}

/// Takes the patch that a texel belongs to out of `open`.
std::vector<std::size_t> take_patch(std::size_t start, std::size_t width, std::vector<bool>& open) {
  std::vector<std::size_t> patch = {start};
  open[start] = false;
  const auto visit = [&](std::size_t texel) {
    if (!open[texel]) return;
    open[texel] = false;
    patch.push_back(texel);
  };
  for (std::size_t i = 0; i < patch.size(); ++i) {
    const std::size_t texel = patch[i];
    if (texel % width != 0) visit(texel - 1);
    if (texel % width + 1 != width) visit(texel + 1);
    if (texel >= width) visit(texel - width);
    if (texel + width < open.size()) visit(texel + width);
  }
  return patch;
}

/// The texel that is nearest to the mean; of several the first.
std::size_t middle(std::vector<std::size_t> patch, std::size_t width) {
  std::sort(patch.begin(), patch.end());
  const auto place = [&](std::size_t texel) {
    const std::size_t row = texel / width;
    return std::pair(static_cast<double>(texel % width), static_cast<double>(row));
  };
  double x = 0, y = 0;
  for (const std::size_t texel : patch) {
    const auto [column, row] = place(texel);
    x += column;
    y += row;
  }
  x /= static_cast<double>(patch.size());
  y /= static_cast<double>(patch.size());
  const auto squared = [&](std::size_t texel) {
    const auto [column, row] = place(texel);
    return (column - x) * (column - x) + (row - y) * (row - y);
  };
  return *std::min_element(patch.begin(), patch.end(),
                           [&](std::size_t a, std::size_t b) { return squared(a) < squared(b); });
}

}  // namespace

std::optional<MissedPatch> largest_missed_patch(std::span<const std::uint8_t> coverage,
                                                std::uint32_t width, std::uint32_t height,
                                                const Mesh& low) {
  std::vector<bool> open(coverage.size());
  for (std::size_t i = 0; i < coverage.size(); ++i) open[i] = coverage[i] == kMissed;
  std::vector<std::size_t> largest;
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (!open[i]) continue;
    std::vector<std::size_t> patch = take_patch(i, width, open);
    if (patch.size() > largest.size()) largest = std::move(patch);
  }
  if (largest.empty()) return std::nullopt;
  MissedPatch result;
  result.texels = largest.size();
  const std::size_t texel = middle(std::move(largest), width);
  result.column = static_cast<std::uint32_t>(texel % width);
  result.row = static_cast<std::uint32_t>(texel / width);
  result.uv = {static_cast<float>((result.column + 0.5) / width),
               static_cast<float>(1 - (result.row + 0.5) / height)};
  result.position = position_at(low, result.uv);
  return result;
}

std::string describe(const std::optional<MissedPatch>& patch) {
  if (!patch) return "No texel was missed as a whole.";
  return formatted(
      "The largest missed patch has %llu texel%s. Its middle lies at column %u, row %u, UV "
      "(%.4g, %.4g), position (%.5g, %.5g, %.5g).",
      static_cast<unsigned long long>(patch->texels), patch->texels == 1 ? "" : "s", patch->column,
      patch->row, double{patch->uv.x}, double{patch->uv.y}, patch->position[0], patch->position[1],
      patch->position[2]);
}

}  // namespace kiln::cli
