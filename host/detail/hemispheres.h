// Rays over the hemispheres at the high poly's points, cast once a band for all maps.
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

/// Computes sums over each sample's rays (kernels/detail/hemisphere.cl). A sum depends only on the sample's point,
/// its normal and its position in the map.
///
/// With MissPolicy::keep, rays of a missed sample start at the low poly's point, about the low poly's normal;
/// otherwise its value is undefined. In a second correspondence, which is blended with the first one, only samples
/// with a triangle have values.
class Hemispheres : public SharedWork {
 public:
  explicit Hemispheres(const MapRequest& request);

  void next_band() override;
  void next_source() override;
  /// Must be called before the first band if bent_sum() will be used.
  void request_bent_sum() { needs_bent_sum_ = true; }

  /// [samples] the share of a sample's rays that hit nothing. \param second true if `match` is the second
  /// correspondence of a blend
  std::vector<float> visibility(const TexelBand& band, const DeviceCorrespondence& match,
                                bool second);

  /// Sums of the directions of the rays that hit nothing: 3 planes of plane_of(band).
  const cl::Array<float>& bent_sum(const TexelBand& band, const DeviceCorrespondence& match,
                                   bool second);

  /// [samples] mean distance inward to the first surface, as a share of the distance that counts as thick.
  std::vector<float> thickness(const TexelBand& band, const DeviceCorrespondence& match,
                               bool second);

  /// [samples] the visible share of ShadowLight's disc; 0 where the surface faces away from its centre.
  std::vector<float> shadow(const TexelBand& band, const DeviceCorrespondence& match, bool second);

  /// The method and the numbers of rays and views of visibility() and bent_sum().
  OcclusionReport report() const;

  static std::uint32_t plane_of(const TexelBand& band);
  const cl::Array<kiln_low_shading>& shading() const { return shading_; }

 private:
  struct Sums {
    bool has_open = false, has_depth = false;
    cl::Array<std::uint32_t> open;
    // Sums that depth views gathered: KILN_HEMISPHERE_VIEW_SUMS planes of the band's samples
    std::vector<float> view_sums;
    cl::Array<float> bent_sum, depth;
  };

  /// Rays about an axis: the normal, its opposite, or the direction to the light.
  struct RaySet {
    std::uint32_t count = 0;  // Number of rays of a sample
    float side = 1;           // 1 for rays about the axis, -1 for rays about the opposite direction
    // True if the axis is the direction to the light; otherwise it is the normal
    bool toward_light = false;
    bool falls_off = false;  // True if ray lengths follow OcclusionOptions::falloff
    cl::Array<float> directions;
    cl::Array<std::uint32_t> rings;
  };

