// Cuts the transparent parts off a mesh.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/formatted.h"
#include "image/value_range.h"
#include "kiln/error.h"
#include "kiln/material.h"
#include "mesh/frame.h"
#include "mesh/normals.h"
#include "mesh/udim.h"
#include "mesh/usable.h"
#include "mesh/uv_grid.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

using Weights = std::array<double, 3>;  // barycentric weights of a triangle's three corners
// A part of a triangle, given by the barycentric coordinates of its corners in the triangle
using Part = std::array<Weights, 3>;

// Maximum depth of recursive subdivision into quarters. It resolves 65,536 texels along a side of a
// triangle.
constexpr int kMaxDepth = 16;

Weights interpolate_weights(const Weights& a, const Weights& b, double share) {
  Weights result{};
  for (std::size_t k = 0; k < 3; ++k) result[k] = a[k] + (b[k] - a[k]) * share;
  return result;
}

class Cutter {
 public:
  Cutter(const Mesh& mesh, const Texture& opacity, double threshold, CutOutReport& report)
      : mesh_(mesh), opacity_(opacity), threshold_(threshold), report_(report) {
    for (const std::shared_ptr<const Image>& image : opacity.images) {
      pictures_.push_back(std::make_unique<BoundedChannel>(*image, opacity.channel));
    }
    const CornerNormals corners = corner_normals(mesh, mesh.positions);
    result_ = mesh;
    result_.normals = corners.normals;
    normal_triangles_ = corners.triangles;
    result_.polygons.clear();
    for (auto* list : {&result_.triangles, &result_.uv_triangles, &result_.normal_triangles}) {
      list->clear();
    }
    for (auto* names : {&result_.groups, &result_.objects, &result_.materials}) names->clear();
  }

