// The maps of one bake: made together, band by band, from one correspondence; then finished one by one.
#pragma once

#include <memory>
#include <vector>

#include "cl/context.h"
#include "detail/registry.h"
#include "image/mips.h"

namespace kiln {

/// One map of a bake: its values as they are, without padding or encoding.
struct Layer {
  const MapRow* row = nullptr;
  std::unique_ptr<MapMaker> maker;
  Image image;
};

class Layers {
 public:
  /// Of the maps that the options ask for, each once.
  Layers(const Source::Impl& source, const LowSurface& surface, const BakeOptions& options);

  /// Makes the texels of a band in all maps, and says which are covered.
  void run(const TexelBand& band, const Correspondence& match);
  void run_blended(const TexelBand& band, const Correspondence& match, const Correspondence& other,
                   const cl::Array<float>& shares);

  std::vector<Layer>& all() { return layers_; }
  /// What all maps read of the band that was run last; for others that need the same.
  BandReads& reads() { return *reads_; }
  /// The first map of unit vectors; null where there is none.
  const Image* unit_vectors() const;
  /// Whether one of the maps changes wherever vertices of the high poly move.
  bool follow_positions() const;
  /// Whether one of the maps may change anywhere wherever the high poly changes.
  bool read_around() const;
  /// Whether one of the maps holds what a match by visibility went by.
  bool need_visibility() const;
  /// Per texel: empty, baked or missed (image/gutter.h).
  const std::vector<std::uint8_t>& coverage() const { return coverage_; }

  /// Levels below each map, in the maps' order; none for types that are never averaged.
  std::vector<std::vector<Image>> mips(cl::Context& context, const BakeOptions& options,
                                       const ChartMap& charts) const;

  /// Background, padding and encoding. \param keep  leaves the layers as they are, for baking again
  /// \param coverage  out: with padding
  /// \param padded    out: how many texels became padding
  std::vector<Image> finish(cl::Context& context, const BakeOptions& options, bool keep,
                            std::vector<std::uint8_t>& coverage, std::uint64_t& padded);

 private:
  BandPixels pixels(Layer& layer, const TexelBand& band);
  void forget();

  std::vector<std::shared_ptr<SharedWork>> shared_;  // of the makers
  std::shared_ptr<BandReads> reads_;
  std::vector<Layer> layers_;
  std::vector<std::uint8_t> coverage_;
};

}  // namespace kiln
