#include "asset/scene_parts.h"

#include <algorithm>
#include <cmath>

#include "asset/mesh_builder.h"
#include "base/counted.h"
#include "base/input_log.h"
#include "base/option.h"
#include "io/file/text_scanner.h"
#include "kiln/material.h"

namespace kiln {

NormalTransform::NormalTransform(const AffineMap& m) {
  double determinant = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double *const a = &m[4 * ((k + 1) % 3)], *const b = &m[4 * ((k + 2) % 3)];
    columns_[k] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
  for (std::size_t i = 0; i < 3; ++i) determinant += m[i] * columns_[0][i];
  mirrors_ = determinant < 0;
}

Vec3 NormalTransform::operator()(double x, double y, double z) const {
  std::array<double, 3> transformed{};
  for (std::size_t i = 0; i < 3; ++i) {
    transformed[i] = columns_[0][i] * x + columns_[1][i] * y + columns_[2][i] * z;
  }
  // The length is computed in double precision, since cofactors of small scales would underflow in
  // floats.
  const double length =
      std::hypot(transformed[0], transformed[1], transformed[2]) * (mirrors_ ? -1 : 1);
  if (!std::isnormal(length)) return {};
  return {narrow(transformed[0] / length), narrow(transformed[1] / length),
          narrow(transformed[2] / length)};
}

void join_by_groups(std::vector<std::array<std::uint32_t, 2>> corners,
                    const std::vector<std::uint32_t>& masks, DisjointSets& pieces) {
  constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::sort(corners.begin(), corners.end());
  std::array<std::uint32_t, 32> first{};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i == 0 || corners[i][0] != corners[i - 1][0]) first.fill(kNone);
    const std::uint32_t corner = corners[i][1];
    for (std::size_t bit = 0; bit < 32; ++bit) {
      if ((masks[corner] >> bit & 1U) == 0) continue;
      if (first[bit] == kNone) {
        first[bit] = corner;
      } else {
        pieces.join(first[bit], corner);
      }
    }
  }
}

std::optional<std::uint32_t> UvSetChoice::find(const std::vector<std::string>& names) const {
  const std::string& requested_name = input_.options.uv_set_name;
  std::optional<std::uint32_t> found;
  for (std::uint32_t set = 0; set < names.size(); ++set) {
    if (requested_name.empty() ? set == input_.options.uv_set : names[set] == requested_name)
      found = set;
  }
  return found;
}

std::optional<std::uint32_t> UvSetChoice::choose(const std::vector<std::string>& names) {
  for (std::uint32_t set = 0; set < names.size(); ++set) {
    const std::string& set_name = names[set];
    known_pictures_.insert(std::to_string(set) +
                           (set_name.empty() ? "" : " \"" + printable(set_name) + "\""));
  }
  const std::optional<std::uint32_t> found = find(names);
  if (names.size() > 1) ++meshes_with_several_sets_;
  if (found && !first_chosen_set_) first_chosen_set_ = found;
  return found;
}

void UvSetChoice::check() const {
  const LoadMeshOptions& options = input_.options;
  if (!first_chosen_set_ && (!options.uv_set_name.empty() || options.uv_set != 0)) {
    std::string sets;
    for (const std::string& set : known_pictures_) sets += (sets.empty() ? "" : ", ") + set;
    input_.fail("",
                "none of its meshes has the UV set " +
                    (options.uv_set_name.empty() ? std::to_string(options.uv_set)
                                                 : "\"" + printable(options.uv_set_name) + "\"") +
                    "; its UV sets are " + (sets.empty() ? "none" : sets),
                "Choose one of these.");
  }
  if (meshes_with_several_sets_ != 0) {
    input_.warn("unused-properties",
                "meshes with more than one set of UVs, " +
                    std::to_string(meshes_with_several_sets_) + " in all: set " +
                    std::to_string(chosen()) + " is read.",
                meshes_with_several_sets_);
  }
}

ScenePictures::ScenePictures(const MeshInput& input)
    : input_(input),
      folder_(std::filesystem::path(input.file).parent_path()),
      finder_(folder_, input.warnings) {}

bool ScenePictures::is_outside(const std::filesystem::path& plain) const {
  return plain.is_absolute() || (!plain.empty() && *plain.begin() == "..");
}

std::filesystem::path ScenePictures::find(const std::string& name) {
  const std::filesystem::path normal_path = std::filesystem::path(name).lexically_normal();
  const bool allowed = !is_outside(normal_path) || input_.options.outside;
  // For a file outside of the folder, there may be a copy beside the mesh.
  std::filesystem::path file =
      finder_.find(folder_ / (allowed ? normal_path : normal_path.filename()), input_.file);
  std::error_code error;
  if (!is_picture_file(file)) return {};
  // The file beside the mesh may be a symbolic link that leads out of the folder.
  return input_.options.outside || lies_within(folder_, file) ? file : std::filesystem::path();
}

void ScenePictures::count_missing(const std::string& name) {
  const std::filesystem::path normal_path = std::filesystem::path(name).lexically_normal();
  const bool lies_outside = !input_.options.outside && register_file_check(folder_ / normal_path);
  (lies_outside ? outside_pictures_ : missing_pictures_).add(name);
}

void ScenePictures::set_transform(MaterialPicture& picture, double scale_u, double scale_v,
                                  bool is_moved, bool is_unambiguous) {
  const bool is_valid_scale =
      std::isfinite(scale_u) && scale_u != 0 && std::isfinite(scale_v) && scale_v != 0;
  if (!is_moved && ((scale_u == 1 && scale_v == 1) || (is_unambiguous && is_valid_scale))) {
    picture.uv_transform = {narrow(scale_u), 0, 0, 0, narrow(scale_v), 0};
  } else {
    transformed_pictures_.add(picture.file.filename().string());
  }
}

void ScenePictures::warn() const {
  if (missing_pictures_.count != 0) {
    input_.warn("picture-missing",
                counted(missing_pictures_.count, "picture") + " of materials, such as '" +
                    printable(missing_pictures_.first) +
                    "', cannot be found: only the materials' numbers are used.",
                missing_pictures_.count);
  }
  if (outside_pictures_.count != 0) {
    input_.warn("picture-outside",
                counted(outside_pictures_.count, "picture") + " of materials, such as '" +
                    printable(outside_pictures_.first) +
                    "', lie outside the folder of the file, and were not read: put them beside "
                    "it, or allow it (" +
                    option("allow_outside") + ").",
                outside_pictures_.count);
  }
  if (transformed_pictures_.count != 0) {
    input_.warn("texture-options",
                counted(transformed_pictures_.count, "picture") + " of materials, such as '" +
                    printable(transformed_pictures_.first) +
                    "', would be moved, turned or scaled in a way that programs read "
                    "differently: their transforms were ignored. Export glTF, or apply the "
                    "transforms to the UVs.",
                transformed_pictures_.count);
  }
}

}  // namespace kiln
