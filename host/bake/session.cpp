#include "kiln/session.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "bake/layers.h"
#include "bake/match_stage.h"
#include "bake/report.h"
#include "base/parallel.h"
#include "image/gutter.h"
#include "match/match_array.h"
#include "match/uv.h"
#include "mesh/charts.h"
#include "mesh/dense_normals.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

constexpr std::size_t kLocal = 64;

const Mesh& checked(const Mesh& high) {
  if (high.triangles.empty()) {
    throw Error(ErrorCode::input,
                "'" + high.name + "' has no triangles: there is nothing to bake from.");
  }
  for (const Vec3& p : high.positions) {
    if (is_finite(p)) continue;
    throw Error(ErrorCode::input, "'" + high.name +
                                      "' has a vertex that is not finite, which a session's mesh "
                                      "must not: remove it.");
  }
  return high;
}

/// A list without repetitions of what was added since it was cleared.
class Stamps {
 public:
  explicit Stamps(std::size_t size = 0) : stamped_(size, 0) {}
  void add(std::uint32_t item) {
    if (stamped_[item] != 0) return;
    stamped_[item] = 1;
    items_.push_back(item);
  }
  void sort() { std::sort(items_.begin(), items_.end()); }
  void clear() {
    for (const std::uint32_t item : items_) stamped_[item] = 0;
    items_.clear();
  }
  const std::vector<std::uint32_t>& items() const { return items_; }

 private:
  std::vector<std::uint8_t> stamped_;
  std::vector<std::uint32_t> items_;
};

}  // namespace

struct BakeSession::Impl {
  struct Band {
    TexelBand texels;
    Correspondence match;
    std::vector<std::uint32_t> index, first;  // as on the device
    std::uint32_t first_texel = 0;            // of all bands' texels one after another
  };

  Impl(const Device& device, Mesh&& dense, Mesh&& low_mesh, const BakeOptions& wanted,
       const SessionOptions& session)
      : high(std::move(dense)),
        low(std::move(low_mesh)),
        options(wanted),
        bounds(session.bounds ? *session.bounds : Bounds::of(checked(high))),
        source(device, checked(high), traversal_of(session.traversal), bounds),
        context(source.device.context()),
        normals(high, source.positions),
        moved(high.positions.size()),
        set(high.normals.size()) {
    if (options.match != nullptr || options.progress) {
      throw Error(ErrorCode::usage,
                  "A session takes neither a saved match nor a progress callback.");
    }
    check_options(options);
    if (options.visibility.clusters > 1 || options.fallback_blend > 0) {
      throw Error(ErrorCode::usage,
                  "A session makes one map of one match: leave out clusters and blending.");
    }
    source.will_move = true;
    surface = LowSurface::of(low, source.frame, options.cage_mesh);
    by_uv = options.method == MatchMethod::uv && options.fallback.empty();
    // These follow the hierarchy, and hold nothing else of the dense mesh.
    keeps_matcher = match_row(options.method).follows_bvh &&
                    std::all_of(options.fallback.begin(), options.fallback.end(),
                                [](MatchMethod next) { return match_row(next).follows_bvh; });
    layers = std::make_unique<Layers>(source, surface, options);
    sample();
    users = Adjacency::make(high.positions.size(), high.triangles.size() * 3,
                            [&](std::size_t i) { return high.triangles[i / 3][i % 3]; });
    low_hash = hash_low(low);
  }

  void sample() {
    TexelSampler sampler(context, surface,
                         {options.width, options.height, options.samples, kBandSamples});
    const EdgeTurn turn = edge_turn(options, source, surface);
    std::vector<std::uint32_t> chart_of_triangle;
    if (options.mips) {
      chart_of_triangle = uv_charts(low);
      charts = ChartMap(std::size_t{options.width} * options.height, options.samples);
    }
    for (std::uint32_t b = 0; b < sampler.band_count(); ++b) {
      Band band;
      band.texels = sampler.sample(b);
      turn.apply(context, band.texels);
      band.match = Correspondence(context, band.texels.capacity);
      band.match.count = band.texels.sample_count;
      band.index.resize(band.texels.texel_count);
      band.first.resize(band.texels.texel_count + std::size_t{1});
      band.texels.texel_index.read(context, band.index);
      band.texels.texel_first.read(context, band.first);
      band.first_texel = static_cast<std::uint32_t>(texel_count);
      texel_count += band.texels.texel_count;
      if (options.mips) charts.store(context, band.texels, options.width, chart_of_triangle);
      bands.push_back(std::move(band));
    }
    sampler_warnings = sampler.report().warnings;
    chosen = Stamps(texel_count);
  }

