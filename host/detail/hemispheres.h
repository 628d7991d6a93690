// Casts rays over the hemispheres at points of the high poly, once per band, for all maps that need
// them.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "accel/ray.h"
#include "cl/context.h"
#include "detail/ao_denoiser.h"
#include "detail/hemisphere_views.h"
#include "detail/registry.h"
#include "mesh/kernels_shared.h"
#include "shared/hemisphere.h"

namespace kiln {

/// Computes sums over the rays of each sample (kernels/detail/hemisphere.cl). A sum depends only on
/// the sample's point, its normal and its position in the map.
///
/// With MissPolicy::keep, the rays of a sample that missed start at the low poly's point, around
/// the low poly's normal; with other policies the value of such a sample is undefined. In a second
/// correspondence, which is blended with the first, only samples that have a triangle have defined
/// values.
class Hemispheres : public SharedWork {
 public:
  explicit Hemispheres(const MapRequest& request);

  void next_band() override;
  void next_source() override;
  /// Must be called before the first band if bent_sum() is to be called.
  void request_bent_sum() { needs_bent_sum_ = true; }

  /// [samples] the share of each sample's rays that hit nothing.
  /// \param second  true if `match` is the second correspondence of a blend
  std::vector<float> visibility(const TexelBand& band, const DeviceCorrespondence& match,
                                bool second);

  /// Sum of the directions of each sample's rays that hit nothing: x, y and z in three planes of
  /// plane_of(band) values each.
  const cl::Array<float>& bent_sum(const TexelBand& band, const DeviceCorrespondence& match,
                                   bool second);

  /// [samples] mean length of the inward rays up to their first hit, as a share of the distance
  /// that counts as fully thick.
  std::vector<float> thickness(const TexelBand& band, const DeviceCorrespondence& match,
                               bool second);

  /// [samples] share of the light's disc (ShadowLight) that is visible; 0 where the surface faces
  /// away from the disc's centre.
  std::vector<float> shadow(const TexelBand& band, const DeviceCorrespondence& match, bool second);

  /// Reports the method, the number of rays and the number of views that visibility() and
  /// bent_sum() used.
  OcclusionReport report() const;

  static std::uint32_t plane_of(const TexelBand& band);
  const cl::Array<kiln_low_shading>& shading() const { return shading_; }

 private:
  struct Sums {
    bool has_open_counts = false, has_depth = false;
    cl::Array<std::uint32_t> open;
    // Sums from depth views: KILN_HEMISPHERE_VIEW_SUMS planes, with one value per sample of the
    // band
    std::vector<float> view_sums;
    cl::Array<float> bent_sum, depth;
  };

  /// Rays around an axis: the normal, its opposite, or the direction to the light.
  struct RaySet {
    std::uint32_t count = 0;  // Number of rays per sample
    float side = 1;  // 1 for rays around the axis, -1 for rays around the opposite direction
    // True if the axis is the direction to the light; otherwise it is the normal
    bool toward_light = false;
    bool falls_off = false;  // True if ray lengths follow OcclusionOptions::falloff
    cl::Array<float> directions;
    cl::Array<std::uint32_t> rings;
  };

