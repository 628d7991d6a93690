#include "detail/point_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "detail/uv_facet.h"
#include "image/gutter.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

constexpr std::size_t kMaxChannels = 4;
// Index of the element that holds the weight, in values that have one
constexpr std::size_t kWeightChannel = 3;
using Value = std::array<float, kMaxChannels>;

/// Host copy of a correspondence.
struct HostCorrespondence {
  HostCorrespondence(BandReads& reads, const DeviceCorrespondence& match, std::uint32_t count)
      : triangle(reads.read(match.triangle, count)),
        u(reads.read(match.barycentric, count)),
        v(reads.read(match.barycentric, count, match.capacity)) {
    if (!match.distance.empty()) distance = reads.read(match.distance, count);
    if (!match.status.empty()) status = reads.read(match.status, count);
    if (match.seen.empty()) return;
    for (std::size_t c = 0; c < 3; ++c)
      visibility[c] = reads.read(match.seen, count, c * match.capacity);
  }
  std::span<const std::uint32_t> triangle;
  // Empty if the match has none: all values are then 0
  std::span<const float> u, v, distance;
  std::span<const std::uint8_t> status;              // empty: all 0
  std::array<std::span<const float>, 3> visibility;  // empty: all 0
};

/// Host copy of a band's samples.
struct HostSamples {
  HostSamples(BandReads& reads, const TexelBand& band)
      : index(reads.read(band.texel_index, band.texel_count)),
        first(reads.read(band.texel_first, band.texel_count + std::size_t{1})),
        triangle(reads.read(band.triangle, band.sample_count)),
        u(reads.read(band.barycentric, band.sample_count)),
        v(reads.read(band.barycentric, band.sample_count, band.capacity)) {}
  std::span<const std::uint32_t> index, first, triangle;
  std::span<const float> u, v;
};

Vec3d normalize_or(const Vec3d& v, const Vec3d& fallback) {
  const double size = length(v);
  return size > 0 ? v * (1 / size) : fallback;
}

