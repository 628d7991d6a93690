// The maps of one bake: made together, band by band, from one correspondence; then finished one by one.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "cl/context.h"
#include "detail/registry.h"
#include "image/mips.h"
#include "mesh/high_poly_normals.h"

namespace kiln {

/// One map of a bake: its values as they are, without padding or encoding.
struct Layer {
  const MapRow* row = nullptr;
  std::unique_ptr<MapMaker> maker;
  Image image;
};

class Layers {
 public:
  /// Layers of the maps that the options ask for, each once.
  /// \param with_images  false: there are makers alone, for callers who have texels of their own
  /// \param finer, checks  MapRequest's
  Layers(const Source::Impl& source, const LowSurface& surface, const BakeOptions& options,
         bool with_images = true, std::uint32_t finer = 1, bool checks = false);

  /// Another band follows, or another match of it.
  void next_band() { shared_.next_band(); }
  /// The high poly changed.
  void next_source() { shared_.next_source(); }
  /// Makes the texels of a band in all maps, and says which are covered.
  void run(const TexelBand& band, const DeviceCorrespondence& match);
  void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                   const DeviceCorrespondence& other, const cl::Array<float>& shares);

  /// Makes some texels anew, of the maps that do not follow positions.
  /// \param part    a band of these texels alone, with `match` of its samples
  /// \param places  of its texels in the map
  void run_some(const TexelBand& part, const DeviceCorrespondence& match,
                std::span<const std::size_t> places);

  std::vector<Layer>& all() { return layers_; }
  const std::vector<Layer>& all() const { return layers_; }
  /// Arrays of the band that all maps read; for others that need the same.
  BandReads& reads() { return *reads_; }
  /// The first map of unit vectors; null where there is none.
  const Image* unit_vectors() const;
  /// True if one of the maps changes wherever vertices of the high poly move.
  bool follow_positions() const;
  /// True if one of the maps may change anywhere wherever the high poly changes.
  bool read_around() const;
  /// True if one of the maps holds what a match by visibility went by.
  bool need_visibility() const;
  /// True if one of the maps is made to an error that is given.
  bool obey_max_error(const BakeOptions& options) const;
  /// True if one of the maps fills what was missed whatever MissPolicy says.
  bool fill_misses() const;
  /// Per texel: empty, baked or missed (image/gutter.h).
  const std::vector<std::uint8_t>& coverage() const { return coverage_; }

  /// Levels below each map, in the maps' order; none for types that are never averaged.
  std::vector<std::vector<Image>> mips(cl::Context& context, const BakeOptions& options,
                                       const ChartMap& charts) const;

  /// Background, padding and encoding. \param keep  leaves the layers as they are, for baking again
  /// \param coverage  out: with padding
  /// \param padded    out: how many texels became padding
  /// \param drawn     out: the normals as renderers read them, whatever the encoding; null: not wanted
  std::vector<Image> finish(cl::Context& context, const BakeOptions& options, bool keep,
                            std::vector<std::uint8_t>& coverage, std::uint64_t& padded,
                            Image* drawn = nullptr);

  /// Which texels of padding copy each texel: with finite padding that fills no missed texels.
  Adjacency padding_of(cl::Context& context, std::int32_t texels) const;
  /// The same for some texels, and the padding that copies them, in maps that are finished otherwise.
  void finish_some(const BakeOptions& options, std::span<const std::size_t> places,
                   const Adjacency& padding, std::vector<BakedMap>& maps) const;

 private:
  BandPixels pixels(Layer& layer, const TexelBand& band);
  std::vector<std::size_t> pad_with(cl::Context& context, const BakeOptions& options,
                                    std::size_t first, std::vector<Image>& images,
                                    std::vector<std::uint8_t>& coverage,
                                    std::uint64_t& padded) const;

  SharedWorks shared_;  // of the makers
  std::shared_ptr<BandReads> reads_;
  std::vector<MapRow> own_rows_;  // of maps that the options bring along
  std::vector<Layer> layers_;
  std::vector<std::uint8_t> coverage_;
};

}  // namespace kiln