  Mesh run() {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) cut_triangle(t);
    if (result_.triangles.empty()) {
      throw Error(ErrorCode::input,
                  "The mesh '" + mesh_.name +
                      "' has no point whose opacity reaches the threshold: lower the threshold.");
    }
    delete_slivers();
    return std::move(result_);
  }

 private:
  /// Deletes clipped parts whose area rounds to 0: a match cannot find points on them, and they
  /// should not be reported as flaws of the input.
  void delete_slivers() {
    const Frame frame = Frame::of(result_);
    const std::vector<Vec3> positions = frame.to_frame(result_);
    std::size_t kept_count = 0;
    for (std::size_t t = 0; t < result_.triangles.size(); ++t) {
      if (is_clipped_part_[t] && !has_area(positions, result_.triangles[t])) continue;
      for (auto* list : {&result_.triangles, &result_.uv_triangles, &result_.normal_triangles}) {
        (*list)[kept_count] = (*list)[t];
      }
      for (auto* names : {&result_.groups, &result_.objects, &result_.materials}) {
        if (!names->empty()) (*names)[kept_count] = (*names)[t];
      }
      ++kept_count;
    }
    for (auto* list : {&result_.triangles, &result_.uv_triangles, &result_.normal_triangles}) {
      list->resize(kept_count);
    }
    for (auto* names : {&result_.groups, &result_.objects, &result_.materials}) {
      if (!names->empty()) names->resize(kept_count);
    }
  }

  void cut_triangle(std::size_t triangle) {
    current_triangle_ = triangle;
    clipped_parts_.clear();
    const Triangle& uv = mesh_.uv_triangles[triangle];
    bool is_finite_uv = true;
    for (std::size_t k = 0; k < 3; ++k) {
      uv_[k] = uv_pool_of(triangle)[uv[k]];
      is_finite_uv = is_finite_uv && is_finite(uv_[k]);
    }
    picture_ = nullptr;
    udim_set_ = Texture::kNone;
    tile_corner_ = {};
    double constant_opacity = 1;
    transform_ = {1, 0, 0, 0, 1, 0};
    picture_wraps_ = {};
    opacity_scale_ = 1, opacity_offset_ = 0;
    corner_alphas_ = {1, 1, 1};
    if (opacity_.image_of.empty()) {
      select_picture(0);
    } else {
      const std::uint32_t material = mesh_.materials[triangle];
      const std::uint32_t picture = opacity_.image_of[material];
      if (!opacity_.uv_transforms.empty()) transform_ = opacity_.uv_transforms[material];
      if (!opacity_.wraps.empty()) picture_wraps_ = opacity_.wraps[material];
      if (!opacity_.factors.empty()) {
        opacity_scale_ = double{opacity_.factors[material].times[opacity_.channel]};
        opacity_offset_ = opacity_.channel < 3 ? double{opacity_.factors[material].plus} : 0;
      }
      if (!opacity_.times_vertex_colors.empty() && opacity_.times_vertex_colors[material] &&
          !mesh_.colors.empty()) {
        for (std::size_t k = 0; k < 3; ++k) {
          corner_alphas_[k] = mesh_.colors[mesh_.triangles[triangle][k]][3] / 255.0;
        }
      }
      if (picture != Texture::kNone) select_picture(picture);
      if (material < opacity_.plain.size() && (picture == Texture::kNone || has_udim_set())) {
        constant_opacity = opacity_.plain[material][opacity_.channel];
      }
    }
    const Part whole_triangle{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const bool has_equal_alpha =
        corner_alphas_[0] == corner_alphas_[1] && corner_alphas_[1] == corner_alphas_[2];
    if (!is_finite_uv || (picture_ == nullptr && !has_udim_set() && has_equal_alpha)) {
      if (constant_opacity * corner_alphas_[0] >= threshold_ || !is_finite_uv)
        clipped_parts_.push_back(whole_triangle);
    } else {
      constant_opacity_ = constant_opacity;
      cut(whole_triangle, 0);
    }
    if (clipped_parts_.empty()) {
      ++report_.gone;
    } else if (clipped_parts_.size() == 1 && clipped_parts_[0] == whole_triangle) {
      ++report_.whole;
      add_names();
      result_.triangles.push_back(mesh_.triangles[triangle]);
      result_.uv_triangles.push_back(uv);
      result_.normal_triangles.push_back(normal_triangles_[triangle]);
      is_clipped_part_.push_back(false);
    } else {
      ++report_.cut;
      vertices_.clear();
      for (const Part& part : clipped_parts_) add(part);
    }
  }

  /// Selects a picture or a set of UDIM tiles. The tile is selected later, for each part.
  void select_picture(std::uint32_t picture) {
    const bool is_udim_set =
        std::any_of(opacity_.tiles.begin(), opacity_.tiles.end(),
                    [&](const TextureTile& tile) { return tile.set == picture; });
    if (is_udim_set) {
      udim_set_ = picture;
      picture_wraps_ = {TextureWrap::clamp, TextureWrap::clamp};
    } else {
      picture_ = pictures_[picture].get();
    }
  }
  bool has_udim_set() const { return udim_set_ != Texture::kNone; }

  /// Selects the UDIM tile that contains a UV. If the set lacks that tile, the
  /// material's constant opacity is used.
  void select_tile(double u, double v) {
    const std::uint32_t number = udim_of(u, v);
    picture_ = nullptr;
    tile_corner_ = {};
    for (const TextureTile& tile : opacity_.tiles) {
      if (tile.set != udim_set_ || tile.tile != number) continue;
      picture_ = pictures_[tile.image].get();
      tile_corner_ = udim_corner(number);
      return;
    }
  }

  /// The triangle's UVs in the UV set that the opacity texture of its material uses.
  const std::vector<Vec2>& uv_pool_of(std::size_t triangle) const {
    if (opacity_.uv_sets.empty()) return mesh_.uvs;
    const std::uint32_t uv_set = opacity_.uv_sets[mesh_.materials[triangle]];
    if (uv_set == mesh_.uv_set) return mesh_.uvs;
    return std::find_if(mesh_.other_uvs.begin(), mesh_.other_uvs.end(),
                        [&](const UvSet& set) { return set.set == uv_set; })
        ->uvs;
  }

  static std::array<double, 2> interpolate_uv(const std::array<Vec2, 3>& uv, const Weights& w) {
    return {w[0] * uv[0].x + w[1] * uv[1].x + w[2] * uv[2].x,
            w[0] * uv[0].y + w[1] * uv[1].y + w[2] * uv[2].y};
  }
  std::array<double, 2> uv_at(const Weights& w) const { return interpolate_uv(uv_, w); }

  /// Appends the UV of a point of the current triangle to a list.
  void add_uv(const std::vector<Vec2>& from, const Weights& w, std::vector<Vec2>& to) const {
    const auto& [a, b, c] = mesh_.uv_triangles[current_triangle_];
    const std::array<double, 2> uv = interpolate_uv({from[a], from[b], from[c]}, w);
    to.push_back({static_cast<float>(uv[0]), static_cast<float>(uv[1])});
  }

  std::array<double, 2> to_picture_uv(const std::array<double, 2>& uv) const {
    const auto& m = transform_;
    return {m[0] * uv[0] + m[1] * uv[1] + m[2], m[3] * uv[0] + m[4] * uv[1] + m[5]};
  }

  /// True if a part spans several UDIM tiles and is still large enough to be split.
  bool spans_tiles(double u0, double u1, double v0, double v1) const {
    constexpr double kRounding = 1e-6, kMinSpan = 1.0 / 4096;
    const auto spans = [](double a, double b) {
      return std::floor(a + kRounding) < std::floor(b - kRounding);
    };
    return has_udim_set() && (spans(u0, u1) || spans(v0, v1)) &&
           std::max(u1 - u0, v1 - v0) > kMinSpan;
  }

  double alpha_at(const Weights& w) const {
    return w[0] * corner_alphas_[0] + w[1] * corner_alphas_[1] + w[2] * corner_alphas_[2];
  }

  double opacity_at(const Weights& w, const std::array<double, 2>& uv) const {
    const double picture =
        picture_ == nullptr
            ? constant_opacity_
            : picture_->at(uv[0], uv[1], picture_wraps_) * opacity_scale_ + opacity_offset_;
    return corner_alphas_ == Weights{1, 1, 1} ? picture : picture * alpha_at(w);
  }

  BoundedChannel::Range over(const Part& part, double u0, double v0, double u1, double v1) const {
    BoundedChannel::Range range{static_cast<float>(constant_opacity_),
                                static_cast<float>(constant_opacity_)};
    if (picture_ != nullptr) {
      range = picture_->over(u0, v0, u1, v1, picture_wraps_);
      const auto scaled = [&](float value) {
        return static_cast<float>(value * opacity_scale_ + opacity_offset_);
      };
      range = {scaled(opacity_scale_ < 0 ? range.most : range.least),
               scaled(opacity_scale_ < 0 ? range.least : range.most)};
    }
    if (corner_alphas_ == Weights{1, 1, 1}) return range;
    const auto [least, most] =
        std::minmax({alpha_at(part[0]), alpha_at(part[1]), alpha_at(part[2])});
    return {range.least * static_cast<float>(least), range.most * static_cast<float>(most)};
  }

  void cut(const Part& part, int depth) {
    std::array<std::array<double, 2>, 3> uv{};
    for (std::size_t k = 0; k < 3; ++k) uv[k] = to_picture_uv(uv_at(part[k]));
    auto [u0, u1] = std::minmax({uv[0][0], uv[1][0], uv[2][0]});
    auto [v0, v1] = std::minmax({uv[0][1], uv[1][1], uv[2][1]});
    if (depth < kMaxDepth && spans_tiles(u0, u1, v0, v1)) return split_into_quarters(part, depth);
    if (has_udim_set()) {
      select_tile((uv[0][0] + uv[1][0] + uv[2][0]) / 3, (uv[0][1] + uv[1][1] + uv[2][1]) / 3);
      for (auto& at : uv) at[0] -= tile_corner_[0], at[1] -= tile_corner_[1];
      u0 -= tile_corner_[0], u1 -= tile_corner_[0], v0 -= tile_corner_[1], v1 -= tile_corner_[1];
    }
    const BoundedChannel::Range range = over(part, u0, v0, u1, v1);
    if (range.most < threshold_) return;
    if (range.least >= threshold_) {
      clipped_parts_.push_back(part);
      return;
    }
    const bool is_below_a_texel =
        picture_ == nullptr ||
        std::max((u1 - u0) * picture_->texels_across(), (v1 - v0) * picture_->texels_down()) <= 1;
    if (is_below_a_texel || depth == kMaxDepth) return clip(part, uv);
    split_into_quarters(part, depth);
  }

  void split_into_quarters(const Part& part, int depth) {
    const Weights ab = interpolate_weights(part[0], part[1], 0.5),
                  bc = interpolate_weights(part[1], part[2], 0.5);
    const Weights ca = interpolate_weights(part[2], part[0], 0.5);
    const std::size_t first_part = clipped_parts_.size();
    cut({part[0], ab, ca}, depth + 1);
    cut({ab, part[1], bc}, depth + 1);
    cut({ca, bc, part[2]}, depth + 1);
    cut({ab, bc, ca}, depth + 1);
    // If nothing was cut off the four quarters, they are replaced by the undivided part.
    if (clipped_parts_.size() == first_part + 4 &&
        clipped_parts_[first_part] == Part{part[0], ab, ca} &&
        clipped_parts_[first_part + 1] == Part{ab, part[1], bc} &&
        clipped_parts_[first_part + 2] == Part{ca, bc, part[2]} &&
        clipped_parts_[first_part + 3] == Part{ab, bc, ca}) {
      clipped_parts_.resize(first_part);
      clipped_parts_.push_back(part);
    }
  }

  /// Clips a part to the region where the opacity, interpolated linearly, reaches the threshold.
  void clip(const Part& part, const std::array<std::array<double, 2>, 3>& uv) {
    std::array<double, 3> opacity_excess{};
    for (std::size_t k = 0; k < 3; ++k) opacity_excess[k] = opacity_at(part[k], uv[k]) - threshold_;
    std::vector<Weights> polygon;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      if (opacity_excess[k] >= 0) polygon.push_back(part[k]);
      if ((opacity_excess[k] >= 0) == (opacity_excess[next] >= 0)) continue;
      // The triangles on both sides of an edge interpolate from the same end of it, so that both
      // compute the same point.
      const bool starts_at_k = opacity_excess[k] >= 0;
      const std::size_t a = starts_at_k ? k : next, b = starts_at_k ? next : k;
      polygon.push_back(interpolate_weights(
          part[a], part[b], opacity_excess[a] / (opacity_excess[a] - opacity_excess[b])));
    }
    for (std::size_t k = 2; k < polygon.size(); ++k) {
      clipped_parts_.push_back({polygon[0], polygon[k - 1], polygon[k]});
    }
  }

  void add_names() {
    if (!mesh_.groups.empty()) result_.groups.push_back(mesh_.groups[current_triangle_]);
    if (!mesh_.objects.empty()) result_.objects.push_back(mesh_.objects[current_triangle_]);
    if (!mesh_.materials.empty()) result_.materials.push_back(mesh_.materials[current_triangle_]);
  }

  void add(const Part& part) {
    add_names();
    Triangle at{}, uv{}, normal{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::array<std::uint32_t, 3> vertex = vertex_of(part[k]);
      at[k] = vertex[0];
      uv[k] = vertex[1];
      normal[k] = vertex[2];
    }
    result_.triangles.push_back(at);
    result_.uv_triangles.push_back(uv);
    result_.normal_triangles.push_back(normal);
    is_clipped_part_.push_back(true);
  }

  /// Indices of the position, UV and normal of a point of the current triangle. Values that are not
  /// in the result's lists yet are appended.
  std::array<std::uint32_t, 3> vertex_of(const Weights& w) {
    const Triangle& corners = mesh_.triangles[current_triangle_];
    for (std::size_t k = 0; k < 3; ++k) {
      if (w[k] == 1) {
        return {corners[k], mesh_.uv_triangles[current_triangle_][k],
                normal_triangles_[current_triangle_][k]};
      }
    }
    const auto [entry, added] = vertices_.emplace(w, std::array<std::uint32_t, 3>{});
    if (!added) return entry->second;
    Vec3d position{}, normal{};
    for (std::size_t k = 0; k < 3; ++k) {
      position += to_double(mesh_.positions[corners[k]]) * w[k];
      normal += to_double(result_.normals[normal_triangles_[current_triangle_][k]]) * w[k];
    }
    const double size = length(normal);
    entry->second = {static_cast<std::uint32_t>(result_.positions.size()),
                     static_cast<std::uint32_t>(result_.uvs.size()),
                     static_cast<std::uint32_t>(result_.normals.size())};
    result_.positions.push_back(to_float(position));
    add_uv(mesh_.uvs, w, result_.uvs);
    for (std::size_t k = 0; k < mesh_.other_uvs.size(); ++k) {
      if (mesh_.other_uvs[k].uvs.size() == mesh_.uvs.size()) {
        add_uv(mesh_.other_uvs[k].uvs, w, result_.other_uvs[k].uvs);
      }
    }
    result_.normals.push_back(to_float(size > 0 ? normal * (1 / size) : normal));
    if (!mesh_.colors.empty()) {
      std::array<std::uint8_t, 4> color{};
      for (std::size_t c = 0; c < 4; ++c) {
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k) sum += w[k] * mesh_.colors[corners[k]][c];
        color[c] = static_cast<std::uint8_t>(std::lround(std::clamp(sum, 0.0, 255.0)));
      }
      result_.colors.push_back(color);
    }
    return entry->second;
  }

  const Mesh& mesh_;
  const Texture& opacity_;
  double threshold_;
  CutOutReport& report_;
  std::vector<std::unique_ptr<BoundedChannel>> pictures_;
  std::vector<Triangle> normal_triangles_;
  Mesh result_;
  // For each triangle of the result, true if it is a clipped part of an input triangle
  std::vector<bool> is_clipped_part_;

  std::size_t current_triangle_ = 0;  // the triangle that is being cut
  std::array<Vec2, 3> uv_;
  const BoundedChannel* picture_ = nullptr;
  // Affine transform from the mesh's UVs to the picture's UVs
  std::array<float, 6> transform_{1, 0, 0, 0, 1, 0};
  // set of UDIM tiles that picture_ belongs to
  std::uint32_t udim_set_ = Texture::kNone;
  std::array<double, 2> tile_corner_{};  // lower left corner of the tile in UV space
  BoundedChannel::Wraps picture_wraps_{};
  // opacity = opacity_scale_ * texture + opacity_offset_
  double opacity_scale_ = 1, opacity_offset_ = 0;
  Weights corner_alphas_{1, 1, 1};  // vertex alpha at the triangle's corners
  double constant_opacity_ = 1;     // opacity of a material without a picture
  std::vector<Part> clipped_parts_;
  std::map<Weights, std::array<std::uint32_t, 3>> vertices_;
};

