#include "unwrap/unwrap_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "base/formatted.h"
#include "pack/rectangle_packing.h"
#include "unwrap/pairing.h"

namespace kiln {
namespace {

/// Largest ratio of the legs of a patch's right triangles. Longer patches would waste space and reduce the shear only
/// slightly.
constexpr double kMaxAspect = 16;
/// The padding is halved while triangles cover less than this share of the map.
constexpr double kMinPairCoverage = 0.25;

/// A rectangle for one or two right triangles. The first triangle has its right angle at the lower left corner of the
/// rectangle, the second at the upper right. They share the diagonal, or have padding along it.
struct Patch {
  double width = 0, height = 0;  ///< Legs of the right triangles, as lengths on the surface
  std::array<std::uint32_t, 2> triangle{kNoIndex, kNoIndex};
  std::array<std::uint8_t, 2> apex{};  ///< For each triangle, the corner that gets the right angle
  bool has_two_triangles = false;
};

/// Sets the sides of a patch in the ratio `width` : `height`, with an area that suffices for two triangles.
void set_sides(Patch& patch, double width, double height, double area) {
  const double max_ratio = kMaxAspect;
  double ratio = std::clamp(width / height, 1 / max_ratio, max_ratio);
  if (!(ratio > 0))
    ratio = 1;  // The ratio is NaN if both legs have length 0, or if their squares overflow
  patch.height = std::sqrt(area / ratio);
  patch.width = patch.height * ratio;
}

Patch single_patch(const TriangleShape& shape, std::uint32_t triangle) {
  Patch patch;
  const double* edge = shape.squared_edge;
  const std::uint8_t apex = edge[0] >= edge[1] && edge[0] >= edge[2] ? 0
                            : edge[1] >= edge[2]                     ? 1
                                                                     : 2;
  patch.triangle[0] = triangle;
  patch.apex[0] = apex;
  set_sides(patch, std::sqrt(edge[(apex + 2) % 3]), std::sqrt(edge[(apex + 1) % 3]),
            2 * shape.area);
  return patch;
}

/// Lets pairs of single triangles of similar shape and size share a rectangle.
void share_patches(std::vector<Patch>& singles, std::vector<Patch>& patches) {
  const auto key = [](const Patch& p) {
    return std::tuple(std::lround(2 * std::log2(p.width / p.height)), p.width * p.height,
                      p.triangle[0]);
  };
  std::sort(singles.begin(), singles.end(),
            [&](const Patch& a, const Patch& b) { return key(a) < key(b); });
  for (std::size_t i = 0; i < singles.size(); ++i) {
    Patch patch = singles[i];
    if (i + 1 < singles.size()) {
      const Patch& next = singles[i + 1];
      const double area = patch.width * patch.height, next_area = next.width * next.height;
      if (std::get<0>(key(patch)) == std::get<0>(key(next)) && next_area <= 1.5 * area) {
        patch.triangle[1] = next.triangle[0];
        patch.apex[1] = next.apex[0];
        set_sides(patch, std::sqrt(patch.width * next.width), std::sqrt(patch.height * next.height),
                  0.5 * (area + next_area));
        ++i;
      }
    }
    patches.push_back(patch);
  }
}

/// \param squares  true: all patches are squares, and each unpaired triangle gets a square of its own
std::vector<Patch> make_patches(const Mesh& mesh, const std::vector<TriangleShape>& shapes,
                                bool squares) {
  const Pairing pairing = pair_triangles(mesh.positions, mesh.triangles, shapes);
  std::vector<Patch> patches, singles;
  patches.reserve(pairing.pairs);
  for (std::uint32_t t = 0; t < shapes.size(); ++t) {
    if (!(shapes[t].area > 0)) continue;
    const std::uint32_t other = pairing.partner[t];
    if (other == kNoIndex) {
      singles.push_back(single_patch(shapes[t], t));
    } else if (t < other) {
      Patch patch;
      patch.triangle = {t, other};
      patch.apex = {pairing.apex[t], pairing.apex[other]};
      patch.has_two_triangles = true;
      double width = 0, height = 0;
      for (const std::size_t k : {0u, 1u}) {
        const TriangleShape& shape = shapes[patch.triangle[k]];
        width += std::sqrt(shape.squared_edge[(patch.apex[k] + 2) % 3]);
        height += std::sqrt(shape.squared_edge[(patch.apex[k] + 1) % 3]);
      }
      set_sides(patch, width, height, shapes[t].area + shapes[other].area);
      patches.push_back(patch);
    }
  }
  if (!squares) {
    share_patches(singles, patches);
    return patches;
  }
  patches.insert(patches.end(), singles.begin(), singles.end());
  for (Patch& patch : patches) patch.width = patch.height = 1;
  return patches;
}

/// Rules by which patches are rounded to cells of whole grid steps.
struct GridRules {
  std::uint32_t side = 0;           ///< Number of steps along a side of the grid
  std::uint32_t padding_steps = 1;  ///< Padding between charts in steps
  std::uint32_t min_leg_steps = 2;  ///< Shortest leg in steps
  bool squares = false;             ///< True if both legs have equal length
};

struct Legs {
  std::uint32_t width, height;
};

Legs legs_of(const Patch& patch, double scale, const GridRules& rule) {
  const double max_steps = 1e9;
  const auto round_to_steps = [&](double value) {
    return std::max(rule.min_leg_steps,
                    static_cast<std::uint32_t>(std::min(value + 0.5, max_steps)));
  };
  if (rule.squares) {
    const std::uint32_t leg_steps = std::max(2U, round_to_steps(patch.width * scale));
    return {leg_steps, leg_steps};
  }
  // The second side is chosen after the first one is rounded, to keep the area.
  const double area = patch.width * scale * (patch.height * scale);
  Legs legs{};
  if (patch.width >= patch.height) {
    legs.height = round_to_steps(patch.height * scale);
    legs.width = round_to_steps(area / legs.height);
  } else {
    legs.width = round_to_steps(patch.width * scale);
    legs.height = round_to_steps(area / legs.width);
  }
  if (legs.width == 1 && legs.height == 1)
    (patch.width >= patch.height ? legs.width : legs.height) = 2;
  return legs;
}

PackSize cell_of(const Patch& patch, const Legs& legs, const GridRules& rule) {
  const bool has_padded_diagonal = patch.triangle[1] != kNoIndex && !patch.has_two_triangles;
  const std::uint32_t total_padding =
      rule.padding_steps + (has_padded_diagonal ? rule.padding_steps : 0);
  return {legs.width + total_padding, legs.height + total_padding};
}

struct PairLayout {
  GridRules rule;
  double scale = 0;
  std::vector<PackPlace> places;
  double coverage = 0;
};

class LayoutSearch {
 public:
  LayoutSearch(const std::vector<Patch>& patches, const GridRules& rule)
      : patches_(patches), grid_rules_(rule), sizes_(patches.size()) {}

