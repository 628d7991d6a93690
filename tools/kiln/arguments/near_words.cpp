#include "arguments/near_words.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace kiln::cli {
namespace {

/// What Kiln calls otherwise.
struct OtherName {
  std::string_view theirs, ours;
};

constexpr std::array kOtherNames = {
    OtherName{"ambient_occlusion", "ao"},
    OtherName{"occlusion", "ao"},
    OtherName{"bent", "bent_normal"},
    OtherName{"cavity", "curvature"},
    OtherName{"concavity", "convexity"},
    OtherName{"albedo", "color"},
    OtherName{"base_color", "color"},
    OtherName{"basecolor", "color"},
    OtherName{"colour", "color"},
    OtherName{"diffuse", "color"},
    OtherName{"diffuse_color", "color"},
    OtherName{"alpha", "opacity"},
    OtherName{"material_id", "id"},
    OtherName{"object_id", "id"},
    OtherName{"object_normal", "normal_object"},
    OtherName{"world_normal", "normal_object"},
    OtherName{"wsnormal", "normal_object"},
    OtherName{"world_space_normal", "normal_object"},
    OtherName{"tangent_normal", "normal"},
    OtherName{"bump", "height"},
    OtherName{"wireframe_and_ray_fails", "wireframe"},
    OtherName{"nearest", "closest"},
    OtherName{"raycast", "ray"},
    OtherName{"rays", "ray"},
    OtherName{"none", "mark"},
    OtherName{"keep", "low"},
    OtherName{"world", "object"},
    OtherName{"png", "png16"},
    OtherName{"openexr", "exr"},
    OtherName{"hdr", "exr"},
    // Flags, of whatever command has ours.
    OtherName{"o", "out"},
    OtherName{"output", "out"},
    OtherName{"output_dir", "out"},
    OtherName{"out_dir", "out"},
    OtherName{"outdir", "out"},
    OtherName{"j", "json"},
    OtherName{"report", "json"},
    OtherName{"q", "quiet"},
    OtherName{"silent", "quiet"},
    OtherName{"gpu", "device"},
    OtherName{"resolution", "size"},
    OtherName{"res", "size"},
    OtherName{"normal_map", "normal"},
    OtherName{"ao_map", "occlusion"},
    OtherName{"camera", "view"},
    OtherName{"threshold", "iso"},
    OtherName{"isovalue", "iso"},
    OtherName{"iso_value", "iso"},
    OtherName{"preserve_uvs", "keep-uvs"},
    OtherName{"tolerance", "max-error"},
    OtherName{"flip_green", "flip-y"},
    OtherName{"margin", "gutter"},
    OtherName{"memory", "memory-limit"},
};

}  // namespace

std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t k = 0; k <= b.size(); ++k) row[k] = k;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t corner = row[0];
    row[0] = i;
    for (std::size_t k = 1; k <= b.size(); ++k) {
      const std::size_t above = row[k];
      row[k] = std::min({row[k] + 1, row[k - 1] + 1, corner + (a[i - 1] == b[k - 1] ? 0 : 1)});
      corner = above;
    }
  }
  return row[b.size()];
}

std::string nearest_word(const std::string& word, const std::vector<std::string>& words) {
  std::string name = word;
  std::replace(name.begin(), name.end(), '-', '_');
  for (const OtherName& other : kOtherNames) {
    std::string ours(other.ours);
    if (other.theirs == name && std::find(words.begin(), words.end(), ours) != words.end()) {
      return ours;
    }
  }
  std::string nearest;
  // Two thirds of the letters must be right.
  std::size_t least = std::min<std::size_t>(4, word.size() / 3 + 1);
  for (const std::string& known : words) {
    const std::size_t distance = edits(word, known);
    if (distance < least) {
      least = distance;
      nearest = known;
    }
  }
  return nearest;
}

std::string not_one_of(const std::string& word, const std::vector<std::string>& words) {
  const std::string nearest = nearest_word(word, words);
  std::string text = word.empty() ? "it was given nothing" : "'" + word + "' is none of its values";
  if (!nearest.empty()) text += "; did you mean " + nearest + "?";
  text += nearest.empty() ? ": give " : " Give ";
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
  }
  return text;
}

}  // namespace kiln::cli