  /// visibility() with an error of at most OcclusionOptions::max_error.
  std::vector<float> visibility_within(const TexelBand& band, const DeviceCorrespondence& match,
                                       bool second);
  /// Samples that have rays, grouped by texel.
  struct TexelSamples {
    std::vector<std::uint32_t> samples;
    std::vector<std::uint32_t> first;  // [texels + 1] index of each texel's first sample
    bool has_one_sample_a_texel() const { return samples.size() + 1 == first.size(); }
  };
  /// Two independent estimates of each texel from equal numbers of rays: counts of rays that hit nothing, summed
  /// over the texel's samples.
  struct Estimates {
    const TexelBand& band;
    const DeviceCorrespondence& match;
    bool second = false;
    TexelSamples shared;
    // `rays` is the number of rays of one sample in each estimate
    std::vector<std::uint32_t> a, b, rays;
    std::vector<std::uint8_t> has_converged_;
    std::vector<std::uint32_t> cast_round;  // Round in which rays of the texel were last cast
    std::uint32_t round = 0, turn = 0;
  };
  /// Casts `rays` more rays of each sample of the given texels for estimate a, and as many for b if both are
  /// given.
  void estimate(Estimates& of, const std::vector<std::uint32_t>& texels, std::uint32_t rays,
                std::span<std::vector<std::uint32_t>* const> open);
  AoDenoiser::Result denoise_estimates(const Estimates& of, double plain_variance);
  void cast_unsure(const Estimates& of, AoDenoiser::Result& result);
  bool cast_more_rays(Estimates& of, const AoDenoiser::Result& last,
                      const std::vector<float>& previous_errors);
  TexelSamples prepare_filter(const TexelBand& band, const DeviceCorrespondence& match,
                              bool second);
  /// Gathers some samples, their matches and the random rotations of their ray sets into the picked_ arrays.
  /// \param round seeds the rotations, so that each round casts other rays (make_keys()); without it the
  /// rotations are those of make_turns()
  void pick(const TexelBand& band, const DeviceCorrespondence& match,
            std::span<const std::uint32_t> samples, std::optional<std::uint32_t> round);
  /// Computes the random rotations of the picked samples from make_keys().
  void turn_picked(std::uint32_t count, std::uint32_t round, cl::Array<std::uint32_t>& turns);
  /// Samples that have the same occluders.
  struct OccluderGroup {
    const RayCaster* caster;
    std::vector<std::uint32_t> samples;
  };
  /// Groups samples by part (OcclusionOptions::own_part), or returns one group of all samples. Samples
  /// without rays are excluded.
  std::vector<OccluderGroup> groups(const TexelBand& band, const DeviceCorrespondence& match,
                                    bool second, std::span<const std::uint32_t> samples);
  const RayCaster& occluders_of(std::uint32_t part);
  /// Per sample of a group: number of rays that hit nothing, and optionally the sum of their directions.
  struct RayCounts {
    // For each sample of the band, the number of its rays that hit nothing
    std::vector<std::uint32_t> open;
    std::vector<float> bent_sum;  // sums of directions: 3 planes of plane_of(band)
  };
  /// \param rounds each round casts different rays and has counts of its own; the points are computed once. Without
  ///     rounds the rotations are those of make_turns()
  void cast_group(const OccluderGroup& group, const TexelBand& band,
                  const DeviceCorrespondence& match, bool second, const RaySet& set,
                  std::span<const std::uint32_t> rounds, std::span<RayCounts> ray_counts);
  /// Casts rays of all samples of a band, each against its own part.
  RayCounts cast_parts(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                       const RaySet& set, bool bent_sum);
  /// Casts `rays` more rays of each of the given samples. Returns the counts of rays that hit nothing, by round and
  /// by sample of the band.
  /// \param rounds each round casts different rays
  std::vector<RayCounts> cast_rounds(const TexelBand& band, const DeviceCorrespondence& match,
                                     bool second, std::span<const std::uint32_t> samples,
                                     std::uint32_t rays, std::span<const std::uint32_t> rounds);
  const RaySet& outward_rays(std::uint32_t count);
  void upload_rays(RaySet& set, std::uint32_t count, double radius);
  void upload();
  /// Occluders of outward rays: the high poly alone, or together with the low poly and other meshes.
  const RayCaster& occluders();
  struct OccluderCaster {
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
  };
  OccluderCaster caster_of_all_occluders() const;
  /// visibility() and bent_sum() by depth views.
  std::vector<float> visibility_by_views(const TexelBand& band, const DeviceCorrespondence& match,
                                         bool second);
  void gather_views(const TexelBand& band, const DeviceCorrespondence& match, bool second);
  std::vector<float> shares(const TexelBand& band, const cl::Array<std::uint32_t>& counts,
                            std::uint32_t rays) const;
  void make_turns(const TexelBand& band);
  /// Computes rotations like make_turns(), but for rays whose sums are smoothed: rotations of neighbouring
  /// texels complement each other.
  void make_keys(const TexelBand& band);
  void turn(const TexelBand& band, const std::string& kernel, cl::Array<std::uint32_t>& to);
  void cast(const TexelBand& band, const DeviceCorrespondence& match, bool second);
  void measure(const TexelBand& band, const DeviceCorrespondence& match, bool second);
  /// Generates rays piece by piece, and calls `launch` for each piece. If there are few samples of many rays and
  /// `groups_by_sample` is set, a sample's rays are adjacent in memory (by_sample).
  using Use = std::function<void(const kiln_hemisphere_params& params, std::uint32_t count)>;
  void over_rays(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                 const RaySet& set, const cl::Array<std::uint32_t>& turns, bool groups_by_sample,
                 const Use& launch);
  /// Computes the points of the band's samples in points_, piece by piece, and calls `launch` for each piece.
  using OfPiece = std::function<void(kiln_hemisphere_params params)>;
  void over_pieces(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                   const RaySet& set, std::uint32_t batch_size, const OfPiece& launch);
  static bool casts_by_sample(const TexelBand& band, const RaySet& set);
  /// Per sample: the rotation of its rays, and the count of rays that hit nothing.
  struct TurnsAndCounts {
    const cl::Array<std::uint32_t>*turns, *open;
  };
  /// Counts the outward rays that hit nothing, and sums their directions.
  /// \param bent_sum empty: directions are not summed
  void count_open(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                  const RaySet& set, std::span<const TurnsAndCounts> rotations,
                  const RayCaster& caster, const cl::Array<float>& bent_sum);
  kiln_hemisphere_params ray_params(const TexelBand& band, const DeviceCorrespondence& match,
                                    bool second, const RaySet& set) const;
  /// Computes the points of samples [params.first, params.first + params.count).
  void make_points(const kiln_hemisphere_params& params, const TexelBand& band,
                   const DeviceCorrespondence& match, const cl::Array<float>& points);
  void cast_piece(kiln_hemisphere_params params, const RaySet& set,
                  std::span<const TurnsAndCounts> rotations, const RayCaster& caster,
                  const RayQuery& query, const cl::Array<float>& points,
                  const cl::Array<float>& bent_sum);
  /// Adds the lengths of each sample's inward rays. For Traversal::cpu.
  void measure_piece(kiln_hemisphere_params params, const RayCaster& caster, const RayQuery& query,
                     const cl::Array<float>& depth);
  /// Casts rays of the picked samples from texel_points_. For Traversal::cpu.
  void cast_texels(std::uint32_t count, const RaySet& set,
                   std::span<const TurnsAndCounts> rotations);
  /// Casts rays of all texels that prepare_filter() found, each texel's from one sample.
  void cast_all(std::uint32_t rays, std::span<std::vector<std::uint32_t>* const> open,
                Estimates& of);
  /// Does the work of cast_piece() in one kernel. For Traversal::cpu.
  void cast_blocks(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                   const RaySet& set, std::span<const TurnsAndCounts> rotations,
                   const RayCaster& caster, const RayQuery& query,
                   const cl::Array<float>& bent_sum);
  /// Does the work of cast_blocks() for few samples with many rays (casts_by_sample()).
  void cast_by_sample(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                      const RaySet& set, std::span<const TurnsAndCounts> rotations,
                      const RayCaster& caster, const RayQuery& query);
  /// Adds the misses in ray_hits_ to counts of open rays.
  void add_misses(const kiln_hemisphere_params& params, const cl::Array<std::uint32_t>& open);

