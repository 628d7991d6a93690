// Detail of the high poly that a bake leaves out: see HighCoverageReport.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "bake/copy_check.h"
#include "detail/band_reads.h"
#include "kiln/bake.h"
#include "match/registry.h"
#include "mesh/vector.h"
#include "texel/device_correspondence.h"

namespace kiln {

/// Places of the high poly, and which of them the samples of a map stand for, band by band.
class HighCoverage {
 public:
  /// A place of the high poly, frame units.
  struct Place {
    Vec3 position, normal;  ///< Unit, of the face
  };

  struct Places {
    std::vector<Place> list;
    double spacing = 0;  ///< Side of the square of area that each stands for
  };

  /// Places spread over the area: as many in each piece of it, the same on every run.
  static Places spread(const Source::Impl& high, std::uint32_t count);
  /// The vertices, with the mean normals of their faces.
  static Places vertices(const Source::Impl& high);

  /// Finds out which places count. \param request  says the map's size, and how far samples look
  /// \param copies  tells what triangles that share texels find; null where none do
  HighCoverage(const MatchRequest& request, Places places, CopyCheck* copies);

  /// Marks what a band's samples stand for.
  void store(const Source::Impl& high, BandReads& reads, const DeviceCorrespondence& match);

  /// Sums up the detail that was lost, and where most was.
  HighCoverageReport report(const Frame& frame) const;
  /// Marks each place given: does a sample stand for it?
  std::vector<VertexCoverage> marks() const;

 private:
  void find_near(const MatchRequest& request, CopyCheck* copies);
  void find_seen(const MatchRequest& request);
  void make_grid();
  /// Most samples of large maps lie on triangles that no place reaches into, or whose places are all held
  /// already. By boxes: some are kept that need not be.
  void find_triangles(const Source::Impl& high);
  static std::uint64_t cell(const std::array<std::int64_t, 3>& at);
  std::int64_t slice(double x) const;
  /// A point, and two edges of its triangle, of which only the cross product's direction counts.
  struct Sample {
    Vec3d point, ab, ac;
  };
  bool hold(std::uint32_t place, const Sample& sample);
  /// All places that a sample stands for, by the grid.
  void mark(const Sample& sample);
  /// The same among the few places that reach into its triangle. \returns whether all of these are held
  bool mark_few(std::uint32_t few, const Sample& sample);

  std::vector<Place> places_;
  double spacing_ = 0;
  std::vector<float> radius_;  ///< Within which a sample stands for the place; 0: it does not count
  std::vector<float> seen_;    ///< Sum of cosines of directions that see it
  std::vector<std::uint8_t> held_;
  std::vector<std::uint8_t> by_copies_;  ///< 1 where a sample is lost because charts share texels
  /// Per triangle: which places may reach into it, see find_triangles(); empty: not known.
  std::vector<std::uint32_t> near_;
  std::vector<std::uint32_t> few_, few_first_;  ///< Places of triangles that have few, in runs
  double per_side_ = 0;                         ///< Cells a frame unit
  std::vector<std::uint64_t> maybe_;            ///< Bits by hash: whether a cell has places
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

/// Adds a warning where more than a hundredth is lost. \param options  those of the bake
void warn_about_loss(const HighCoverageReport& recall, const BakeOptions& options,
                     std::vector<Warning>& warnings);

}  // namespace kiln