void check(const Mesh& mesh, const Texture& opacity, double threshold) {
  if (!(threshold > 0 && threshold <= 1)) {
    throw Error(ErrorCode::usage, "The threshold of opacity is " + decimal(threshold) +
                                      ": it must be above 0, and 1 at most.");
  }
  if (mesh.uv_triangles.size() != mesh.triangles.size() || mesh.uvs.empty()) {
    throw Error(ErrorCode::input, "'" + mesh.name +
                                      "' has no UVs, which its opacity texture needs: give it a "
                                      "layout.");
  }
  const bool by_material = !opacity.image_of.empty();
  bool is_valid = by_material ? opacity.image_of.size() == mesh.material_names.size() &&
                                    mesh.materials.size() == mesh.triangles.size()
                              : opacity.images.size() == 1 || !opacity.tiles.empty();
  is_valid =
      is_valid &&
      (opacity.uv_transforms.empty() || opacity.uv_transforms.size() == opacity.image_of.size()) &&
      (opacity.wraps.empty() || opacity.wraps.size() == opacity.image_of.size()) &&
      (opacity.uv_sets.empty() || opacity.uv_sets.size() == opacity.image_of.size()) &&
      (opacity.factors.empty() || opacity.factors.size() == opacity.image_of.size()) &&
      (opacity.times_vertex_colors.empty() ||
       opacity.times_vertex_colors.size() == opacity.image_of.size());
  for (const std::uint32_t picture : opacity.image_of) {
    is_valid = is_valid && (picture == Texture::kNone || picture < opacity.images.size());
  }
  for (const TextureTile& tile : opacity.tiles) {
    is_valid = is_valid && tile.set < opacity.images.size() && tile.image < opacity.images.size();
  }
  for (const std::uint32_t uv_set : opacity.uv_sets) {
    is_valid = is_valid &&
               (uv_set == mesh.uv_set ||
                std::any_of(mesh.other_uvs.begin(), mesh.other_uvs.end(), [&](const UvSet& set) {
                  return set.set == uv_set && set.uvs.size() == mesh.uvs.size();
                }));
  }
  for (const std::shared_ptr<const Image>& image : opacity.images) {
    is_valid = is_valid && image != nullptr && image->channels >= 1 && image->width != 0 &&
               image->height != 0 &&
               image->pixels.size() == std::size_t{image->width} * image->height * image->channels;
  }
  if (!is_valid || opacity.channel > 3) {
    throw Error(ErrorCode::input, "The opacity texture does not fit the mesh '" + mesh.name +
                                      "': it needs one picture, or one for each material.");
  }
}

}  // namespace

Mesh cut_out(const Mesh& mesh, const Texture& opacity, double threshold, CutOutReport* report) {
  check(mesh, opacity, threshold);
  CutOutReport discarded_report;
  return Cutter(mesh, opacity, threshold, report != nullptr ? *report : discarded_report).run();
}

}  // namespace kiln
