// Normals of a low poly that come nearest to the high poly's.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kiln/normals.h"
#include "mesh/frame.h"
#include "mesh/normals.h"
#include "mesh/two_sided.h"

namespace kiln {

/// A high poly ready to be sampled: see fit_normals(). Immutable; keeps the mesh by reference.
class NormalFit {
 public:
  /// \throws Error(input) where no triangle has an extent
  explicit NormalFit(const Mesh& high);

  class Samples;
  /// Looks for the high poly's hard edges: low polys then have hard edges along them, for shading and under maps.
  void find_hard_edges();
  /// Gives a low poly normals. Deterministic on any number of threads.
  /// \param last  samples of the low poly before, which are taken where only UVs differ, and then of this one; may be
  /// null
  void run(Mesh& low, const FitNormalsOptions& options = {}, FitNormalsReport* report = nullptr,
           Samples* last = nullptr) const;
  /// The same for a mesh that is only measured, with a quarter of the samples: for shading and for a map.
  std::array<Mesh, 2> run_roughly(const Mesh& low, const FitNormalsOptions& options) const;

 private:
  struct Place;
  /// An edge where normals part.
  struct HardEdge {
    Vec3 middle;
    double length = 0;
  };
  class Solver;
  std::vector<Place> places(std::size_t count, const Mesh& low, const TwoSided& sides) const;
  void fit(Mesh& low, const TwoSided& sides, const std::vector<Place>& found, NormalPurpose purpose,
           const FitNormalsOptions& options, double tolerance, FitNormalsReport* report) const;
  bool normal_at(std::size_t triangle, const std::array<double, 3>& share, const Vec3d& face,
                 Vec3d& normal) const;

  std::vector<bool> along_hard_edges(const std::vector<Vec3>& positions,
                                     const std::vector<Triangle>& triangles) const;
  const std::vector<Place>& taken(const Mesh& low, const TwoSided& sides, Samples& last) const;

  const Mesh& high_;
  Frame frame_;
  std::vector<Vec3> positions_;
  CornerNormals smooth_;              ///< Normals of a small mesh that has none; else empty
  std::vector<HardEdge> hard_edges_;  ///< Of the high poly; empty: none, or not looked for
  std::vector<double> area_until_;    ///< Doubled, of all triangles up to each
};

/// Places of high-poly samples on a low poly.
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
  std::vector<Place> places_;
};

}  // namespace kiln