  /// The layout at the largest scale that can be packed, to about 0.1%; nullopt if not even the smallest cells can be
  /// packed.
  std::optional<PairLayout> run() {
    const double side = grid_rules_.side;
    double area = 0;
    for (const Patch& patch : patches_) area += patch.width * patch.height;
    // Upper bound of the scale: without padding or waste. The scale is lowered from there until the cells' area is at
    // most the grid's, then until the cells can be packed.
    const double ceiling = side / std::sqrt(area);
    if (cells_area(0) > side * side) return std::nullopt;
    double low = 0, high = ceiling;
    for (int i = 0; i < 40 && (high - low) > 1e-4 * high; ++i) {
      const double middle = 0.5 * (low + high);
      (cells_area(middle) <= side * side ? low : high) = middle;
    }
    const double max_scale = high;
    double fits = 0;
    double step = 0.01;
    for (double scale = max_scale; scale > 1e-4 * max_scale;
         scale *= 1 - step, step = std::min(0.2, step * 1.5)) {
      if (pack(scale)) {
        fits = scale;
        break;
      }
      high = scale;
    }
    if (fits == 0 && !pack(0)) return std::nullopt;
    for (int i = 0; i < 8 && high - fits > 1e-3 * high; ++i) {
      const double middle = 0.5 * (fits + high);
      (pack(middle) ? fits : high) = middle;
    }
    return std::move(best_layout_);
  }