  /// What the source's changes come to. \returns the entries of the pool of normals that changed
  DenseNormals::Change update_source();
  void match_all();
  void read_all();
  void read(const DenseNormals::Change& change);
  void read_chosen(const Band& band, std::span<const std::uint32_t> texels);
  void finish_all();
  void finish_chosen();
  void index_texels();
  void index_gutter();
  std::size_t pixel_of(const Band& band, std::uint32_t texel) const {
    return std::size_t{band.texels.first_row} * options.width + band.index[texel];
  }
  const Band& band_of(std::uint32_t texel) const {
    const auto after =
        std::upper_bound(bands.begin(), bands.end(), texel,
                         [](std::uint32_t t, const Band& band) { return t < band.first_texel; });
    return *(after - 1);
  }
  /// Whether each texel of the gutter is a copy of one baked texel, always the same.
  bool gutter_is_copied() const {
    return options.gutter >= 0 && !options.mips &&
           (options.miss == MissPolicy::keep || result.report.missed == 0);
  }

  Mesh high, low;
  BakeOptions options;
  Bounds bounds;
  Source::Impl source;
  cl::Context& context;
  DenseNormals normals;
  LowSurface surface;
  bool by_uv = false, keeps_matcher = false;
  std::unique_ptr<Layers> layers;
  std::unique_ptr<UvRaster> uv;
  std::unique_ptr<Matcher> matcher;
  std::shared_ptr<const VisibilityField> visibility;  // the light mesh's: it stays
  std::vector<Band> bands;
  std::size_t texel_count = 0;
  ChartMap charts;
  std::vector<Warning> sampler_warnings;
  std::uint64_t low_hash = 0;

  Adjacency users;      // corners of each vertex
  Stamps moved, set;    // vertices and normals changed since the last bake
  Adjacency texels_of;  // of each dense triangle; empty where out of date
  Stamps chosen;        // texels to be read anew
  bool everything = false;
  Adjacency gutter_of;  // texels that copy each one; empty where not known

  bool baked = false;
  BakeResult result;
  Update update;
};

DenseNormals::Change BakeSession::Impl::update_source() {
  DenseNormals::Change change;
  Stamps triangles(high.triangles.size());
  if (!moved.items().empty()) {
    moved.sort();
    for (const std::uint32_t vertex : moved.items()) {
      for (const std::uint32_t corner : users.of(vertex)) triangles.add(corner / 3);
    }
    triangles.sort();
    const std::uint32_t first = moved.items().front();
    std::vector<Vec3> positions(moved.items().back() - first + std::size_t{1});
    for (std::size_t i = 0; i < positions.size(); ++i) {
      positions[i] = source.frame.to_frame(high, first + i);
    }
    source.move(first, positions, triangles.items());
    if (uv) uv->set_positions(first, positions);
    change = normals.move(high, source.positions, triangles.items());
  }
  if (!set.items().empty() && !change.rebuilt) {
    set.sort();
    change = normals.set(high, source.positions, set.items());
  }
  set.clear();

  const CornerNormals& corners = normals.corners();
  if (change.rebuilt) {
    source.attributes = SourceAttributes(context, corners);
    for (std::uint32_t t = 0; t < high.triangles.size(); ++t) triangles.add(t);
  } else if (!change.entries.empty()) {
    const std::uint32_t first = change.entries.front();
    const std::size_t count = change.entries.back() - first + std::size_t{1};
    source.attributes.normals.write(context,
                                    std::span<const float>(&corners.normals[first].x, count * 3),
                                    std::size_t{3} * first);
    for (const std::uint32_t entry : change.entries) {
      for (const std::uint32_t corner : normals.corners_of(entry)) triangles.add(corner / 3);
    }
  }
  update.triangles = triangles.items().size();
  return change;
}

