#include "match/uv.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "accel/device_bvh.h"
#include "base/formatted.h"
#include "base/option.h"
#include "base/parallel.h"
#include "base/percent.h"
#include "mesh/kernels_shared.h"
#include "mesh/uv_grid.h"
#include "source/high_poly_uvs.h"

namespace kiln {
namespace {

constexpr std::uint32_t kRowsPerTile = KILN_UV_TILE;

/// Number of mantissa bits that index the logarithmic distance histogram, in addition to the exponent.
constexpr std::uint32_t kFractionBits = 9;
constexpr std::uint32_t kDroppedBits = 23 - kFractionBits;

/// True if the width or height of a piece's box is not exact as a float.
bool is_inexact_as_float(const kiln_uv_piece& piece) {
  constexpr std::int32_t kMaxExactFloat = 1 << 24;
  const auto [x_low, x_high] = std::minmax_element(piece.x, piece.x + 3);
  const auto [y_low, y_high] = std::minmax_element(piece.y, piece.y + 3);
  return *x_high - *x_low > kMaxExactFloat || *y_high - *y_low > kMaxExactFloat;
}

std::string triangles(std::uint64_t count) {
  return std::to_string(count) + " triangle" + (count == 1 ? "" : "s") + " of the high poly";
}

}  // namespace

UvRaster::UvRaster(const Source::Impl& source, std::uint32_t width, std::uint32_t height,
                   std::uint32_t samples, UvPath path)
    : context_(context_of(source.device)),
      // With one work-item per run of rows, loops may have millions of iterations, but Mesa's
      // llvmpipe aborts loops after 65,535.
      uses_row_runs_(path == UvPath::automatic
                         ? choose_traversal(context_, Traversal::automatic) == Traversal::cpu
                         : path == UvPath::runs),
      frame_(source.frame),
      width_(width),
      samples_(samples) {
  UvLayout layout = UvLayout::of(source, width * samples, height * samples);
  subpixel_shift_ = layout.shift;
  has_large_pieces_ = std::any_of(layout.pieces.begin(), layout.pieces.end(), is_inexact_as_float);
  triangle_counts_.outside = layout.outside;
  triangle_counts_.without_area = layout.without_area;
  uv_pieces_ = cl::Array<kiln_uv_piece>(context_, std::span<const kiln_uv_piece>(layout.pieces));
  piece_clips_ = cl::Array<kiln_uv_clip>(context_, std::span<const kiln_uv_clip>(layout.clips));
  piece_tasks_ = cl::Array<kiln_uv_task>(context_, std::span<const kiln_uv_task>(layout.tasks));
  if (uv_pieces_.empty()) {  // The kernel reads one element even if there are no pieces
    kiln_uv_piece none{};
    none.x[1] = none.y[2] = 1;
    uv_pieces_ = cl::Array<kiln_uv_piece>(context_, std::span<const kiln_uv_piece>(&none, 1));
  }
  first_task_ = std::move(layout.first_task);
  first_tasks_ = cl::Array<std::uint32_t>(context_, std::span<const std::uint32_t>(first_task_));
  triangle_of_piece_.reserve(layout.pieces.size());
  for (const kiln_uv_piece& piece : layout.pieces) triangle_of_piece_.push_back(piece.triangle);
  triangles_ = cl::Array<std::uint32_t>(
      context_,
      std::span<const std::uint32_t>(source.triangles[0].data(), source.triangles.size() * 3));
  positions_ = cl::Array<float>(
      context_, std::span<const float>(&source.positions[0].x, source.positions.size() * 3));
  histogram_.resize(std::size_t{1} << (31 - kDroppedBits));
}

void UvRaster::set_positions(std::uint32_t first, std::span<const Vec3> positions) {
  if (positions.empty()) return;
  positions_.write(context_, std::span<const float>(&positions[0].x, positions.size() * 3),
                   std::size_t{3} * first);
}

void UvRaster::rasterize(const kiln_uv_params& params) {
  if (uses_row_runs_) {
    context_.launch(context_.kernel("uv", "kiln_uv_cover_run"), params.run_count, 1, params,
                    first_tasks_, piece_tasks_, uv_pieces_, lowest_, highest_);
    return;
  }
  context_.fill(lowest_, std::uint32_t{KILN_UV_EMPTY});
  context_.fill(highest_, std::uint32_t{0});
  context_.launch(context_.kernel("uv", "kiln_uv_cover"), params.task_count, kLocal, params,
                  piece_tasks_, uv_pieces_, lowest_, highest_);
}

void UvRaster::match(const TexelBand& band, DeviceCorrespondence& match, bool first_time) {
  check_samples(band, samples_);
  if (first_time) sample_total_ += band.sample_count;
  const std::uint32_t first_row = band.first_row * samples_;
  const std::uint32_t end_row = first_row + band.row_count * samples_;
  const std::size_t grid_samples = std::size_t{end_row - first_row} * width_ * samples_;
  if (lowest_.size() != grid_samples) {
    lowest_ = {};
    highest_ = {};
    sample_rows_ = {};
    lowest_ = cl::Array<std::uint32_t>(context_, grid_samples);
    highest_ = cl::Array<std::uint32_t>(context_, grid_samples);
    sample_rows_ = cl::Array<kiln_uv_row>(context_, end_row - first_row);
  }
  kiln_uv_params params{};
  params.first_run = first_row / kRowsPerTile;
  params.run_count = (end_row + kRowsPerTile - 1) / kRowsPerTile - params.first_run;
  params.first_task = first_task_[params.first_run];
  params.task_count = first_task_[params.first_run + params.run_count] - params.first_task;
  params.count_overlap = first_time ? 1 : 0;
  params.row_begin = static_cast<std::int32_t>(first_row);
  params.row_end = static_cast<std::int32_t>(end_row);
  params.sample_width = width_ * samples_;
  params.shift = subpixel_shift_;
  params.samples = samples_;
  params.width = width_;
  params.texel_count = band.texel_count;
  params.sample_count = band.sample_count;
  params.band_capacity = band.capacity;
  params.hit_capacity = match.capacity;
  rasterize(params);
  if (first_time) {
    context_.launch(context_.kernel("uv", "kiln_uv_count"), end_row - first_row, kLocal, params,
                    lowest_, highest_, sample_rows_);
    const std::vector<kiln_uv_row> rows = sample_rows_.download(context_);
    const bool first = triangle_counts_.overlapping == 0;
    for (const kiln_uv_row& row : rows) {
      triangle_counts_.covered += row.covered;
      triangle_counts_.overlapping += row.overlapping;
    }
    if (first && triangle_counts_.overlapping != 0) {
      const auto found = std::find_if(rows.begin(), rows.end(),
                                      [](const kiln_uv_row& row) { return row.overlapping != 0; });
      const auto row = first_row + static_cast<std::uint32_t>(found - rows.begin());
      triangle_counts_.overlap = {triangle_of_piece_[found->lower],
                                  triangle_of_piece_[found->upper], found->column / samples_,
                                  row / samples_};
    }
  }
  if (uses_row_runs_ && samples_ == 1 && piece_clips_.empty() && !has_large_pieces_) {
    context_.launch(context_.kernel("uv", "kiln_uv_match_wide"), (band.texel_count + 7) / 8, kLocal,
                    params, band.texel_index, lowest_, uv_pieces_, match.triangle,
                    match.barycentric, match.distance, match.status);
    return;
  }
  const std::string defines = std::string(samples_ == 1 ? "-DKILN_UV_SINGLE=1" : "") +
                              (piece_clips_.empty() ? "" : " -DKILN_UV_CLIPPED=1") +
                              (has_large_pieces_ ? " -DKILN_UV_LARGE=1" : "");
  context_.launch(context_.kernel("uv", "kiln_uv_match", defines), band.texel_count, kLocal, params,
                  band.texel_index, band.texel_first, band.sample_slot, lowest_, uv_pieces_,
                  piece_clips_, match.triangle, match.barycentric, match.distance, match.status);
}

void UvRaster::distance(const TexelBand& band, DeviceCorrespondence& match) const {
  kiln_uv_params params{};
  params.sample_count = band.sample_count;
  params.band_capacity = band.capacity;
  params.hit_capacity = match.capacity;
  context_.launch(context_.kernel("uv", "kiln_uv_measure_distances"), band.sample_count, kLocal,
                  params, band.points, triangles_, positions_, match.triangle, match.barycentric,
                  match.distance);
}

void UvRaster::measure(const DeviceCorrespondence& match) {
  std::vector<std::uint8_t> status(match.count);
  std::vector<float> distance(match.count);
  match.status.read(context_, status);
  match.distance.read(context_, distance);
  for (std::size_t i = 0; i < status.size(); ++i) {
    if (status[i] != KILN_STATUS_UV) continue;
    const float size = std::abs(distance[i]);
    distance_sum_ += size;
    ++histogram_[std::bit_cast<std::uint32_t>(size) >> kDroppedBits];
  }
}

void UvRaster::report(const UvOptions& options, MatchNotes& notes) const {
  UvReport found = triangle_counts_;
  const double unit = 1 / frame_.scale;
  std::uint64_t count = 0;
  for (const std::uint64_t bin_count : histogram_) count += bin_count;
  if (count != 0) {
    found.mean_distance = distance_sum_ / static_cast<double>(count) * unit;
    const std::uint64_t rank = count - count / 20;
    std::uint64_t samples_in_lower_bins = 0;
    std::uint32_t bin = 0;
    while (samples_in_lower_bins + histogram_[bin] < rank)
      samples_in_lower_bins += histogram_[bin++];
    const std::uint32_t bits = bin == 0 ? 0 : (bin + 1) << kDroppedBits;
    found.p95_distance = double{std::bit_cast<float>(bits)} * unit;
  }
  notes.uv = found;
  if (sample_total_ == 0) return;

  const auto warn = [&](const char* code, const std::string& text, std::uint64_t times) {
    notes.warnings.push_back({code, text, times});
  };
  const double overlap = found.covered == 0 ? 0
                                            : static_cast<double>(found.overlapping) /
                                                  static_cast<double>(found.covered);
  if (overlap > options.warn_overlap || overlap > options.max_overlap) {
    const std::string text = "UV triangles of the high poly overlap on " + percent(overlap) +
                             " of the samples they "
                             "cover, for example triangles " +
                             std::to_string(found.overlap.lower) + " and " +
                             std::to_string(found.overlap.upper) + " at texel column " +
                             std::to_string(found.overlap.column) + ", row " +
                             std::to_string(found.overlap.row);
    if (overlap > options.max_overlap) {
      throw Error(ErrorCode::input, text + ", which is more than " + percent(options.max_overlap) +
                                        ": a UV there does not identify a single point. Use "
                                        "another match, such as ray, or add " +
                                        option("match.uv.max_overlap") +
                                        " to use "
                                        "the triangle with the lowest index.");
    }
    warn("uv-source-overlap", text + ": the triangle with the lowest index was used there.",
         found.overlapping);
  }
  const double p95_distance_share = found.p95_distance / frame_.diagonal;
  if (p95_distance_share > options.warn_distance || p95_distance_share > options.max_distance) {
    const std::string text = "The two layouts may not agree: at the same UV the surfaces are " +
                             percent(found.mean_distance / frame_.diagonal) +
                             " of the diagonal apart on average, and "
                             "on 5% of the samples " +
                             percent(p95_distance_share) + " or more";
    if (p95_distance_share > options.max_distance) {
      throw Error(ErrorCode::input, text + ", which is more than " + percent(options.max_distance) +
                                        ": the UV layouts do not correspond. Unwrap both "
                                        "meshes together, or use another match, such as ray. To "
                                        "bake anyway, add " +
                                        option("match.uv.max_distance") + ".");
    }
    warn("uv-disagreement", text + ".", 1);
  }
  if (found.outside != 0) {
    warn("uv-source-outside",
         triangles(found.outside) + (found.outside == 1 ? " reaches" : " reach") +
             " out of the unit square of UV space: the parts outside were ignored.",
         found.outside);
  }
  if (found.without_area != 0) {
    warn("uv-source-degenerate",
         triangles(found.without_area) + (found.without_area == 1 ? " has" : " have") +
             " no area in UV space or a corner that is not finite: ignored.",
         found.without_area);
  }
}

void check_uv(const UvOptions& options) {
  const auto check = [](const char* name, double value) {
    if (value >= 0) return;  // The comparison is false for NaN, too
    throw Error(ErrorCode::usage,
                std::string("uv.") + name + " is " + decimal(value) +
                    ": it must be a share of 0 or more, or infinity for no bound.");
  };
  check("warn_overlap", options.warn_overlap);
  check("max_overlap", options.max_overlap);
  check("warn_distance", options.warn_distance);
  check("max_distance", options.max_distance);
}

namespace {

class UvMatcher : public Matcher {
 public:
  explicit UvMatcher(const MatchRequest& request)
      : source_(request.source),
        surface_(request.surface),
        raster_(request.source, request.width, request.height, request.samples),
        options_(request.uv) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    // Bands without samples are counted, too, since the high poly may overlap there.
    raster_.match(band, match, true);
    if (band.sample_count == 0) return;
    if (band.small_triangles != nullptr) match_small_triangles(band, match);
    raster_.distance(band, match);
    raster_.measure(match);
  }