 private:
  double cells_area(double scale) const {
    double area = 0;
    for (const Patch& patch : patches_) {
      const PackSize cell = cell_of(patch, legs_of(patch, scale, grid_rules_), grid_rules_);
      area += static_cast<double>(cell.width) * cell.height;
    }
    return area;
  }

  /// Packs the patches at a scale. Stores the layout if they fit.
  bool pack(double scale) {
    double covered_area = 0;
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      const Legs legs = legs_of(patches_[i], scale, grid_rules_);
      sizes_[i] = cell_of(patches_[i], legs, grid_rules_);
      if (std::max(sizes_[i].width, sizes_[i].height) > grid_rules_.side) return false;
      covered_area += static_cast<double>(legs.width) * legs.height *
                      (patches_[i].triangle[1] == kNoIndex ? 0.5 : 1.0);
    }
    if (!pack_rectangles(sizes_, grid_rules_.side, cell_places_)) return false;
    const double side = grid_rules_.side;
    best_layout_ = PairLayout{grid_rules_, scale, cell_places_, covered_area / (side * side)};
    return true;
  }

  const std::vector<Patch>& patches_;
  GridRules grid_rules_;
  std::vector<PackSize> sizes_;
  std::vector<PackPlace> cell_places_;
  std::optional<PairLayout> best_layout_;
};

/// Tries the requested padding first, then less padding. If all fail, allows triangles with legs of one step instead of
/// two, and grid steps finer than a texel.
PairLayout find_layout(const std::vector<Patch>& patches, const UnwrapOptions& options) {
  const bool squares = options.method == UnwrapMethod::squares;
  for (std::uint32_t padding = options.border_texels; padding >= 1; padding /= 2) {
    auto layout = LayoutSearch(patches, {options.size, padding, 2, squares}).run();
    if (layout && (layout->coverage >= kMinPairCoverage || padding == 1)) return std::move(*layout);
  }
  for (std::uint32_t side = options.size; side <= std::uint32_t{1} << 22; side *= 2) {
    if (auto layout = LayoutSearch(patches, {side, 1, 1, squares}).run()) return std::move(*layout);
  }
  throw Error(ErrorCode::input,
              "unwrap: the mesh has too many triangles for a texture; simplify it first");
}

/// Writes the UVs of one patch. Coordinates within the cell are those before its rotation.
class UvWriter {
 public:
  UvWriter(const PairLayout& layout, Mesh& mesh) : layout_(layout), mesh_(mesh) {}

  void write(const Patch& patch, const PackPlace& place) {
    const Legs legs = legs_of(patch, layout_.scale, layout_.rule);
    const PackSize cell = cell_of(patch, legs, layout_.rule);
    const std::uint32_t margin = layout_.rule.padding_steps / 2;
    const std::uint32_t end_x = cell.width - layout_.rule.padding_steps;
    const std::uint32_t end_y = cell.height - layout_.rule.padding_steps;
    const auto add_uv = [&](std::uint32_t x, std::uint32_t y) {
      // The rotation is a quarter turn counter-clockwise, never a reflection, so that no chart is mirrored.
      const std::uint32_t u = place.turned ? end_y - y : x;
      const std::uint32_t v = place.turned ? x : y;
      const double side = layout_.rule.side;
      mesh_.uvs.push_back({static_cast<float>((place.x + margin + u) / side),
                           static_cast<float>((place.y + margin + v) / side)});
      return static_cast<std::uint32_t>(mesh_.uvs.size() - 1);
    };
    const std::uint32_t right = add_uv(legs.width, 0);
    const std::uint32_t up = add_uv(0, legs.height);
    set_corner_uvs(patch, 0, add_uv(0, 0), right, up);
    if (patch.triangle[1] == kNoIndex) return;
    const std::uint32_t corner = add_uv(end_x, end_y);
    if (patch.has_two_triangles) {
      set_corner_uvs(patch, 1, corner, up, right);
    } else {
      const std::uint32_t left = add_uv(end_x - legs.width, end_y);
      set_corner_uvs(patch, 1, corner, left, add_uv(end_x, end_y - legs.height));
    }
  }