  cl::Context& context_;
  const Source::Impl& source_;
  const LowSurface& surface_;
  std::shared_ptr<BandReads> reads_;
  std::uint32_t width_, height_, slot_bits_;
  bool keep_, two_sided_, back_faces_, by_high_, by_low_;
  // The parts, if only triangles of a sample's own part occlude it; null if all triangles do
  const Parts* parts_;
  float unbounded_, occlusion_reach_, thickness_reach_;  // Largest ray lengths, in frame units
  OcclusionFalloff falloff_ = OcclusionFalloff::none;
  double length_share_ = 1;  // length of the longest ray, as a share of occlusion_reach_
  bool needs_bent_sum_ = false;
  std::uint32_t view_directions_ = 0;  // Number of depth views; 0 if visibility is gathered by rays

  cl::Array<kiln_low_shading> shading_;
  RaySet rays_out_, rays_in_, rays_to_light_;
  std::map<std::uint32_t, RaySet> ray_sets_;  // Sets of rays, by the number of rays of each
  double max_error_;
  Vec3 light_direction_;
  cl::Array<float> rotation_table_;

  // other occluders: positions and triangles in frame units
  std::vector<Mesh> other_occluders_;
  std::optional<RayCaster> all_occluders_;  // Unset if the high poly is the only occluder
  std::map<std::uint32_t, RayCaster> part_occluders_;
  std::optional<HemisphereViews> views_;
  bool uploaded_ = false, has_turns_ = false, has_keys_ = false;
  cl::Array<float> positions_;
  cl::Array<std::uint32_t> triangles_;
  cl::Array<std::uint32_t> turns_, keys_;
  std::array<Sums, 2> sums_;

  std::uint32_t ray_capacity_ = 0;
  cl::Array<float> points_, texel_points_, rays_, scratch_, distances_;
  cl::Array<std::uint32_t> lit_;
  TexelBand picked_samples_;  // Samples of the texels that have not converged
  DeviceCorrespondence picked_match_;
  cl::Array<std::uint32_t> picked_, picked_turns_, second_turns_, picked_open_, second_open_;
  cl::Array<float> picked_bent_sum_;
  std::optional<AoDenoiser> denoiser_;
  cl::Array<std::uint8_t> ray_hits_;
  DeviceCorrespondence first_hits_;
};

}  // namespace kiln