/// Finds all samples' points anew.
void BakeSession::Impl::match_all() {
  BakeReport& report = result.report;
  if (by_uv && uv == nullptr) {
    uv = std::make_unique<UvRaster>(source, options.width, options.height, options.samples);
    for (Band& band : bands) {
      uv->match(band.texels, band.match, true);
      uv->distance(band.texels, band.match);
      uv->measure(band.match);
    }
  } else if (!by_uv) {
    if (matcher == nullptr || !keeps_matcher) {
      report.views.reset();
      report.warnings.clear();
      matcher = nullptr;
      matcher = make_matcher(source, surface, options, report, 0, visibility);
    }
    for (Band& band : bands) matcher->run(band.texels, band.match);
  }
  double distance_sum = 0;
  report.texels = report.samples = report.outward = report.inward = report.cage = report.viewed =
      report.closest = report.by_uv = report.missed = 0;
  for (const Band& band : bands) {
    count_samples(context, band.match, 1 / source.frame.scale, report, distance_sum);
    report.texels += band.texels.texel_count;
    report.samples += band.texels.sample_count;
  }
  const std::uint64_t hits = report.samples - report.missed;
  report.mean_abs_distance = hits != 0 ? distance_sum / static_cast<double>(hits) : 0;
  const std::vector<Warning> made = std::exchange(report.warnings, {});
  MatchNotes notes;
  if (uv) uv->report(options.uv, notes);
  // Its conditions are those of the first bake.
  if (matcher && !baked) matcher->finish(notes);
  take_notes(std::move(notes), report);
  report.warnings.insert(report.warnings.begin(), made.begin(), made.end());
  report.warnings.insert(report.warnings.end(), sampler_warnings.begin(), sampler_warnings.end());
  warn_about_misses(report);
  texels_of = {};
  gutter_of = {};
  update.matched = true;
}

void BakeSession::Impl::read_all() {
  for (const Band& band : bands) layers->run(band.texels, band.match);
  update.texels = texel_count;
}

/// Which texels each dense triangle is matched by.
void BakeSession::Impl::index_texels() {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;  // triangle, texel
  for (const Band& band : bands) {
    std::vector<std::uint32_t> triangle(band.texels.sample_count);
    band.match.triangle.read(context, triangle);
    for (std::uint32_t t = 0; t < band.texels.texel_count; ++t) {
      for (std::uint32_t s = band.first[t]; s < band.first[t + 1]; ++s) {
        const bool again = s != band.first[t] && triangle[s] == triangle[s - 1];
        if (triangle[s] != KILN_NO_TRIANGLE && !again) {
          pairs.emplace_back(triangle[s], band.first_texel + t);
        }
      }
    }
  }
  texels_of = Adjacency::make(high.triangles.size(), pairs.size(),
                              [&](std::size_t i) { return pairs[i].first; });
  for (std::uint32_t& item : texels_of.items) item = pairs[item].second;
}

/// Reads the texels that changed normals show in.
void BakeSession::Impl::read(const DenseNormals::Change& change) {
  if (texels_of.first.empty()) index_texels();
  for (const std::uint32_t entry : change.entries) {
    for (const std::uint32_t corner : normals.corners_of(entry)) {
      for (const std::uint32_t texel : texels_of.of(corner / 3)) chosen.add(texel);
    }
  }
  if (chosen.items().size() > texel_count / 2) {
    read_all();
    everything = true;
    return;
  }
  chosen.sort();
  const std::vector<std::uint32_t>& texels = chosen.items();
  std::size_t begin = 0;
  for (const Band& band : bands) {
    std::size_t end = begin;
    while (end < texels.size() && texels[end] < band.first_texel + band.texels.texel_count) ++end;
    read_chosen(band, std::span(texels).subspan(begin, end - begin));
    begin = end;
  }
  update.texels = texels.size();
}