 private:
  void set_corner_uvs(const Patch& patch, std::size_t which, std::uint32_t apex, std::uint32_t next,
                      std::uint32_t last) {
    Triangle& uv = mesh_.uv_triangles[patch.triangle[which]];
    uv[patch.apex[which]] = apex;
    uv[(patch.apex[which] + 1) % 3] = next;
    uv[(patch.apex[which] + 2) % 3] = last;
  }

  const PairLayout& layout_;
  Mesh& mesh_;
};

/// Standard deviation, over the surface, of log2(texture area / surface area).
double density_spread(const std::vector<Patch>& patches, const PairLayout& layout,
                      const std::vector<TriangleShape>& shapes) {
  double weight = 0, sum = 0, squares = 0;
  const auto for_each_triangle = [&](const auto& body) {
    for (const Patch& patch : patches) {
      const Legs legs = legs_of(patch, layout.scale, layout.rule);
      const double uv_area = 0.5 * legs.width * legs.height;
      for (const std::uint32_t t : patch.triangle) {
        if (t != kNoIndex) body(shapes[t].area, std::log2(uv_area) - std::log2(shapes[t].area));
      }
    }
  };
  for_each_triangle([&](double area, double density) { weight += area, sum += area * density; });
  const double mean = sum / weight;
  for_each_triangle(
      [&](double area, double density) { squares += area * (density - mean) * (density - mean); });
  return std::sqrt(squares / weight);
}

}  // namespace

Mesh unwrap_pairs(const Mesh& mesh, const UnwrapOptions& options,
                  const std::vector<TriangleShape>& shapes, UnwrapReport* report) {
  const std::vector<Patch> patches =
      make_patches(mesh, shapes, options.method == UnwrapMethod::squares);
  const PairLayout layout = find_layout(patches, options);

  Mesh result = mesh;
  result.tangents.clear();  // tangents belong to the previous UVs
  result.uvs.clear();
  result.uvs.reserve(patches.size() * 4 + 1);
  result.uvs.push_back({0, 0});  // The one UV shared by all corners of triangles without texels
  result.uv_triangles.assign(mesh.triangles.size(), Triangle{0, 0, 0});
  UvWriter uv_writer(layout, result);
  for (std::size_t i = 0; i < patches.size(); ++i) uv_writer.write(patches[i], layout.places[i]);
  if (report == nullptr) return result;

  for (const Patch& patch : patches) {
    report->charts += patch.has_two_triangles || patch.triangle[1] == kNoIndex ? 1 : 2;
  }
  report->coverage = layout.coverage;
  report->density_spread = density_spread(patches, layout, shapes);
  report->border_texels =
      static_cast<double>(layout.rule.padding_steps) * options.size / layout.rule.side;
  if (report->border_texels < options.border_texels) {
    report->warnings.push_back(
        {"border-shrunk",
         std::to_string(report->charts) + " charts leave no room for a padding of " +
             std::to_string(options.border_texels) + " texels at a size of " +
             std::to_string(options.size) + "; the padding was reduced to " +
             decimal(report->border_texels) + " texels. Use a larger size or fewer faces",
         report->charts});
  }
  return result;
}

}  // namespace kiln
