#include <numeric>
#include <utility>

#include "bake/session_impl.h"
#include "mesh/kernels_shared.h"

namespace kiln {
SessionTexels::SessionTexels(Pipeline& pipeline, std::size_t triangles, std::uint32_t width)
    : pipeline_(pipeline), triangles_(triangles), width_(width) {
  for (const PipelineBand& stored_band : pipeline.bands()) {
    const std::uint32_t texels = stored_band.texels.texel_count;
    Band band;
    band.index.resize(texels);
    band.first.resize(texels + std::size_t{1});
    stored_band.texels.texel_index.read(pipeline.context(), band.index);
    stored_band.texels.texel_first.read(pipeline.context(), band.first);
    band.first_texel = static_cast<std::uint32_t>(count_);
    count_ += texels;
    bands_.push_back(std::move(band));
  }
  chosen_texels_ = IndexSet(count_);
}

void SessionTexels::invalidate() { texels_of_triangle_ = {}; }

void SessionTexels::prepare(const BakeOptions& options, bool copied) {
  if (texels_of_triangle_.first.empty()) index();
  if (copied) record_padding(options);
  run_kernels_once();
}

/// Recomputes some texels although nothing has changed, so that kernels are compiled before the first update:
/// drivers compile a kernel at its first launch, PoCL once for grids below 2^16 and once for larger ones.
void SessionTexels::run_kernels_once() {
  if (pipeline_.layers().any_map_reads_around()) return;
  for (const std::size_t some : {std::size_t{1}, std::size_t{1} << 16}) {
    if (some > count_) continue;
    chosen_texels_.clear();
    for (std::size_t t = 0; t < some; ++t) chosen_texels_.add(static_cast<std::uint32_t>(t));
    read();
  }
  chosen_texels_.clear();
  places_.clear();
}

/// The padding stays valid as long as the coverage does not change.
void SessionTexels::record_padding(const BakeOptions& options) {
  const Layers& layers = pipeline_.layers();
  if (is_coverage_unchanged()) return;
  padding_ = layers.padding_copies(pipeline_.context(), options.encoding.gutter);
  padded_coverage_ = layers.coverage();
}

/// Builds an index from each triangle of the high poly to the texels matched to it.
void SessionTexels::index() {
  // Pairs of a triangle of the high poly and a texel that is matched to it
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::size_t b = 0; b < bands_.size(); ++b) {
    const Band& band = bands_[b];
    const PipelineBand& pipeline_band = pipeline_.bands()[b];
    std::vector<std::uint32_t> triangle(pipeline_band.texels.sample_count);
    pipeline_band.match.triangle.read(pipeline_.context(), triangle);
    for (std::uint32_t t = 0; t < band.index.size(); ++t) {
      for (std::uint32_t s = band.first[t]; s < band.first[t + 1]; ++s) {
        const bool is_repeated = s != band.first[t] && triangle[s] == triangle[s - 1];
        if (triangle[s] != KILN_NO_TRIANGLE && !is_repeated) {
          pairs.emplace_back(triangle[s], band.first_texel + t);
        }
      }
    }
  }
  texels_of_triangle_ =
      Adjacency::make(triangles_, pairs.size(), [&](std::size_t i) { return pairs[i].first; });
  for (std::uint32_t& item : texels_of_triangle_.items) item = pairs[item].second;
}

bool SessionTexels::choose_texels(const HighPolyNormals& normals,
                                  const HighPolyNormals::Change& normal_change) {
  chosen_texels_.clear();
  // If most normals changed, most texels changed, too, and the lookup is skipped.
  if (normal_change.entries.size() > normals.corners().normals.size() / 2) return false;
  if (texels_of_triangle_.first.empty()) index();
  for (const std::uint32_t entry : normal_change.entries) {
    for (const std::uint32_t corner : normals.corners_of(entry)) {
      for (const std::uint32_t texel : texels_of_triangle_.of(corner / 3))
        chosen_texels_.add(texel);
    }
    if (chosen_texels_.items().size() > count_ / 2) return false;
  }
  return chosen_texels_.items().size() <= count_ / 2;
}

std::size_t SessionTexels::map_index(std::size_t band, std::uint32_t texel) const {
  return std::size_t{pipeline_.bands()[band].texels.first_row} * width_ +
         bands_[band].index[texel - bands_[band].first_texel];
}

