#include "match/part_matcher.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "texel/host_correspondence.h"
#include "texel/sample_pick.h"

namespace kiln {
namespace {

/// A part's meshes and its matcher. Not movable, since the matcher refers to the meshes.
struct Part {
  std::vector<std::uint32_t> triangles;  ///< Triangles of the high poly
  std::unique_ptr<Source::Impl> source;
  LowSurface surface;
  std::unique_ptr<Matcher> matcher;
};

void check_lists(const MatchRequest& request, const Parts& parts) {
  const auto has_valid_length = [&](const std::vector<std::uint32_t>& list, std::size_t triangles) {
    return list.size() == triangles &&
           std::all_of(list.begin(), list.end(), [&](std::uint32_t p) { return p < parts.count; });
  };
  if (has_valid_length(parts.high, request.source.triangles.size()) &&
      has_valid_length(parts.low, request.surface.triangles.size())) {
    return;
  }
  throw Error(ErrorCode::usage,
              "The lists of parts do not fit the meshes: each needs one part for each triangle.");
}

/// Makes a surface that consists of some of the low poly's triangles.
LowSurface surface_of_triangles(const LowSurface& all_triangles,
                                const std::vector<std::uint32_t>& triangles) {
  LowSurface surface;
  surface.has_cage_mesh = all_triangles.has_cage_mesh;
  surface.cage_kind = all_triangles.cage_kind;
  surface.cage_hull = all_triangles.cage_hull;
  surface.cage_length = all_triangles.cage_length;
  surface.triangles.reserve(triangles.size());
  for (const std::uint32_t t : triangles) {
    if (std::binary_search(all_triangles.with_uvs.begin(), all_triangles.with_uvs.end(), t)) {
      surface.with_uvs.push_back(static_cast<std::uint32_t>(surface.triangles.size()));
    }
    surface.triangles.push_back(all_triangles.triangles[t]);
    surface.usable.push_back(all_triangles.usable[t]);
  }
  return surface;
}

class PartMatcher : public Matcher {
 public:
  PartMatcher(const MatchRow& row, const MatchRequest& request, const Parts& parts,
              MatchNotes& notes)
      : context_(context_of(request.source.device)),
        part_of_low_triangle_(parts.low),
        index_in_part_(parts.low.size()),
        parts_(parts.count),
        samples_(parts.count) {
    for (std::uint32_t t = 0; t < parts.high.size(); ++t) {
      parts_[parts.high[t]].triangles.push_back(t);
    }
    std::vector<std::vector<std::uint32_t>> low(parts.count);
    for (std::uint32_t t = 0; t < parts.low.size(); ++t) {
      index_in_part_[t] = static_cast<std::uint32_t>(low[parts.low[t]].size());
      low[parts.low[t]].push_back(t);
    }
    for (std::uint32_t p = 0; p < parts.count; ++p) {
      Part& part = parts_[p];
      if (part.triangles.empty() || low[p].empty()) continue;
      part.source = std::make_unique<Source::Impl>(request.source, part.triangles);
      // The part has no usable triangle to search, so all its samples are misses.
      if (part.source->stats().skipped_triangles == part.triangles.size()) continue;
      part.surface = surface_of_triangles(request.surface, low[p]);
      part.matcher = row.make(request.of(*part.source, part.surface), notes);
    }
  }

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    std::vector<std::uint32_t> triangle(band.sample_count), low_indices(band.sample_count);
    band.triangle.read(context_, triangle);
    for (std::vector<std::uint32_t>& list : samples_) list.clear();
    for (std::uint32_t i = 0; i < band.sample_count; ++i) {
      low_indices[i] = index_in_part_[triangle[i]];
      samples_[part_of_low_triangle_[triangle[i]]].push_back(i);
    }
    const cl::Array<std::uint32_t> device_low_indices(context_,
                                                      std::span<const std::uint32_t>(low_indices));
    HostCorrespondence(band.sample_count).write(context_, match);
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      const std::vector<std::uint32_t>& samples = samples_[p];
      if (parts_[p].matcher == nullptr || samples.empty()) continue;
      const SamplePick pick(context_, samples);
      TexelBand picked_band = pick.gather_points(band);
      if (parts_[p].matcher->needs_whole_texels()) {
        picked_band.triangle = pick.of(device_low_indices, band.sample_count, 1);
        picked_band.barycentric = pick.of(band.barycentric, band.capacity, 2);
      }
      DeviceCorrespondence result(context_, pick.count());
      parts_[p].matcher->run(picked_band, result);
      pick.scatter_correspondence(result, match);
    }
    // Converts indices within the part to indices of the high poly's triangles.
    std::vector<std::uint32_t> found(band.sample_count);
    match.triangle.read(context_, found);
    for (std::uint32_t i = 0; i < band.sample_count; ++i) {
      if (found[i] == KILN_NO_TRIANGLE) continue;
      found[i] = parts_[part_of_low_triangle_[triangle[i]]].triangles[found[i]];
    }
    match.triangle.write(context_, std::span<const std::uint32_t>(found));
  }

  bool needs_whole_texels() const override { return true; }  // reads the triangle of each sample

  void finish(MatchNotes& notes) override {
    for (const Part& part : parts_) {
      if (part.matcher != nullptr) part.matcher->finish(notes);
    }
  }

 private:
  cl::Context& context_;
  std::vector<std::uint32_t> part_of_low_triangle_;
  // For each triangle of the low poly, its index in its part
  std::vector<std::uint32_t> index_in_part_;
  std::vector<Part> parts_;
  std::vector<std::vector<std::uint32_t>> samples_;  // For each part, its samples in the last band
};

}  // namespace

std::unique_ptr<Matcher> part_matcher(const MatchRow& row, const MatchRequest& request,
                                      const Parts& parts, MatchNotes& notes) {
  if (!obeys(row.info, "match.parts")) {
    throw Error(ErrorCode::usage, "'" + std::string(row.info.method.name) +
                                      "' cannot match part by part: choose ray, closest or axis.");
  }
  check_lists(request, parts);
  return std::make_unique<PartMatcher>(row, request, parts, notes);
}

}  // namespace kiln