void BakeSession::Impl::read_chosen(const Band& band, std::span<const std::uint32_t> texels) {
  if (texels.empty()) return;
  const auto count = static_cast<std::uint32_t>(texels.size());
  std::vector<std::uint32_t> own(count), places(count), first(count + std::size_t{1});
  for (std::size_t i = 0; i < count; ++i) {
    own[i] = texels[i] - band.first_texel;
    first[i + 1] = first[i] + band.first[own[i] + 1] - band.first[own[i]];
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
  Correspondence match;
  match.count = match.capacity = samples;
  match.triangle = cl::Array<std::uint32_t>(context, samples);
  match.barycentric = cl::Array<float>(context, std::size_t{2} * samples);
  const cl::Array<std::uint32_t> indices(context, std::span<const std::uint32_t>(own));
  context.launch(context.kernel("session", "kiln_session_gather"), count, kLocal, count,
                 band.texels.capacity, band.match.capacity, samples, indices, part.texel_first,
                 band.texels.texel_first, band.texels.triangle, band.texels.barycentric,
                 band.match.triangle, band.match.barycentric, part.triangle, part.barycentric,
                 match.triangle, match.barycentric);
  std::vector<float> values;
  std::vector<std::uint8_t> coverage(count);
  layers->reads().next_band();
  for (Layer& layer : layers->all()) {
    if (layer.row->follows_positions) continue;  // they stay, or all are read
    const std::size_t channels = layer.image.channels;
    values.resize(channels * count);
    layer.maker->run(part, match, {values, coverage});
    for (std::size_t i = 0; i < count; ++i) {
      std::copy_n(&values[channels * i], channels,
                  &layer.image.pixels[channels * pixel_of(band, own[i])]);
    }
  }
}

void BakeSession::Impl::finish_all() {
  std::vector<std::vector<Image>> mips(layers->all().size());
  if (options.mips) mips = layers->mips(context, options, charts);
  std::vector<Image> images =
      layers->finish(context, options, true, result.coverage, result.report.gutter_texels);
  result.maps.clear();
  for (std::size_t l = 0; l < images.size(); ++l) {
    result.maps.push_back(
        {layers->all()[l].row->info.kind, std::move(images[l]), std::move(mips[l]), 0});
  }
}

/// Which texel each of the gutter's copies: told by filling a map of places.
void BakeSession::Impl::index_gutter() {
  const std::vector<std::uint8_t>& covered = layers->coverage();
  Image places{options.width, options.height, 2, {}};
  places.pixels.resize(covered.size() * 2);
  for (std::size_t i = 0; i < covered.size(); ++i) {
    places.pixels[2 * i] = static_cast<float>(i % options.width);
    places.pixels[2 * i + 1] = static_cast<float>(i / options.width);
  }
  std::vector<std::uint8_t> coverage = covered;
  fill_gutter(context, places, coverage, {options.gutter, false, false});
  gutter_of = Adjacency::make(covered.size(), covered.size(), [&](std::size_t i) {
    if (coverage[i] != kCoverageGutter) return covered.size();
    return static_cast<std::size_t>(places.pixels[2 * i + 1]) * options.width +
           static_cast<std::size_t>(places.pixels[2 * i]);
  });
}

void BakeSession::Impl::finish_chosen() {
  if (gutter_of.first.empty()) index_gutter();
  const std::vector<std::uint32_t>& texels = chosen.items();
  const std::vector<std::uint8_t>& covered = layers->coverage();
  for (std::size_t l = 0; l < layers->all().size(); ++l) {
    const MapInfo& info = layers->all()[l].row->info;
    if (info.type == MapType::coverage) continue;
    const Image& raw = layers->all()[l].image;
    Image& finished = result.maps[l].image;
    const std::size_t channels = raw.channels;
    parallel_for(texels.size(), 1 << 12, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Band& band = band_of(texels[i]);
        const std::size_t place = pixel_of(band, texels[i] - band.first_texel);
        float* pixel = &finished.pixels[channels * place];
        std::copy_n(&raw.pixels[channels * place], channels, pixel);
        encode_texel(info, options, covered[place], pixel);
        for (const std::uint32_t copy : gutter_of.of(place)) {
          // Encoded as a texel of the gutter, which is as one that was baked.
          float* to = &finished.pixels[channels * std::size_t{copy}];
          std::copy_n(&raw.pixels[channels * place], channels, to);
          encode_texel(info, options, kCoverageGutter, to);
        }
      }
    });
  }
}

BakeSession::BakeSession(const Device& device, Mesh high, Mesh low, const BakeOptions& options,
                         const SessionOptions& session)
    : impl_(std::make_unique<Impl>(device, std::move(high), std::move(low), options, session)) {}
BakeSession::~BakeSession() = default;
BakeSession::BakeSession(BakeSession&&) noexcept = default;
BakeSession& BakeSession::operator=(BakeSession&&) noexcept = default;