void SessionTexels::read() {
  chosen_texels_.sort();
  places_.clear();
  const std::vector<std::uint32_t>& texels = chosen_texels_.items();
  std::size_t begin = 0;
  for (std::size_t b = 0; b < bands_.size(); ++b) {
    const std::size_t end_texel = bands_[b].first_texel + bands_[b].index.size();
    std::size_t end = begin;
    while (end < texels.size() && texels[end] < end_texel) ++end;
    read_band(b, std::span(texels).subspan(begin, end - begin));
    begin = end;
  }
}

void SessionTexels::read_band(std::size_t number, std::span<const std::uint32_t> texels) {
  if (texels.empty()) return;
  cl::Context& context = pipeline_.context();
  const Band& band = bands_[number];
  const PipelineBand& whole_band = pipeline_.bands()[number];
  const auto count = static_cast<std::uint32_t>(texels.size());
  std::vector<std::uint32_t> texel_indices(count), places(count), first(count + std::size_t{1});
  for (std::size_t i = 0; i < count; ++i) {
    texel_indices[i] = texels[i] - band.first_texel;
    first[i + 1] = first[i] + band.first[texel_indices[i] + 1] - band.first[texel_indices[i]];
    places_.push_back(map_index(number, texels[i]));
  }
  std::iota(places.begin(), places.end(), 0U);
  const std::uint32_t samples = first.back();
  TexelBand part;
  part.texel_count = count;
  part.sample_count = part.capacity = samples;
  part.texel_index = cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(places));
  part.texel_first = cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(first));
  part.triangle = cl::Array<std::uint32_t>(context, samples);
  part.barycentric = cl::Array<float>(context, std::size_t{2} * samples);
  DeviceCorrespondence match;
  match.count = match.capacity = samples;
  match.triangle = cl::Array<std::uint32_t>(context, samples);
  match.barycentric = cl::Array<float>(context, std::size_t{2} * samples);
  const cl::Array<std::uint32_t> indices(context, std::span<const std::uint32_t>(texel_indices));
  context.launch(context.kernel("session", "kiln_session_gather"), count, kLocal, count,
                 whole_band.texels.capacity, whole_band.match.capacity, samples, indices,
                 part.texel_first, whole_band.texels.texel_first, whole_band.texels.triangle,
                 whole_band.texels.barycentric, whole_band.match.triangle,
                 whole_band.match.barycentric, part.triangle, part.barycentric, match.triangle,
                 match.barycentric);
  pipeline_.layers().recompute_texels(part, match, std::span(places_).last(count));
}

/// Bounds of the chosen texels and of the padding that copies them.
Rectangle SessionTexels::box() const {
  std::size_t left = width_, right = 0, top = ~std::size_t{0}, bottom = 0;
  const auto add = [&](std::size_t place) {
    const std::size_t x = place % width_, y = place / width_;
    left = std::min(left, x);
    right = std::max(right, x + 1);
    top = std::min(top, y);
    bottom = std::max(bottom, y + 1);
  };
  for (const std::size_t place : places_) {
    add(place);
    for (const std::uint32_t copy : padding_.of(place)) add(copy);
  }
  if (right == 0) return {};
  const auto to_u32 = [](std::size_t value) { return static_cast<std::uint32_t>(value); };
  return {to_u32(left), to_u32(top), to_u32(right - left), to_u32(bottom - top)};
}

bool SessionTexels::is_coverage_unchanged() const {
  return !padding_.first.empty() && padded_coverage_ == pipeline_.layers().coverage();
}

void SessionTexels::finish_all_texels(const BakeOptions& options) {
  if (all_map_indices_.empty()) {
    all_map_indices_.reserve(count_);
    for (std::size_t b = 0; b < bands_.size(); ++b) {
      for (std::uint32_t t = 0; t < bands_[b].index.size(); ++t) {
        all_map_indices_.push_back(map_index(b, bands_[b].first_texel + t));
      }
    }
  }
  std::vector<BakedMap>& maps = pipeline_.result().maps;
  Layers& layers = pipeline_.layers();
  layers.finish_texels(options, all_map_indices_, padding_, maps);
  for (std::size_t l = 0; l < maps.size(); ++l) {
    const Layer& layer = layers.all()[l];
    if (layer.row->info.type == MapType::coverage) maps[l].image = layer.image;
  }
}

Rectangle SessionTexels::finish(const BakeOptions& options) {
  record_padding(options);
  pipeline_.layers().finish_texels(options, places_, padding_, pipeline_.result().maps);
  return box();
}

}  // namespace kiln