/// For each triangle of the low poly, two edges of a sample's square footprint on the surface, in
/// frame units: rightwards and downwards in the map.
std::vector<std::array<Vec3d, 2>> sides_of_samples(const MapRequest& request) {
  const double sample_width =
      1.0 / request.options.width / request.options.samples / request.footprint_divisor;
  const double down =
      -1.0 / request.options.height / request.options.samples / request.footprint_divisor;
  const LowSurface& surface = request.surface;
  std::vector<std::array<Vec3d, 2>> sides(surface.triangles.size());
  for (std::size_t t = 0; t < sides.size(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    const Vec3d p = to_double(b.position) - to_double(a.position);
    const Vec3d q = to_double(c.position) - to_double(a.position);
    const double pu = double{b.uv.x} - a.uv.x, pv = double{b.uv.y} - a.uv.y;
    const double qu = double{c.uv.x} - a.uv.x, qv = double{c.uv.y} - a.uv.y;
    const double area = pu * qv - qu * pv;
    if (surface.usable[t] == 0 || !(std::abs(area) > 0)) continue;
    sides[t] = {(p * qv - q * pv) * (sample_width / area), (q * pu - p * qu) * (down / area)};
  }
  return sides;
}

class PointMap : public MapMaker {
 public:
  PointMap(const MapRequest& request, const MapInfo& info, std::unique_ptr<PointFunction> function)
      : source_(request.source),
        surface_(request.surface),
        info_(info),
        miss_(request.options.encoding.miss),
        two_sided_(request.options.match.two_sided),
        reads_(request.reads()),
        function_(std::move(function)),
        needs_(function_->needs()) {
    if (needs_.uv) sides_ = sides_of_samples(request);
  }

  void report(BakedMap& map, std::vector<Warning>& warnings) const override {
    function_->report(map, warnings);
  }

  void run(const TexelBand& band, const DeviceCorrespondence& match,
           const BandPixels& out) override {
    make(band, match, nullptr, nullptr, out);
  }

  void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                   const DeviceCorrespondence& other, const cl::Array<float>& shares,
                   const BandPixels& out) override {
    make(band, match, &other, &shares, out);
  }

 private:
  void make(const TexelBand& band, const DeviceCorrespondence& match,
            const DeviceCorrespondence* other, const cl::Array<float>* shares,
            const BandPixels& out) {
    if (band.sample_count == 0) return;
    function_->prepare(reads_->source_version());
    normals_ = reads_->read_source(source_.attributes.normals);
    normal_indices_ = reads_->read_source(source_.attributes.normal_indices);
    const HostSamples samples(*reads_, band);
    const HostCorrespondence correspondence(*reads_, match, band.sample_count);
    std::optional<HostCorrespondence> other_match;
    std::span<const float> share;
    if (other != nullptr && info_.type != MapType::id) {
      other_match.emplace(*reads_, *other, band.sample_count);
      share = reads_->read(*shares, band.sample_count);
    }
    ScratchPool scratches(*function_);
    parallel_for(band.texel_count, 1 << 12, [&](std::size_t begin, std::size_t end) {
      // If a texel has one sample, the function writes its value directly to the map. Copying it
      // from a temporary array would use vector loads of values that were just stored one by one,
      // which stalls the processor.
      const bool has_weights = function_->has_weights();
      const bool copies_values = !other_match && !has_weights && info_.type != MapType::unit_vector;
      Average average(info_, has_weights);
      UvFacet facet;
      HighPoint point;
      std::unique_ptr<PointScratch> scratch = scratches.take();
      point.scratch = scratch.get();
      for (std::size_t t = begin; t < end; ++t) {
        std::uint8_t& coverage = out.coverage[samples.index[t]];
        float* const to = &out.values[std::size_t{samples.index[t]} * info_.channels];
        coverage = kCoverageMissed;
        const std::uint32_t first = samples.first[t], last = samples.first[t + 1];
        if (copies_values && first + 1 == last &&
            correspondence.triangle[first] != KILN_NO_TRIANGLE) {
          coverage = kCoverageBaked;
          value_at(samples, first, correspondence, correspondence, facet, point, to);
          // Adding 0 converts -0 to 0, as adding up several samples does
          for (std::uint32_t c = 0; c < info_.channels; ++c) to[c] += 0.0F;
          continue;
        }
        average.clear();
        for (std::uint32_t s = first; s < last; ++s) {
          if (correspondence.triangle[s] != KILN_NO_TRIANGLE) {
            coverage = kCoverageBaked;
          } else if (leaves_out_misses(info_, miss_)) {
            continue;
          }
          Value value{};
          value_at(samples, s, correspondence, correspondence, facet, point, value.data());
          if (other_match && other_match->triangle[s] != KILN_NO_TRIANGLE) {
            Value other_value{};
            value_at(samples, s, *other_match, correspondence, facet, point, other_value.data());
            float first_weight = share[s], second_weight = 1 - share[s];
            if (has_weights) {
              first_weight *= value[kWeightChannel], second_weight *= other_value[kWeightChannel];
              value[kWeightChannel] = first_weight + second_weight;
              first_weight /= value[kWeightChannel], second_weight /= value[kWeightChannel];
            }
            for (std::uint32_t c = 0; c < info_.channels; ++c) {
              value[c] = value[c] * first_weight + other_value[c] * second_weight;
            }
          }
          average.add(value);
        }
        average.store(to);
      }
      scratches.put_back(std::move(scratch));
    });
  }

  /// Scratch memory for a band's blocks. A block reuses the memory of a finished block, including
  /// the values cached there, so about one memory per thread is needed.
  class ScratchPool {
   public:
    explicit ScratchPool(const PointFunction& function) : function_(function) {}

    std::unique_ptr<PointScratch> take() {
      {
        const std::lock_guard lock(mutex_);
        if (!free_.empty()) {
          std::unique_ptr<PointScratch> scratch = std::move(free_.back());
          free_.pop_back();
          return scratch;
        }
      }
      return function_.scratch();
    }
    void put_back(std::unique_ptr<PointScratch> scratch) {
      const std::lock_guard lock(mutex_);
      free_.push_back(std::move(scratch));
    }

   private:
    const PointFunction& function_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<PointScratch>> free_;
  };

  /// Average of a texel's samples.
  class Average {
   public:
    Average(const MapInfo& info, bool has_weights)
        : channels_(info.channels),
          has_weights_(has_weights),
          is_id_(info.type == MapType::id),
          is_direction_(info.type == MapType::unit_vector) {}

    void clear() {
      count_ = 0;
      weight_ = 0;
      sum_ = {};
      votes_.clear();
    }

    void add(const Value& value) {
      // Most texels have a single sample, for which nothing needs to be summed.
      if (++count_ == 1) {
        first_ = value;
        return;
      }
      if (count_ == 2) gather(first_);
      gather(value);
    }

    /// Stores the average. If all samples of the texel missed, and MissPolicy gives misses no
    /// value, it is 0.
    void store(float* to) {
      if (is_direction_ && count_ != 0) return store_direction(to);
      Value value{};
      if (count_ == 1) {
        // Adding 0 converts -0 to 0, as adding up several samples does.
        for (std::uint32_t c = 0; c < channels_; ++c) value[c] = first_[c] + 0.0F;
      } else if (is_id_ && count_ != 0) {
        value = std::max_element(votes_.begin(), votes_.end(), [](const auto& a, const auto& b) {
                  return a.second < b.second;
                })->first;
      } else if (count_ != 0) {
        const double divisor = has_weights_ ? weight_ : count_;
        for (std::uint32_t c = 0; c < channels_; ++c) {
          value[c] = static_cast<float>(sum_[c] / divisor);
        }
      }
      for (std::uint32_t c = 0; c < channels_; ++c) to[c] = value[c];
    }

   private:
    void gather(const Value& value) {
      if (has_weights_) {
        const double weight = value[kWeightChannel];
        for (std::uint32_t c = 0; c < channels_; ++c) sum_[c] += weight * value[c];
        weight_ += weight;
        return;
      }
      if (!is_id_) {
        for (std::uint32_t c = 0; c < channels_; ++c) sum_[c] += value[c];
        return;
      }
      const auto same = std::find_if(votes_.begin(), votes_.end(),
                                     [&](const auto& vote) { return vote.first == value; });
      if (same == votes_.end()) {
        votes_.emplace_back(value, 1U);
      } else {
        ++same->second;
      }
    }

    /// Stores the mean direction, or (0, 0, 1) if the directions cancel out.
    void store_direction(float* to) {
      if (count_ == 1) gather(first_);
      const Vec3d mean = normalize_or(Vec3d(sum_[0], sum_[1], sum_[2]), Vec3d(0, 0, 1));
      to[0] = static_cast<float>(mean.x);
      to[1] = static_cast<float>(mean.y);
      to[2] = static_cast<float>(mean.z);
    }

    std::uint32_t channels_;
    bool has_weights_, is_id_, is_direction_;
    std::uint32_t count_ = 0;
    double weight_ = 0;
    Value first_{};
    std::array<double, kMaxChannels> sum_{};
    std::vector<std::pair<Value, std::uint32_t>> votes_;
  };

  /// Computes the function's value for sample s.
  /// \param first  the first correspondence, if two are blended; it holds the visibility directions
  /// \param facet  reused from the previous sample
  /// \param point  reused from the previous sample; members that the function does not need keep
  ///   their defaults
  /// \param value  as many numbers as the map has channels
  void value_at(const HostSamples& samples, std::size_t s, const HostCorrespondence& match,
                const HostCorrespondence& first, UvFacet& facet, HighPoint& point,
                float* value) const {
    if (!first.visibility[0].empty())
      point.seen = {first.visibility[0][s], first.visibility[1][s], first.visibility[2][s]};
    point.triangle = match.triangle[s];
    point.found = point.triangle != KILN_NO_TRIANGLE;
    if (!match.status.empty()) point.status = match.status[s];
    point.low_triangle = samples.triangle[s];
    point.low_u = samples.u[s];
    point.low_v = samples.v[s];
    point.u = point.v = 0;
    point.distance = 0;
    point.has_uv = false;
    if (point.found) {
      point.u = match.u[s];
      point.v = match.v[s];
      if (needs_.distance && !match.distance.empty()) {
        point.distance = match.distance[s] / source_.frame.scale;
      }
    }
    if (needs_.position) set_position(point);
    if (needs_.normal || needs_.uv) set_normal_and_uv(point, facet);
    // A loop with a constant number of iterations avoids a call of memset()
    for (std::uint32_t c = 0; c < kMaxChannels; ++c) {
      if (c < info_.channels) value[c] = 0;
    }
    (*function_)(point, value);
  }

  static Vec3d low_point(const HighPoint& point, const Vec3& a, const Vec3& b, const Vec3& c) {
    const double u = point.low_u, v = point.low_v;
    return to_double(a) * (1 - u - v) + to_double(b) * u + to_double(c) * v;
  }

  void set_position(HighPoint& point) const {
    const auto& low_corners = surface_.triangles[point.low_triangle];
    const auto low_position = [&] {
      return low_point(point, low_corners[0].position, low_corners[1].position,
                       low_corners[2].position);
    };
    if (!point.found) {
      point.position = to_world(low_position());
      point.offset = {};
      return;
    }
    const Triangle& corners = source_.triangles[point.triangle];
    const double weights[3] = {1.0 - point.u - point.v, point.u, point.v};
    Vec3d position{};
    for (std::size_t k = 0; k < 3; ++k) {
      position = position + to_double(source_.positions[corners[k]]) * weights[k];
    }
    point.position = to_world(position);
    if (!needs_.offset) return;
    // Subtracts before converting to world units: far from the origin, world coordinates have fewer
    // digits.
    point.offset = (position - low_position()) * (1 / source_.frame.scale);
  }

  /// Sets the point's normal and UVs, if the function needs them.
  void set_normal_and_uv(HighPoint& point, UvFacet& facet) const {
    const auto& [a, b, c] = surface_.triangles[point.low_triangle];
    const Vec3d low_normal =
        normalize_or(low_point(point, a.normal, b.normal, c.normal), to_double(a.normal));
    if (!point.found) {
      point.normal = low_normal;
      return;
    }
    if (needs_.uv) project_sides(point, low_normal, facet);
    if (!needs_.normal) return;
    const std::uint32_t* index = &normal_indices_[std::size_t{3} * point.triangle];
    const double weights[3] = {1.0 - point.u - point.v, point.u, point.v};
    Vec3d normal{};
    for (std::size_t k = 0; k < 3; ++k) {
      const float* n = &normals_[std::size_t{3} * index[k]];
      normal = normal + to_double(Vec3{n[0], n[1], n[2]}) * weights[k];
    }
    point.normal = normalize_or(normal, low_normal);
    if (two_sided_ && dot(point.normal, low_normal) < 0) point.normal = point.normal * -1.0;
  }

  void project_sides(HighPoint& point, const Vec3d& along, UvFacet& facet) const {
    facet.move_to(source_, point.triangle);
    point.has_uv = facet.has_uv;
    if (!facet.has_uv && !needs_.weight_sides) return;
    const Vec3d face_normal = dot(facet.normal, facet.normal) > 0 ? facet.normal : along;
    // Limits the size of the footprint on triangles at a grazing angle.
    constexpr double kMinCosine = 0.2;
    double cosine = dot(face_normal, along);
    if (std::abs(cosine) < kMinCosine) cosine = std::copysign(kMinCosine, cosine);
    const double scale = 1 / cosine;
    for (std::size_t k = 0; k < 2; ++k) {
      point.uv[k] = facet.at[k] + facet.to_b[k] * point.u + facet.to_c[k] * point.v;
      const Vec3d& side = sides_[point.low_triangle][k];
      const Vec3d projected_side = side - along * (dot(face_normal, side) * scale);
      point.uv_sides[k] = {dot(facet.gradient[0], projected_side),
                           dot(facet.gradient[1], projected_side)};
      if (!needs_.weight_sides) continue;
      point.weight_sides[k] = {dot(facet.weight_gradient[0], projected_side),
                               dot(facet.weight_gradient[1], projected_side)};
    }
  }

  Vec3d to_world(const Vec3d& at) const {
    const Frame& frame = source_.frame;
    return at * (1 / frame.scale) + Vec3d{frame.center[0], frame.center[1], frame.center[2]};
  }

  const Source::Impl& source_;
  const LowSurface& surface_;
  MapInfo info_;
  MissPolicy miss_;
  bool two_sided_;
  std::shared_ptr<BandReads> reads_;
  std::unique_ptr<PointFunction> function_;
  PointNeeds needs_;
  std::vector<std::array<Vec3d, 2>>
      // For each triangle of the low poly, the sides of a sample's footprint; empty if not needed
      sides_;
  std::span<const float> normals_;  // The high poly's normals, downloaded for the last band
  std::span<const std::uint32_t> normal_indices_;
};

}  // namespace

std::unique_ptr<MapMaker> make_point_map(const MapRequest& request, const MapInfo& info,
                                         std::unique_ptr<PointFunction> function) {
  return std::make_unique<PointMap>(request, info, std::move(function));
}

}  // namespace kiln