const Mesh& BakeSession::high() const { return impl_->high; }
const Bounds& BakeSession::bounds() const { return impl_->bounds; }
const BakeSession::Update& BakeSession::last_update() const { return impl_->update; }

namespace {

void check_range(const char* what, std::uint32_t first, std::size_t count, std::size_t size) {
  if (first <= size && count <= size - first) return;
  throw Error(ErrorCode::usage, std::string(what) + " " + std::to_string(first) + " to " +
                                    std::to_string(first + count) +
                                    " were given, but the dense mesh has " + std::to_string(size) +
                                    ".");
}

}  // namespace

void BakeSession::set_positions(std::uint32_t first, std::span<const Vec3> positions) {
  Impl& impl = *impl_;
  Mesh& mesh = impl.high;
  check_range("Positions", first, positions.size(), mesh.positions.size());
  const Frame& frame = impl.source.frame;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double p[3] = {positions[i].x, positions[i].y, positions[i].z};
    for (std::size_t k = 0; k < 3; ++k) {
      // Within the bounds it is at most 0.5; kernels count on about 1.
      const double place = (p[k] + (mesh.origin[k] - frame.center[k])) * frame.scale;
      if (std::abs(place) <= 1) continue;
      throw Error(ErrorCode::usage,
                  "The position of vertex " + std::to_string(first + i) +
                      " is not finite, or lies too far out of the session's bounds: give larger "
                      "SessionOptions::bounds.");
    }
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (mesh.positions[first + i] == positions[i]) continue;
    mesh.positions[first + i] = positions[i];
    impl.moved.add(static_cast<std::uint32_t>(first + i));
  }
}

void BakeSession::set_normals(std::uint32_t first, std::span<const Vec3> normals) {
  Impl& impl = *impl_;
  Mesh& mesh = impl.high;
  check_range("Normals", first, normals.size(),
              mesh.normal_triangles.empty() ? 0 : mesh.normals.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (is_usable_normal(normals[i])) continue;
    throw Error(ErrorCode::usage, "Normal " + std::to_string(first + i) +
                                      " has no direction: it must be finite and "
                                      "longer than 0.");
  }
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (mesh.normals[first + i] == normals[i]) continue;
    mesh.normals[first + i] = normals[i];
    impl.set.add(static_cast<std::uint32_t>(first + i));
  }
}

const BakeResult& BakeSession::bake() {
  Impl& impl = *impl_;
  Stopwatch watch;
  impl.update = {};
  const bool any_moved = !impl.moved.items().empty();
  if (impl.baked && !any_moved && impl.set.items().empty()) return impl.result;
  const DenseNormals::Change change = impl.update_source();
  impl.layers->reads().next_source();
  impl.context.finish();
  impl.update.seconds_source = watch.lap();
  if (!impl.baked || (any_moved && !impl.by_uv)) {
    impl.match_all();
  } else if (any_moved && (impl.options.keep_match || impl.layers->follow_positions())) {
    for (Impl::Band& band : impl.bands) impl.uv->distance(band.texels, band.match);
  }
  impl.context.finish();
  impl.update.seconds_match = watch.lap();

  impl.chosen.clear();
  impl.everything = change.rebuilt || impl.update.matched || impl.layers->read_around() ||
                    (any_moved && impl.layers->follow_positions());
  if (impl.everything) {
    impl.read_all();
  } else {
    impl.read(change);
  }
  impl.update.seconds_detail = watch.lap();
  if (impl.update.matched || !impl.gutter_is_copied() || impl.everything) {
    impl.finish_all();
  } else {
    impl.finish_chosen();
  }
  if (impl.options.keep_match) {
    const double unit = 1 / impl.source.frame.scale;
    impl.result.match = make_match(impl.options.width, impl.options.height, impl.options.samples,
                                   impl.high.triangles.size());
    impl.result.match->source_hash = hash_source(impl.source.positions, impl.high.triangles);
    impl.result.match->low_hash = impl.low_hash;
    for (const Impl::Band& band : impl.bands) {
      store_band(impl.context, band.texels, band.match, unit, *impl.result.match);
    }
  }
  impl.result.report.peak_device_bytes = impl.context.peak_device_bytes();
  impl.moved.clear();
  impl.baked = true;
  impl.update.seconds_image = watch.lap();
  return impl.result;
}

}  // namespace kiln
