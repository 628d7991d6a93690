// Part of SimplifyJob: groups, objects and materials, whose borders are kept as lines on the surface.
#include <algorithm>
#include <span>
#include <utility>

#include "mesh/quadric.h"
#include "mesh/vertex_lists.h"
#include "simplify/simplify_job.h"

namespace kiln {
namespace {

/// True if simplification held lines between labels in place. If not, transfer_labels() assigns names more accurately.
bool have_kept_label_lines(const SimplifyResult& result) {
  double length_of_lines = 0, length_of_all = 0;
  SideLists(result.triangles, result.points.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        const double size = length(result.points[SideLists::higher(sides[0])] - result.points[a]);
        length_of_all += size;
        for (std::size_t i = 1; i < sides.size(); ++i) {
          const std::uint32_t one = sides[i - 1].index / 3, other = sides[i].index / 3;
          if (result.labels[one] != result.labels[other]) length_of_lines += size;
        }
      });
  return max_line_weight(length_of_lines, length_of_all) > 0;
}

}  // namespace

/// Finds the labels to keep, if triangles differ in group, object or material.
void SimplifyJob::find_labels() {
  Labels labels = labels_of(high_, dense_);
  dense_.backs = {};
  label_back_ = std::move(labels.backs);
  const auto one_sided = std::count(label_back_.begin(), label_back_.end(), TwoSided::kNone);
  dense_.keep_labels = one_sided != 0;
  if (labels.source.size() < 2 && label_back_.empty()) return;
  label_source_ = std::move(labels.source);
  if (label_source_.size() > 1) dense_.labels = std::move(labels.of);
}

/// Copies group, object and material to each triangle from the high-poly triangle that represents its label: first for
/// all fronts, then for all backs.
void SimplifyJob::assign_labels(const SimplifyResult& result, Mesh& mesh) const {
  const bool keeps_uvs = options_.keep_uvs;
  const std::vector<std::uint32_t> single_label(
      label_source_.size() == 1 ? result.triangles.size() : 0, 0);
  const std::vector<std::uint32_t>& labels = keeps_uvs              ? result.layout.groups
                                             : single_label.empty() ? result.labels
                                                                    : single_label;
  const std::vector<std::uint32_t>& source = keeps_uvs ? layout_.group_of : label_source_;
  if (labels.empty() || (!keeps_uvs && single_label.empty() && !have_kept_label_lines(result)))
    return;
  const auto copy_names = [&](const std::vector<std::uint32_t>& from,
                              std::vector<std::uint32_t>& to) {
    if (from.size() != high_.triangles.size()) return;
    for (const std::uint32_t label : labels) to.push_back(from[source[label]]);
    for (std::size_t t = 0; t < labels.size() && !label_back_.empty(); ++t) {
      if (has_back(labels, t)) to.push_back(from[label_back_[labels[t]]]);
    }
  };
  copy_names(high_.groups, mesh.groups);
  copy_names(high_.objects, mesh.objects);
  copy_names(high_.materials, mesh.materials);
  mesh.group_names = high_.group_names;
  mesh.object_names = high_.object_names;
  mesh.material_names = high_.material_names;
}

}  // namespace kiln
