// Visibility directions at vertices and faces.
#include <algorithm>

#include "base/parallel.h"
#include "match/visibility.h"
#include "match/visibility_means.h"
#include "mesh/surface_links.h"

namespace kiln {
namespace {

double corner_angle(const std::array<LowSurface::Corner, 3>& corners, std::size_t k) {
  const Vec3d at = to_double(corners[k].position);
  const Vec3d a = to_double(corners[(k + 1) % 3].position) - at;
  const Vec3d b = to_double(corners[(k + 2) % 3].position) - at;
  return std::atan2(length(cross(a, b)), dot(a, b));
}

Vec3d area_normal(const std::array<LowSurface::Corner, 3>& corners) {
  const Vec3d a = to_double(corners[0].position);
  return cross(to_double(corners[1].position) - a, to_double(corners[2].position) - a);
}

/// Computes by rays what VisibilityProbe::corners() computes by pictures: the centroids of kPartsPerSide x
/// kPartsPerSide equal parts of each face replace pixels, each distributed to the corners by its barycentric weights.
/// \return [3 * triangles]
std::vector<DirectionSum> corners_by_rays(cl::Context& context, const LowSurface& surface,
                                          VisibilityProbe& probe) {
  constexpr std::size_t kPartsPerSide = 4;
  constexpr std::size_t kFacesPerBatch = 1 << 16;
  std::vector<std::array<double, 3>> corner_shares;
  for (std::size_t row = 0; row < kPartsPerSide; ++row) {
    for (std::size_t k = 0; k < 2 * row + 1; ++k) {
      // Parts with even numbers have the face's orientation; the others are flipped.
      const double down = (static_cast<double>(row) + (k % 2 == 0 ? 2.0 : 1.0) / 3) / kPartsPerSide;
      const double along =
          (static_cast<double>(k / 2) + (k % 2 == 0 ? 1.0 : 2.0) / 3) / kPartsPerSide;
      corner_shares.push_back({1 - down, down - along, along});
    }
  }
  const std::size_t count = surface.triangles.size();
  std::vector<DirectionSum> result(3 * count);
  for (std::size_t first = 0; first < count; first += kFacesPerBatch) {
    const std::size_t faces = std::min(kFacesPerBatch, count - first);
    std::vector<Vec3> positions(corner_shares.size() * faces);
    std::vector<Vec3> normals(positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const std::size_t t = first + i / corner_shares.size();
      if (surface.usable[t] == 0) continue;
      const auto& corners = surface.triangles[t];
      const Vec3d normal = area_normal(corners);
      Vec3d part_index{};
      for (std::size_t k = 0; k < 3; ++k) {
        part_index += to_double(corners[k].position) * corner_shares[i % corner_shares.size()][k];
      }
      positions[i] = to_float(part_index);
      normals[i] = to_float(normal * (1 / length(normal)));
    }
    VisibilityProbe::ProbedPoints probed = probe.make_points(positions, normals);
    probe.add_directions_by_rays(probed);
    const std::vector<float> corner_sums = probed.sums.download(context);
    const std::size_t plane = probed.capacity;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const std::size_t t = first + i / corner_shares.size();
      if (surface.usable[t] == 0) continue;
      const double area = length(area_normal(surface.triangles[t]));
      for (std::size_t k = 0; k < 3; ++k) {
        const double share = area * corner_shares[i % corner_shares.size()][k];
        result[3 * t + k].add(
            Vec3d{corner_sums[i], corner_sums[i + plane], corner_sums[i + 2 * plane]} * share,
            share * corner_sums[i + 3 * plane]);
      }
    }
  }
  return result;
}

std::vector<DirectionSum> corners_by_views(VisibilityProbe& probe) {
  const std::vector<float> corners = probe.corners();
  std::vector<DirectionSum> result(corners.size() / 4);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const float* c = &corners[4 * i];
    result[i].add({c[0], c[1], c[2]}, c[3]);
  }
  return result;
}

}  // namespace

void add_deviation(const std::vector<std::array<float, 4>>& means, VisibilityReport& report) {
  constexpr std::size_t kBlock = 1 << 16;
  std::vector<double> sums((means.size() + kBlock - 1) / kBlock);
  std::vector<std::uint64_t> counts(sums.size());
  parallel_for(means.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!(means[i][3] > 0)) continue;
      sums[i / kBlock] += deviation_of(means[i]);
      ++counts[i / kBlock];
    }
  });
  double sum = 0;
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    sum += sums[i];
    count += counts[i];
  }
  report.mean_deviation = count != 0 ? sum / static_cast<double>(count) : 0;
}

void VisibilityField::make_corners(const LowSurface& surface, VisibilityProbe& probe,
                                   const VisibilityOptions& options, VisibilityReport& report) {
  const SurfaceTopology topology = SurfaceTopology::of(surface);
  const std::size_t count = surface.triangles.size();
  const bool faces = options.at == VisibilityAt::face;
  std::vector<DirectionSum> vertices(topology.vertex_count);
  std::vector<DirectionSum> face_sums;
  if (faces) face_sums.resize(count);
  const std::vector<DirectionSum> corners =
      report.by_rays ? corners_by_rays(context_, surface, probe) : corners_by_views(probe);
  for (std::size_t t = 0; t < count; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const DirectionSum& corner = corners[3 * t + k];
      (faces ? face_sums[t] : vertices[topology.vertices[t][k]]).add(corner.sum, corner.weight);
    }
  }
  std::vector<std::uint8_t> is_used_vertex(topology.vertex_count, 0);
  for (const std::size_t t : surface.usable_triangles()) {
    for (std::size_t k = 0; k < 3; ++k) {
      is_used_vertex[topology.vertices[t][k]] = 1;
      if (!faces || !(face_sums[t].weight > 0)) continue;
      const double angle = corner_angle(surface.triangles[t], k);
      vertices[topology.vertices[t][k]].add(face_sums[t].sum * (angle / face_sums[t].weight),
                                            angle);
    }
  }

  std::vector<std::array<float, 4>> means(topology.vertex_count);
  std::vector<std::uint32_t> unseen_vertices;
  for (std::uint32_t v = 0; v < topology.vertex_count; ++v) {
    if (is_used_vertex[v] == 0) continue;
    ++report.places;
    means[v] = mean_of(vertices[v]);
    if (means[v][3] == 0) unseen_vertices.push_back(v);
  }
  std::vector<std::vector<std::uint32_t>> face_corners(
      unseen_vertices.empty() ? 0 : topology.vertex_count);
  for (std::size_t t = 0; t < count && !unseen_vertices.empty(); ++t) {
    if (surface.usable[t] == 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      face_corners[topology.vertices[t][k]].push_back(topology.vertices[t][(k + 1) % 3]);
      face_corners[topology.vertices[t][k]].push_back(topology.vertices[t][(k + 2) % 3]);
    }
  }
  fill_unseen(
      means, std::move(unseen_vertices),
      [&](std::uint32_t v, const auto& visit) {
        for (const std::uint32_t other : face_corners[v]) visit(other);
      },
      report);
  add_deviation(means, report);
  std::vector<float> field(12 * count, 0.0F);
  for (const std::size_t t : surface.usable_triangles()) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::copy_n(means[topology.vertices[t][k]].data(), 4, &field[12 * t + 4 * k]);
    }
  }
  field_ = cl::Array<float>(context_, std::span<const float>(field));
}

}  // namespace kiln