  /// Computes visibility() with an error of at most OcclusionOptions::max_error.
  std::vector<float> visibility_within_error(const TexelBand& band,
                                             const DeviceCorrespondence& match, bool second);
  /// The samples that have rays, grouped by texel.
  struct TexelSamples {
    std::vector<std::uint32_t> samples;
    std::vector<std::uint32_t> first;  // [texels + 1] index of each texel's first sample
    bool has_one_sample_a_texel() const { return samples.size() + 1 == first.size(); }
  };
  /// Two independent estimates of each texel, each from the same number of rays. An estimate is the
  /// number of rays that hit nothing, summed over the texel's samples.
  struct Estimates {
    const TexelBand& band;
    const DeviceCorrespondence& match;
    bool second = false;
    TexelSamples shared;
    // `rays` is the number of rays per sample and estimate
    std::vector<std::uint32_t> a, b, rays;
    std::vector<std::uint8_t> has_converged;
    std::vector<std::uint32_t> cast_round;   // Round in which rays of the texel were last cast
    std::uint32_t round = 0, next_seed = 0;  // Current round; seed of the next rotations
  };
  /// Casts `rays` more rays for each sample of the given texels, and adds their counts to the
  /// estimates in `open`: estimate a, or both a and b, which get different rays.
  void estimate(Estimates& of, const std::vector<std::uint32_t>& texels, std::uint32_t rays,
                std::span<std::vector<std::uint32_t>* const> open);
  AoDenoiser::Result denoise_estimates(const Estimates& of, double plain_variance);
  void cast_unsure(const Estimates& of, AoDenoiser::Result& result);
  bool cast_more_rays(Estimates& of, const AoDenoiser::Result& last,
                      const std::vector<float>& previous_errors);
  TexelSamples prepare_filter(const TexelBand& band, const DeviceCorrespondence& match,
                              bool second);
  /// Copies some samples, their matches and the random rotations of their rays to the arrays
  /// picked_*.
  /// \param round  seed of the rotations, so that each round casts other rays (make_keys()); null:
  ///   the rotations of make_rotations()
  void pick(const TexelBand& band, const DeviceCorrespondence& match,
            std::span<const std::uint32_t> samples, std::optional<std::uint32_t> round);
  /// Computes the random rotations of the picked samples for a round, from the result of
  /// make_keys().
  void rotate_picked(std::uint32_t count, std::uint32_t round,
                     cl::Array<std::uint32_t>& sample_rotations);
  /// What rays are cast against.
  struct Occluders {
    const RayCaster* whole =
        nullptr;  // One BVH of all occluders; null if the high poly is larger than memory
    const RaySearch* high = nullptr;    // Otherwise, the high poly, or null if it does not occlude
    const RayCaster* others = nullptr;  // Otherwise, the other occluders, or null if there are none
    /// Calls `use` with one BVH after the other, which together hold all occluders.
    void for_each_part(const std::function<void(const RayCaster&)>& use) const;
    /// True if kernels generate and cast the rays in one step.
    bool are_cast_in_one_step() const {
      return whole != nullptr && whole->traversal() == Traversal::cpu;
    }
  };
  /// Samples whose rays are cast against the same occluders.
  struct OccluderGroup {
    Occluders occluders;
    std::vector<std::uint32_t> samples;
  };
  /// Groups samples by their part (OcclusionOptions::own_part); without that option, all are in one
  /// group. Samples without rays are left out.
  std::vector<OccluderGroup> group_samples(const TexelBand& band, const DeviceCorrespondence& match,
                                           bool second, std::span<const std::uint32_t> samples);
  const RayCaster& occluders_of(std::uint32_t part);
  /// Results of casting rays: for each sample, the number of rays that hit nothing, and optionally
  /// the sum of their directions.
  struct RayCounts {
    // By sample of the band
    std::vector<std::uint32_t> open;
    // Sums of directions in three planes of plane_of(band) values; may be empty
    std::vector<float> bent_sum;
  };
  /// Casts the rays of a group's samples.
  /// \param rounds  each round casts different rays and counts them separately; empty: one round
  ///   with the rotations of make_rotations()
  void cast_group(const OccluderGroup& group, const TexelBand& band,
                  const DeviceCorrespondence& match, bool second, const RaySet& set,
                  std::span<const std::uint32_t> rounds, std::span<RayCounts> ray_counts);
  /// Casts the rays of all samples of a band, each against the occluders of its own part.
  RayCounts cast_parts(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                       const RaySet& set, bool bent_sum);
  /// In each round, casts `rays` more rays for each of the given samples.
  /// \param rounds  seeds of the rounds; each casts different rays
  /// \returns for each round, the number of rays that hit nothing, by sample of the band
  std::vector<RayCounts> cast_rounds(const TexelBand& band, const DeviceCorrespondence& match,
                                     bool second, std::span<const std::uint32_t> samples,
                                     std::uint32_t rays, std::span<const std::uint32_t> rounds);
  const RaySet& outward_rays(std::uint32_t count);
  void upload_rays(RaySet& set, std::uint32_t count, double radius);
  void upload();
  /// The occluders of outward rays: the high poly alone, or together with the low poly and other
  /// meshes.
  Occluders occluders();
  struct OccluderCaster {
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
  };
  OccluderCaster caster_of_all_occluders() const;
  /// Computes visibility() and bent_sum() from depth views.
  std::vector<float> visibility_by_views(const TexelBand& band, const DeviceCorrespondence& match,
                                         bool second);
  void gather_views(const TexelBand& band, const DeviceCorrespondence& match, bool second);
  std::vector<float> compute_shares(const TexelBand& band, const cl::Array<std::uint32_t>& counts,
                                    std::uint32_t rays) const;
  void make_rotations(const TexelBand& band);
  /// Computes keys of rotations for rays whose results are smoothed: unlike those of
  /// make_rotations(), the rotations of neighbouring texels complement each other.
  void make_keys(const TexelBand& band);
  void compute_rotations(const TexelBand& band, const std::string& kernel,
                         cl::Array<std::uint32_t>& to);
  void cast(const TexelBand& band, const DeviceCorrespondence& match, bool second);
  void measure_thickness(const TexelBand& band, const DeviceCorrespondence& match, bool second);
  /// Generates rays piece by piece, and calls `launch` for each piece. If `groups_by_sample` is set
  /// and there are few samples with many rays each, the rays of one sample are adjacent in memory
  /// (casts_by_sample()).
  using RayPieceLauncher =
      std::function<void(const kiln_hemisphere_params& params, std::uint32_t count)>;
  void for_each_ray_piece(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                          const RaySet& set, const cl::Array<std::uint32_t>& sample_rotations,
                          bool groups_by_sample, const RayPieceLauncher& launch);
  /// Computes the points of the band's samples piece by piece, stores them in points_, and calls
  /// `launch` for each piece.
  using PieceLauncher = std::function<void(kiln_hemisphere_params params)>;
  void for_each_piece(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                      const RaySet& set, std::uint32_t batch_size, const PieceLauncher& launch);
  static bool casts_by_sample(const TexelBand& band, const RaySet& set);
  /// Device arrays for one set of rotations: the rotation of each sample's rays, and the number of
  /// its rays that hit nothing.
  struct RotationsAndCounts {
    const cl::Array<std::uint32_t>*sample_rotations, *open;
  };
  /// Counts the outward rays that hit nothing, and sums their directions.
  /// \param bent_sum  empty: directions are not summed
  void count_open(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                  const RaySet& set, std::span<const RotationsAndCounts> rotations,
                  const Occluders& occluders, const cl::Array<float>& bent_sum);
  /// Casts the rays of each set of rotations, and calls `use` for each piece of rays when ray_hits_ tells which of them
  /// have a hit. Occluders that are not in memory together are passed once for all rays.
  using HitUser = std::function<void(const RotationsAndCounts& rotations,
                                     const kiln_hemisphere_params& params)>;
  void for_each_hit_piece(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                          const RaySet& set, std::span<const RotationsAndCounts> rotations,
                          bool groups_by_sample, const Occluders& occluders, const RayQuery& query,
                          const HitUser& use);
  kiln_hemisphere_params ray_params(const TexelBand& band, const DeviceCorrespondence& match,
                                    bool second, const RaySet& set) const;
  /// Computes the points of samples `params.first` to `params.first + params.count - 1`.
  void make_points(const kiln_hemisphere_params& params, const TexelBand& band,
                   const DeviceCorrespondence& match, const cl::Array<float>& points);
  void cast_piece(kiln_hemisphere_params params, const RaySet& set,
                  std::span<const RotationsAndCounts> rotations, const RayCaster& caster,
                  const RayQuery& query, const cl::Array<float>& points,
                  const cl::Array<float>& bent_sum);
  /// Adds the lengths of the inward rays of each sample. Used with Traversal::cpu.
  void measure_piece(kiln_hemisphere_params params, const RayCaster& caster, const RayQuery& query,
                     const cl::Array<float>& depth);
  /// Casts the rays of the picked samples from the points in texel_points_. Used with
  /// Traversal::cpu.
  void cast_texels(std::uint32_t count, const RaySet& set,
                   std::span<const RotationsAndCounts> rotations);
  /// Casts rays for all texels that prepare_filter() found; all rays of a texel start at one
  /// sample.
  void cast_all(std::uint32_t rays, std::span<std::vector<std::uint32_t>* const> open,
                Estimates& of);
  /// Does the work of count_open() piece by piece, with one kernel for all steps (cast_piece()).
  /// Used with Traversal::cpu.
  void cast_blocks(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                   const RaySet& set, std::span<const RotationsAndCounts> rotations,
                   const RayCaster& caster, const RayQuery& query,
                   const cl::Array<float>& bent_sum);
  /// Does the same as cast_blocks() for few samples with many rays each (casts_by_sample()).
  void cast_by_sample(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                      const RaySet& set, std::span<const RotationsAndCounts> rotations,
                      const RayCaster& caster, const RayQuery& query);
  /// Adds the rays that hit nothing, according to ray_hits_, to the counts in `open`.
  void add_misses(const kiln_hemisphere_params& params, const cl::Array<std::uint32_t>& open);