  bool reads_sample_positions() const override { return true; }
  bool keeps_surface_points() const override { return true; }
  void move(std::uint32_t first, std::span<const Vec3> positions) override {
    raster_.set_positions(first, positions);
  }
  void measure(const TexelBand& band, DeviceCorrespondence& match) override {
    raster_.distance(band, match);
  }

  void finish(MatchNotes& notes) override { raster_.report(options_, notes); }

 private:
  /// Matches the samples of small charts, whose UVs differ from those of their texels.
  void match_small_triangles(const TexelBand& band, DeviceCorrespondence& match) const {
    cl::Context& context = context_of(source_.device);
    const std::size_t count = band.sample_count;
    std::vector<std::uint32_t> low(count), triangle(count), samples;
    std::vector<float> u(count), v(count);
    std::vector<std::uint8_t> sample_status(count);
    band.triangle.read(context, low);
    band.barycentric.read(context, u);
    band.barycentric.read(context, v, band.capacity);
    std::vector<Vec2> uvs;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (!std::binary_search(band.small_triangles->begin(), band.small_triangles->end(), low[i])) {
        continue;
      }
      const auto& [a, b, c] = surface_.triangles[low[i]];
      const double weight_1 = u[i], weight_2 = v[i], weight_0 = 1 - weight_1 - weight_2;
      uvs.push_back(
          {static_cast<float>(a.uv.x * weight_0 + b.uv.x * weight_1 + c.uv.x * weight_2),
           static_cast<float>(a.uv.y * weight_0 + b.uv.y * weight_1 + c.uv.y * weight_2)});
      samples.push_back(i);
    }
    if (samples.empty()) return;
    const UvPoints points = find_uv_points(source_, uvs);
    match.triangle.read(context, triangle);
    match.barycentric.read(context, u);
    match.barycentric.read(context, v, match.capacity);
    match.status.read(context, sample_status);
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const std::uint32_t i = samples[k];
      triangle[i] = points.triangle[k];
      u[i] = points.barycentric[k];
      v[i] = points.barycentric[k + samples.size()];
      sample_status[i] = triangle[i] == KILN_NO_TRIANGLE ? KILN_STATUS_MISS : KILN_STATUS_UV;
    }
    match.triangle.write(context, std::span<const std::uint32_t>(triangle));
    match.barycentric.write(context, std::span<const float>(u));
    match.barycentric.write(context, std::span<const float>(v), match.capacity);
    match.status.write(context, std::span<const std::uint8_t>(sample_status));
  }

  const Source::Impl& source_;
  const LowSurface& surface_;
  UvRaster raster_;
  UvOptions options_;
};

}  // namespace

MatchRow uv_match() {
  MatchRow row;
  row.info.method = MatchMethod::uv;
  row.info.searches = "the point at the same UV, without a search";
  row.info.options = "match.uv";
  row.find_at_uvs = find_uv_points;
  row.make = [](const MatchRequest& request, MatchNotes&) -> std::unique_ptr<Matcher> {
    return std::make_unique<UvMatcher>(request);
  };
  return row;
}

}  // namespace kiln
