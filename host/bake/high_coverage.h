// Measures the detail of the high poly that a bake loses: see HighCoverageReport.
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

/// Records, band by band, which test points on the high poly the samples of the map represent.
class HighCoverage {
 public:
  /// A point of the high poly, frame units.
  struct TestPoint {
    Vec3 position, normal;  ///< Position, and unit normal of its face
  };

  struct TestPoints {
    std::vector<TestPoint> list;
    double spacing = 0;  ///< Square root of the area that each test point represents
  };

  /// Distributes test points evenly over the surface. The result is deterministic, and cached by
  /// the source.
  static TestPoints spread_test_points(const Source::Impl& high, std::uint32_t count);
  /// Uses the vertices as test points, with the mean normals of their faces.
  static TestPoints make_vertex_test_points(const Source::Impl& high);

  /// Selects the test points that are rated: those that views show near the low poly. \param
  /// request gives the map's size and the search distance
  /// \param copies compares triangles that share texels; null if there are none
  HighCoverage(const MatchRequest& request, TestPoints test_points, CopyCheck* copies);

  /// Marks the test points that a band's samples represent as covered.
  void record_band(const Source::Impl& high, BandReads& reads, const DeviceCorrespondence& match);

  /// Computes the share of detail that is lost, and locates the largest lost part.
  HighCoverageReport report(const Frame& frame) const;
  /// Returns, for each test point, whether a sample represents it.
  std::vector<VertexCoverage> vertex_coverage() const;

 private:
  static TestPoints make_spread_test_points(const Source::Impl& high, std::uint32_t count);
  void select_near_test_points(const MatchRequest& request, CopyCheck* copies);
  void select_seen_test_points(const MatchRequest& request);
  /// Indices of the test points near the low poly, in the order of a Morton curve. With many
  /// texture sets, each has few test points.
  std::vector<std::uint32_t> near_test_points_in_morton_order() const;
  void build_test_point_grid();
  /// Culls triangles of the high poly for record_band(): on large maps, most samples match
  /// triangles that have no test point within the search distance, or only test points that are
  /// covered already. The test is conservative, since it uses bounding boxes.
  void list_test_points_by_triangle(const Source::Impl& high);
  static std::uint64_t cell(const std::array<std::int64_t, 3>& at);
  std::int64_t cell_coordinate(double x) const;
  /// A sample's point, and two edges of its triangle, from which the normal's direction is computed.
  struct Sample {
    Vec3d point{}, ab{}, ac{};
  };
  bool mark_if_covered(std::uint32_t test_point, const Sample& sample);
  /// Marks all test points that a sample represents, found by the grid.
  void mark_covered_test_points(const Sample& sample);
  /// Marks the test points that a sample represents among those listed for its triangle. \returns
  /// whether all listed test points are covered
  bool mark_listed_test_points(std::uint32_t list_index, const Sample& sample);

  std::vector<TestPoint> test_points_;
  double test_point_spacing_ = 0;
  /// Radius around the test point within which a sample represents it; 0 if the test point is not
  /// rated
  std::vector<float> test_point_radii_;
  /// For each test point, the sum of the cosines between its normal and the directions that see it
  std::vector<float> cosine_sums_;
  std::vector<std::uint8_t> is_covered_;
  /// 1 if the test point is lost because UV charts share texels
  std::vector<std::uint8_t> is_lost_by_copies_;
  /// State of each triangle (list_test_points_by_triangle()); empty: not computed.
  std::vector<std::uint32_t> triangle_state_;
  /// Indices of the test points within the search distance of each triangle, in one list after
  /// another, and the index at which each triangle's list begins
  std::vector<std::uint32_t> listed_test_points_, test_point_list_begins_;
  double cells_per_unit_ = 0;  ///< Cells of the grid per frame unit
  /// Bloom filter of the grid cells that contain test points
  std::vector<std::uint64_t> occupied_cell_filter_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> test_points_in_cell_;
};

/// Adds a warning if more than 1% of the detail is lost. \param options  the bake's options
void warn_about_lost_detail(const HighCoverageReport& recall, const BakeOptions& options,
                            std::vector<Warning>& warnings);

}  // namespace kiln