  cl::Context& context_;
  const Source::Impl& source_;
  const LowSurface& surface_;
  std::shared_ptr<BandReads> reads_;
  std::uint32_t width_, height_, sample_slot_bits_;
  bool keeps_misses_, two_sided_, back_faces_, by_high_, by_low_;
  // Parts, if only triangles of a sample's own part occlude it; otherwise null
  const Parts* parts_;
  float unbounded_reach_, occlusion_reach_,
      thickness_reach_;  // Largest ray lengths, in frame units
  OcclusionFalloff falloff_ = OcclusionFalloff::none;
  // Length of the longest ray with a falloff, as a multiple of occlusion_reach_
  double length_share_ = 1;
  bool needs_bent_sum_ = false;
  std::uint32_t view_directions_ = 0;  // Number of depth views; 0 if visibility is computed by rays

  cl::Array<kiln_low_shading> shading_;
  RaySet rays_out_, rays_in_, rays_to_light_;
  // Sets of outward rays, by the number of rays per sample
  std::map<std::uint32_t, RaySet> ray_sets_;
  double max_error_;
  Vec3 light_direction_;
  cl::Array<float> rotation_table_;

  // Other meshes that occlude: their positions, in frame units, and triangles
  std::vector<Mesh> other_occluders_;
  // All occluders, or, if the high poly is larger than memory, the others; unset if the high poly is the only one
  std::optional<RayCaster> all_occluders_;
  std::map<std::uint32_t, RayCaster> part_occluders_;
  std::optional<HemisphereViews> views_;
  bool is_uploaded_ = false, has_rotations_ = false, has_keys_ = false;
  cl::Array<float> positions_;
  cl::Array<std::uint32_t> triangles_;
  cl::Array<std::uint32_t> rotations_, keys_;
  std::array<Sums, 2> sums_;

  std::uint32_t ray_capacity_ = 0;
  cl::Array<float> points_, texel_points_, rays_, scratch_, distances_;
  cl::Array<std::uint32_t> lit_counts_;
  TexelBand picked_samples_;  // The samples that pick() has gathered
  DeviceCorrespondence picked_match_;
  cl::Array<std::uint32_t> picked_indices_, picked_rotations_, second_rotations_, picked_open_,
      second_open_;
  cl::Array<float> picked_bent_sum_;
  std::optional<AoDenoiser> denoiser_;
  cl::Array<std::uint8_t> ray_hits_;
  DeviceCorrespondence first_hits_;
};

}  // namespace kiln
