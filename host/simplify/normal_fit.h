// Fits the normals of a low poly to those of the high poly.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kiln/normals.h"
#include "mesh/frame.h"
#include "mesh/normals.h"
#include "mesh/two_sided.h"
#include "simplify/simplify_levels.h"

namespace kiln {

/// A high poly prepared for sampling: see fit_normals(). Immutable. Keeps a reference to the mesh.
class NormalFit {
 public:
  /// Prepares a high poly, and finds its hard edges. Low-poly edges along these become hard, both for plain shading and
  /// under maps.
  /// \throws Error(input) if no triangle has an area
  explicit NormalFit(const Mesh& high);

  class Samples;
  /// Fits a low poly's normals. Deterministic on any number of threads.
  /// \param last  [in, out] on entry the samples of the previous low poly, which are reused if the two meshes only
  ///   differ in UVs; on return the samples of `low`; may be null
  /// \param edges  whether hard edges of the high poly stay hard under a map
  void run(Mesh& low, const FitNormalsOptions& options = {}, FitNormalsReport* report = nullptr,
           Samples* last = nullptr, EdgesUnderMap edges = EdgesUnderMap::hard) const;
  /// Returns two copies of a low poly, whose normals are fitted with a quarter of the samples: the first for plain
  /// shading, the second for a normal map. For meshes that are only measured.
  std::array<Mesh, 2> run_draft(const Mesh& low, const FitNormalsOptions& options,
                                EdgesUnderMap edges) const;

 private:
  struct SampleMatch;
  /// An edge of the high poly at which normals are split.
  struct HardEdge {
    Vec3 middle;
    double length = 0;
  };
  class Solver;
  std::vector<SampleMatch> match_samples(std::size_t count, const Mesh& low,
                                         const TwoSided& sides) const;
  void fit(Mesh& low, const TwoSided& sides, const std::vector<SampleMatch>& found,
           NormalPurpose purpose, const FitNormalsOptions& options, double tolerance,
           FitNormalsReport* report, EdgesUnderMap edges) const;
  bool normal_at(std::size_t triangle, const std::array<double, 3>& share, const Vec3d& face,
                 Vec3d& normal) const;

  void find_hard_edges();
  std::vector<bool> along_hard_edges(const std::vector<Vec3>& positions,
                                     const std::vector<Triangle>& triangles) const;
  const std::vector<SampleMatch>& sampled_positions(const Mesh& low, const TwoSided& sides,
                                                    Samples& last) const;

  const Mesh& high_;
  Frame frame_;
  std::vector<Vec3> positions_;
  CornerNormals smooth_;  ///< Normals computed for a small mesh that has none; otherwise empty
  std::vector<HardEdge> hard_edges_;  ///< Hard edges of the high poly
  std::vector<double> area_sums_;     ///< Prefix sums of the triangles' doubled areas
};

/// Samples of a high poly and their positions on a low poly.
class NormalFit::Samples {
 public:
  Samples();
  ~Samples();
  Samples(const Samples&) = delete;
  Samples& operator=(const Samples&) = delete;

 private:
  friend class NormalFit;
  std::vector<Vec3> positions_;
  std::vector<Triangle> triangles_;
  std::vector<SampleMatch> matches_;
};

}  // namespace kiln
