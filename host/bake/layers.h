// The maps of one bake, which are computed together, band by band, from one correspondence, and then finished
// one by one.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bake/row_finisher.h"
#include "cl/context.h"
#include "detail/registry.h"
#include "image/mips.h"
#include "mesh/high_poly_normals.h"

namespace kiln {

/// One map of a bake: its values before padding and encoding.
struct Layer {
  const MapRow* row = nullptr;
  std::unique_ptr<MapMaker> map_maker;
  Image image;
  /// The map's number in RowFinisher, if it is finished row by row
  std::optional<std::size_t> rows;
};

/// How the maps' texels are stored: as whole images; only the rows that are being finished, for maps that allow it; or
/// not at all, for callers that store texels themselves.
enum class ImageStorage { whole_images, rows, none };

class Layers {
 public:
  /// Creates a layer for each requested map.
  /// \param footprint_divisor, is_reference  see MapRequest
  Layers(const Source::Impl& source, const LowSurface& surface, const BakeOptions& options,
         ImageStorage storage = ImageStorage::whole_images, std::uint32_t footprint_divisor = 1,
         bool is_reference = false);

  ~Layers();
  Layers(const Layers&) = delete;
  Layers& operator=(const Layers&) = delete;

  /// Invalidates cached results of the last band or match.
  void invalidate_band_results() { shared_results_.next_band(); }
  /// Invalidates cached results of the high poly.
  void invalidate_source_results() { shared_results_.next_source(); }
  /// Computes a band's texels in all maps and sets their coverage.
  void run(const TexelBand& band, const DeviceCorrespondence& match);
  /// Extends the images to their full size, also where no band was computed. Each band extends them only up to its own
  /// last row: its pages are then in the cache when its texels are written, whereas clearing whole images would pass
  /// twice through all of memory.
  void extend_images();
  /// Passes on rows that are final, of the maps that are finished row by row.
  void finish_rows() { rows_.finish(coverage_); }
  /// Sets the receiver of the rows of a layer with Layer::rows.
  void set_target(const Layer& layer, MapRows& target) { rows_.set_target(*layer.rows, target); }
  void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                   const DeviceCorrespondence& other, const cl::Array<float>& shares);

  /// Recomputes some texels of the maps that do not depend on positions.
  /// \param part a band of these texels only; `match` is the correspondence of its samples
  /// \param places indices of these texels in the map
  void recompute_texels(const TexelBand& part, const DeviceCorrespondence& match,
                        std::span<const std::size_t> places);

  std::vector<Layer>& all() { return layers_; }
  const std::vector<Layer>& all() const { return layers_; }
  /// Host copies of the band's arrays, shared by all readers.
  BandReads& reads() { return *band_reads_; }
  /// The first map of unit vectors; null if there is none.
  const Image* unit_vectors() const;
  /// True if any map depends on the positions of matched points (MapRow::follows_positions).
  bool any_map_depends_on_positions() const;
  /// True if a texel of any map depends on texels around it (MapRow::reads_around).
  bool any_map_reads_around() const;
  /// True if any map stores the directions that a match by visibility used.
  bool any_map_needs_visibility() const;
  /// True if any map is computed to a given error bound.
  bool any_map_obeys_max_error(const BakeOptions& options) const;
  /// True if any map fills missed texels regardless of MissPolicy.
  bool any_map_fills_misses() const;
  /// Per texel: empty, baked or missed (image/gutter.h).
  const std::vector<std::uint8_t>& coverage() const { return coverage_; }

  /// Mip levels of each map; none for types that cannot be averaged.
  std::vector<std::vector<Image>> mips(cl::Context& context, const BakeOptions& options,
                                       const ChartMap& charts) const;

  /// Fills background and padding, and encodes all maps that are not finished row by row. \param keep leaves the layers unchanged, for a further bake
  /// \param coverage  out: includes padding
  /// \param padded out: number of padding texels
  /// \param drawn out: the normals as renderers read them, independent of the encoding; null: not computed
  std::vector<Image> finish(cl::Context& context, const BakeOptions& options, bool keep,
                            std::vector<std::uint8_t>& coverage, std::uint64_t& padded,
                            Image* drawn = nullptr);

  /// The padding texels that copy each texel. Requires finite padding that fills no missed texels.
  Adjacency padding_copies(cl::Context& context, std::int32_t texels) const;
  /// Finishes some texels, and the padding that copies them, as finish() does. All other texels must be finished
  /// already.
  void finish_texels(const BakeOptions& options, std::span<const std::size_t> places,
                     const Adjacency& padding, std::vector<BakedMap>& maps) const;

 private:
  BandPixels pixels(Layer& layer, const TexelBand& band);
  void extend(Image& image, std::size_t texels);
  std::vector<std::size_t> pad_with(cl::Context& context, const BakeOptions& options,
                                    std::size_t first, std::vector<Image>& images,
                                    std::vector<std::uint8_t>& coverage,
                                    std::uint64_t& padded) const;

  SharedWorks shared_results_;  // Intermediate results of one band that several maps share
  std::shared_ptr<BandReads> band_reads_;
  std::vector<MapRow> own_rows_;  // Registry rows of transfers, variants and custom maps
  std::vector<Layer> layers_;
  RowFinisher rows_;
  std::vector<std::uint8_t> coverage_;
  // number of bytes of reserved images that are not written yet; see count_unwritten()
  std::size_t unwritten_bytes_ = 0;
};

}  // namespace kiln
