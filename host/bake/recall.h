// What a bake leaves out of the high poly: see RecallReport.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "detail/band_reads.h"
#include "kiln/recall.h"
#include "match/registry.h"
#include "mesh/vector.h"
#include "texel/correspondence.h"

namespace kiln {

/// Places of the high poly, and which of them the samples of a map stand for, band by band.
class Recall {
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
  Recall(const MatchRequest& request, Places places);

  /// Marks what a band's samples stand for.
  void store(const Source::Impl& high, BandReads& reads, const Correspondence& match);

  /// What was lost, and where most.
  RecallReport report(const Frame& frame) const;
  /// Of each place given.
  std::vector<Recalled> marks() const;

 private:
  void find_near(const MatchRequest& request);
  void find_seen(const MatchRequest& request);
  void make_grid();
  /// Most samples of large maps lie on triangles that no place reaches into. By boxes: some are kept that
  /// need not be.
  void find_triangles(const Source::Impl& high);
  static std::uint64_t cell(const std::array<std::int64_t, 3>& at);
  std::int64_t slice(double x) const;
  /// A point, and two edges of its triangle, of which only the cross product's direction counts.
  void mark(const Vec3d& point, const Vec3d& ab, const Vec3d& ac);

  std::vector<Place> places_;
  double spacing_ = 0;
  std::vector<float> radius_;  ///< Within which a sample stands for the place; 0: it does not count
  std::vector<float> seen_;    ///< Sum of cosines of directions that see it
  std::vector<std::uint8_t> held_;
  std::vector<std::uint8_t>
      near_;             ///< Per triangle: whether a place may reach into it; empty: not known
  double per_side_ = 0;  ///< Cells a frame unit
  std::vector<std::uint64_t> maybe_;  ///< Bits by hash: whether a cell has places
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

/// Adds a warning where more than a hundredth is lost. \param options  those of the bake
void warn_about_loss(const RecallReport& recall, const BakeOptions& options,
                     std::vector<Warning>& warnings);

}  // namespace kiln
