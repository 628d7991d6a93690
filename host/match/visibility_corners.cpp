// Visibility at vertices and faces.
#include <algorithm>

#include "base/parallel.h"
#include "match/visibility.h"
#include "match/visibility_means.h"
#include "mesh/surface_links.h"

namespace kiln {
namespace {

double corner_angle(const std::array<LowSurface::Corner, 3>& corners, std::size_t k) {
  const Vec3d at(corners[k].position);
  const Vec3d a = Vec3d(corners[(k + 1) % 3].position) - at;
  const Vec3d b = Vec3d(corners[(k + 2) % 3].position) - at;
  return std::atan2(length(cross(a, b)), dot(a, b));
}

Vec3d area_normal(const std::array<LowSurface::Corner, 3>& corners) {
  const Vec3d a(corners[0].position);
  return cross(Vec3d(corners[1].position) - a, Vec3d(corners[2].position) - a);
}

/// By vertices' own rays.
std::vector<DirectionSum> vertices_by_rays(cl::Context& context, const LowSurface& surface,
                                           const SurfaceTopology& topology,
                                           VisibilityProbe& probe) {
  std::vector<Vec3d> sums(topology.vertex_count);
  std::vector<Vec3> positions(topology.vertex_count);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (surface.usable[t] == 0) continue;
    const Vec3d normal = area_normal(surface.triangles[t]);
    const double size = length(normal);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = topology.vertices[t][k];
      sums[vertex] += normal * (corner_angle(surface.triangles[t], k) / size);
      positions[vertex] = surface.triangles[t][k].position;
    }
  }
  std::vector<Vec3> normals(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double size = length(sums[i]);
    if (size > 0) normals[i] = to_float(sums[i] * (1 / size));
  }
  VisibilityProbe::Places places = probe.places(positions, normals);
  probe.add_by_rays(places);
  const std::vector<float> seen = places.sums.download(context);
  const std::size_t plane = places.capacity;
  std::vector<DirectionSum> result(sums.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i].add({seen[i], seen[i + plane], seen[i + 2 * plane]}, seen[i + 3 * plane]);
  }
  return result;
}

/// Faces by rays from four places each: the middle, and the middles of what is left at the corners.
std::vector<DirectionSum> faces_by_rays(cl::Context& context, const LowSurface& surface,
                                        VisibilityProbe& probe) {
  const std::size_t count = surface.triangles.size();
  std::vector<Vec3> positions(4 * count);
  std::vector<Vec3> normals(4 * count);
  for (std::size_t t = 0; t < count; ++t) {
    if (surface.usable[t] == 0) continue;
    const auto& corners = surface.triangles[t];
    const Vec3d normal = area_normal(corners);
    for (std::size_t i = 0; i < 4; ++i) {
      Vec3d point;
      for (std::size_t k = 0; k < 3; ++k) {
        point += Vec3d(corners[k].position) * (i == 3 ? 1.0 / 3 : i == k ? 2.0 / 3 : 1.0 / 6);
      }
      positions[4 * t + i] = to_float(point);
      normals[4 * t + i] = to_float(normal * (1 / length(normal)));
    }
  }
  VisibilityProbe::Places places = probe.places(positions, normals);
  probe.add_by_rays(places);
  const std::vector<float> seen = places.sums.download(context);
  const std::size_t plane = places.capacity;
  std::vector<DirectionSum> result(count);
  for (std::size_t i = 0; i < 4 * count; ++i) {
    result[i / 4].add({seen[i], seen[i + plane], seen[i + 2 * plane]}, seen[i + 3 * plane]);
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
  std::vector<DirectionSum> of_face;
  if (report.by_rays) {
    if (faces) {
      of_face = faces_by_rays(context_, surface, probe);
    } else {
      vertices = vertices_by_rays(context_, surface, topology, probe);
    }
  } else {
    const std::vector<float> corners = probe.corners();
    if (faces) of_face.resize(count);
    for (std::size_t t = 0; t < count; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const float* c = &corners[12 * t + 4 * k];
        (faces ? of_face[t] : vertices[topology.vertices[t][k]]).add({c[0], c[1], c[2]}, c[3]);
      }
    }
  }
  std::vector<std::uint8_t> used(topology.vertex_count, 0);
  for (std::size_t t = 0; t < count; ++t) {
    if (surface.usable[t] == 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      used[topology.vertices[t][k]] = 1;
      if (!faces || !(of_face[t].weight > 0)) continue;
      const double angle = corner_angle(surface.triangles[t], k);
      vertices[topology.vertices[t][k]].add(of_face[t].sum * (angle / of_face[t].weight), angle);
    }
  }

  std::vector<std::array<float, 4>> means(topology.vertex_count);
  std::vector<std::uint32_t> unseen;
  for (std::uint32_t v = 0; v < topology.vertex_count; ++v) {
    if (used[v] == 0) continue;
    ++report.places;
    means[v] = mean_of(vertices[v]);
    if (means[v][3] == 0) unseen.push_back(v);
  }
  std::vector<std::vector<std::uint32_t>> around(unseen.empty() ? 0 : topology.vertex_count);
  for (std::size_t t = 0; t < count && !unseen.empty(); ++t) {
    if (surface.usable[t] == 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      around[topology.vertices[t][k]].push_back(topology.vertices[t][(k + 1) % 3]);
      around[topology.vertices[t][k]].push_back(topology.vertices[t][(k + 2) % 3]);
    }
  }
  fill_unseen(
      means, std::move(unseen),
      [&](std::uint32_t v, const auto& visit) {
        for (const std::uint32_t other : around[v]) visit(other);
      },
      report);
  add_deviation(means, report);
  std::vector<float> field(12 * count, 0.0F);
  for (std::size_t t = 0; t < count; ++t) {
    if (surface.usable[t] == 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      std::copy_n(means[topology.vertices[t][k]].data(), 4, &field[12 * t + 4 * k]);
    }
  }
  field_ = cl::Array<float>(context_, std::span<const float>(field));
}

}  // namespace kiln
