#include "simplify/streamed_simplify.h"

#include <algorithm>
#include <utility>

#include "base/formatted.h"
#include "base/option.h"
#include "base/parallel.h"
#include "kiln/error.h"
#include "mesh/box.h"
#include "mesh/steps.h"
#include "mesh/surface_distance.h"
#include "mesh/usable.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"
#include "simplify/mesh_pieces.h"
#include "simplify/presimplify.h"
#include "simplify/simplify_job.h"

namespace kiln {

double reduced_share(const MeshStream& mesh, std::uint32_t faces) {
  constexpr double kMaxReducedShare = 0.25, kMaxTriangles = 4e6, kMinTrianglesPerFace = 8;
  const auto triangles = static_cast<double>(mesh.triangle_count());
  const double goal = std::min(kMaxReducedShare * triangles, kMaxTriangles);
  return std::min(1.0, std::max(goal, kMinTrianglesPerFace * faces) / triangles);
}

void reduce_chunk(std::vector<Vec3>& positions, std::vector<Triangle>& triangles, double share) {
  const std::vector<std::uint32_t> first = weld_vertices(positions);
  for (Triangle& t : triangles) t = {first[t[0]], first[t[1]], first[t[2]]};
  std::erase_if(triangles,
                [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  // meshoptimizer would take an unused vertex at the position of another for the other side of a seam.
  const std::vector<std::uint32_t> used_vertices = number_used_vertices(triangles);
  std::vector<Vec3> used_positions;
  used_positions.reserve(used_vertices.size());
  for (const std::uint32_t v : used_vertices) used_positions.push_back(positions[v]);
  const auto goal = static_cast<std::size_t>(share * static_cast<double>(triangles.size()));
  presimplify_chunk(used_positions, triangles, goal);
  for (std::size_t i = 0; i < used_vertices.size(); ++i) {
    positions[used_vertices[i]] = used_positions[i];
  }
  for (Triangle& t : triangles) {
    t = {used_vertices[t[0]], used_vertices[t[1]], used_vertices[t[2]]};
  }
}

void reduce_pieces(Mesh& mesh, double share) {
  constexpr std::size_t kMinPieceTriangles = 500'000;
  const std::vector<std::vector<std::uint32_t>> pieces =
      pieces_of(mesh.positions, mesh.triangles, kMinPieceTriangles);
  const std::vector<std::uint8_t> is_shared =
      vertices_between_pieces(pieces, mesh.triangles, mesh.positions.size());
  std::vector<std::vector<Triangle>> reduced(pieces.size());
  parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::vector<Triangle> triangles;
      triangles.reserve(pieces[i].size());
      for (const std::uint32_t t : pieces[i]) triangles.push_back(mesh.triangles[t]);
      const std::vector<std::uint32_t> vertices = number_used_vertices(triangles);
      std::vector<Vec3> positions;
      positions.reserve(vertices.size());
      for (const std::uint32_t v : vertices) positions.push_back(mesh.positions[v]);
      reduce_chunk(positions, triangles, share);
      // A vertex that several pieces share lies on a border, which does not change, or belongs to pieces that are
      // closed around it.
      for (std::size_t k = 0; k < vertices.size(); ++k) {
        if (is_shared[vertices[k]] == 0) mesh.positions[vertices[k]] = positions[k];
      }
      for (Triangle& t : triangles) t = {vertices[t[0]], vertices[t[1]], vertices[t[2]]};
      reduced[i] = std::move(triangles);
    }
  });
  mesh.triangles.clear();
  for (const std::vector<Triangle>& triangles : reduced) {
    mesh.triangles.insert(mesh.triangles.end(), triangles.begin(), triangles.end());
  }
}

namespace {

/// A sample of a mesh's surface, from which distances to other surfaces are measured. They are shares of the diagonal
/// of the sample's box.
class SurfaceSample {
 public:
  explicit SurfaceSample(const MeshStream& mesh) {
    constexpr std::size_t kSamplesPerTriangle = 4;
    Mesh sample = sample_of(mesh, kMaxSamples / kSamplesPerTriangle);
    std::erase_if(sample.triangles,
                  [&](const Triangle& triangle) { return !has_area(sample.positions, triangle); });
    triangles_ = std::move(sample.triangles);
    if (triangles_.empty()) return;
    Box<Vec3> box;
    for (const Triangle& triangle : triangles_) {
      for (const std::uint32_t corner : triangle) box.add(sample.positions[corner]);
    }
    center_ = box.center();
    scale_ = 1 / length(to_double(box.high) - to_double(box.low));
    positions_ = scaled(std::move(sample.positions));
  }

  bool empty() const { return triangles_.empty(); }
  DistanceReport distance_to(const Mesh& other) const {
    return one_sided_distance(positions_, triangles_,
                              SurfaceDistance(scaled(other.positions), other.triangles),
                              kMaxSamples);
  }

 private:
  std::vector<Vec3> scaled(std::vector<Vec3> positions) const {
    for (Vec3& p : positions) p = to_float((to_double(p) - center_) * scale_);
    return positions;
  }

  std::vector<Vec3> positions_;
  std::vector<Triangle> triangles_;
  Vec3d center_{};
  double scale_ = 1;
};

}  // namespace

Mesh simplify_reduced(const MeshStream& mesh, const Mesh& reduced, const SimplifyOptions& options,
                      SimplifyReport& report) {
  // Smallest share of the whole bound that is left to simplify(). With a smaller share, it would remove hardly any
  // triangles of the reduced mesh.
  constexpr double kMinShareOfBound = 0.1;
  const SurfaceSample sample(mesh);
  const auto simplify_to = [&](const SimplifyOptions& wanted) {
    report = {};
    Mesh low = simplify(reduced, wanted, &report);
    report.input_faces = mesh.triangle_count();
    if (report.dropped_parts > 0 || sample.empty()) return low;
    const DistanceReport distance = sample.distance_to(low);
    report.error = distance.largest;
    report.mean_error = distance.mean;
    return low;
  };
  if (options.faces != 0) return simplify_to(options);
  const double of_reduction = sample.empty() ? 0 : sample.distance_to(reduced).largest;
  SimplifyOptions within = options;
  within.max_error -= of_reduction;
  while (within.max_error >= kMinShareOfBound * options.max_error) {
    Mesh low = simplify_to(within);
    if (report.error <= options.max_error) return low;
    // The measured error exceeds the bound, because it is taken at more samples than simplify() took. This excess falls
    // more slowly than the bound.
    constexpr double kExcessFactor = 1.5;
    within.max_error -= kExcessFactor * (report.error - options.max_error);
  }
  throw Error(ErrorCode::usage,
              "'" + mesh.path() + "' is larger than memory: it was reduced before it was " +
                  "simplified, which took " +
                  formatted("%.2g%% of the %.2g%% of the diagonal that ", 100 * of_reduction,
                            100 * options.max_error) +
                  option("max_error") + " allows. Allow a larger error, or raise the " +
                  option("memory_limit") + ".",
              "larger-than-memory");
}

}  // namespace kiln
