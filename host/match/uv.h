// Matching by UVs: for a high poly whose layout coincides with the low poly's.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "match/registry.h"
#include "shared/uv.h"

namespace kiln {

/// The high poly's UV triangles over a map's samples, as tasks: one triangle each (or a tile of a
/// large one), in order of rows.
struct UvLayout {
  std::uint32_t shift = 0;
  std::vector<kiln_uv_piece> pieces;  ///< Sorted by triangle, in ascending order
  std::vector<kiln_uv_clip> clips;    ///< Barycentric coordinates of the clipped pieces' corners
  /// No task crosses the border between two runs of KILN_UV_TILE rows
  std::vector<kiln_uv_task> tasks;
  std::vector<std::uint32_t> first_task;  ///< [runs + 1] First task of each run of rows
  /// Number of triangles that extend beyond the unit square
  std::uint64_t outside = 0;
  std::uint64_t without_area = 0;  ///< Triangles without area in UV space, or not finite

  /// Lays out the triangles. Their parts outside the unit square have no samples. Triangles without area in UV
  /// space, or with a non-finite corner or UV, cover nothing.
  /// \throws Error(input) if the mesh has no UVs, or an index beyond their pool
  static UvLayout of(const Source::Impl& source, std::uint32_t sample_width,
                     std::uint32_t sample_height);
};

/// Variants of the kernels. Both give the same bits.
enum class UvPath {
  automatic,  ///< The variant is chosen by the device's type
  atomics,    ///< One work-item per triangle
  runs,       ///< One work-item per run of rows
};

/// Rasterises the high poly's UV triangles and looks up which one covers each sample.
class UvRaster {
 public:
  UvRaster(const Source::Impl& source, std::uint32_t width, std::uint32_t height,
           std::uint32_t samples, UvPath path = UvPath::automatic);

  /// Writes triangle, barycentric and status of a band's samples; distances are 0. The kernels may still be
  /// running when it returns.
  /// \param first_time  count covered samples for the report
  void match(const TexelBand& band, DeviceCorrespondence& match, bool first_time);
  /// Computes the distance of each sample of a band to its matched point, from the source's current positions.
  void distance(const TexelBand& band, DeviceCorrespondence& match) const;
  /// Updates the positions of vertices [first, first + count), in the source's frame.
  void set_positions(std::uint32_t first, std::span<const Vec3> positions);

  /// Adds a band's distances to the sums.
  void measure(const DeviceCorrespondence& match);

  /// Adds counts, and warnings for exceeded bounds.
  /// \throws Error(input) if a bound of UvOptions (`max_...`) is exceeded
  void report(const UvOptions& options, MatchNotes& notes) const;

 private:
  void rasterize(const kiln_uv_params& params);

  cl::Context& context_;
  bool uses_row_runs_, has_large_pieces_ = false;
  Frame frame_;
  std::uint32_t width_, samples_;
  std::uint32_t subpixel_shift_ = 0;
  UvReport triangle_counts_;
  std::vector<std::uint32_t> first_task_, triangle_of_piece_;
  cl::Array<kiln_uv_piece> uv_pieces_;
  cl::Array<kiln_uv_clip> piece_clips_;
  cl::Array<kiln_uv_task> piece_tasks_;
  cl::Array<std::uint32_t> first_tasks_;  // UvLayout::first_task
  cl::Array<std::uint32_t> triangles_;
  cl::Array<float> positions_;
  // For each sample of a band, the lowest and the highest index of a piece that covers it
  cl::Array<std::uint32_t> lowest_, highest_;
  cl::Array<kiln_uv_row> sample_rows_;
  std::uint64_t sample_total_ = 0;
  double distance_sum_ = 0;
  // Histogram of the samples' distances, binned by exponent and leading mantissa bits
  std::vector<std::uint64_t> histogram_;
};

/// \throws Error(usage)
void check_uv(const UvOptions& options);

}  // namespace kiln
