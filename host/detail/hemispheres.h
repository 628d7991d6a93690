// Rays over the hemispheres of the high poly's points: cast once a band, for all maps that ask.
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

/// Sums over each sample's rays (kernels/detail/hemisphere.cl). They depend on the sample's point, its normal
/// and its place in the map alone.
///
/// With MissPolicy::keep, a missed sample has the low poly's own point and normal; else it has no
/// meaning. Of a second correspondence, whose values are mixed with the first one's, only samples
/// with a triangle have one.
class Hemispheres : public SharedWork {
 public:
  explicit Hemispheres(const MapRequest& request);

  void next_band() override;
  void next_source() override;
  /// Before any band: bent_sum() will be asked for.
  void want_bent_sum() { wants_bent_sum_ = true; }

  /// [samples] the share of a sample's rays that hit nothing. \param second  see above
  std::vector<float> visibility(const TexelBand& band, const DeviceCorrespondence& match,
                                bool second);

  /// Sums of the directions of those rays, 3 planes of plane_of(band).
  const cl::Array<float>& bent_sum(const TexelBand& band, const DeviceCorrespondence& match,
                                   bool second);

  /// [samples] the mean way inward to the first surface, as a share of the distance that counts as thick.
  std::vector<float> thickness(const TexelBand& band, const DeviceCorrespondence& match,
                               bool second);

  /// [samples] the share of ShadowLight's disc that is seen; 0 where the surface looks away from its middle.
  std::vector<float> shadow(const TexelBand& band, const DeviceCorrespondence& match, bool second);

  /// Says what visibility() and bent_sum() are gathered by.
  OcclusionReport report() const;

  static std::uint32_t plane_of(const TexelBand& band);
  const cl::Array<kiln_low_shading>& shading() const { return shading_; }

 private:
  struct Sums {
    bool has_open = false, has_depth = false;
    cl::Array<std::uint32_t> open;
    std::vector<float> seen;  // by views: KILN_HEMISPHERE_VIEW_SUMS planes of the band's samples
    cl::Array<float> bent_sum, depth;
  };

  /// Rays about an axis: the normal, its opposite, or the light.
  struct RaySet {
    std::uint32_t count = 0;  // a sample
    float side = 1;           // 1: about the axis; -1: about its opposite
    bool lit = false;         // the axis is the light, else the normal
    bool falls_off = false;   // OcclusionOptions::falloff says how long rays are
    cl::Array<float> directions;
    cl::Array<std::uint32_t> rings;
  };

  /// visibility() with OcclusionOptions::max_error.
  std::vector<float> visibility_within(const TexelBand& band, const DeviceCorrespondence& match,
                                       bool second);
  /// Samples that have rays, by texels.
  struct Shared {
    std::vector<std::uint32_t> samples;
    std::vector<std::uint32_t> first;  // [texels + 1] of each texel
    bool single() const { return samples.size() + 1 == first.size(); }
  };
  /// Two estimates of texels, from as many rays: how many are open, of all samples.
  struct Estimates {
    const TexelBand& band;
    const DeviceCorrespondence& match;
    bool second = false;
    Shared shared;
    std::vector<std::uint32_t> a, b, rays;  // rays: of one sample, in each
    std::vector<std::uint8_t> done;
    std::vector<std::uint32_t> cast;  // the round of the last rays
    std::uint32_t round = 0, turn = 0;
  };
  /// Casts another `rays` rays of each sample of some texels for a. Where asked for both, as many for b.
  void estimate(Estimates& of, const std::vector<std::uint32_t>& texels, std::uint32_t rays,
                std::span<std::vector<std::uint32_t>* const> open);
  AoDenoiser::Result filtered(const Estimates& of, double plain_variance);
  void cast_unsure(const Estimates& of, AoDenoiser::Result& result);
  bool refine(Estimates& of, const AoDenoiser::Result& last, const std::vector<float>& before);
  Shared prepare_filter(const TexelBand& band, const DeviceCorrespondence& match, bool second);
  /// Copies samples to some_, some_match_ and some_turns_.
  /// \param round  other rays in each, as make_keys() says; none: those of make_turns()
  void pick(const TexelBand& band, const DeviceCorrespondence& match,
            std::span<const std::uint32_t> samples, std::optional<std::uint32_t> round);
  /// Turns of the picked samples, by make_keys().
  void turn_picked(std::uint32_t count, std::uint32_t round, cl::Array<std::uint32_t>& turns);
  /// Samples that are cast one group after another, each against what occludes it.
  struct Group {
    const RayCaster* caster;
    std::vector<std::uint32_t> samples;
  };
  /// With OcclusionOptions::own_part a group each part, else one of all. Samples without rays are left out.
  std::vector<Group> groups(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                            std::span<const std::uint32_t> samples);
  const RayCaster& occluders_of(std::uint32_t part);
  /// Number of rays of each sample of a group that hit nothing, and if asked for the sums of their directions.
  struct Counted {
    std::vector<std::uint32_t> open;  // by sample of the band
    std::vector<float> bent_sum;      // 3 planes of plane_of(band)
  };
  /// \param rounds  other rays each, which are counted one by one; the points are made once. None: those of
  /// make_turns()
  void cast_group(const Group& group, const TexelBand& band, const DeviceCorrespondence& match,
                  bool second, const RaySet& set, std::span<const std::uint32_t> rounds,
                  std::span<Counted> counted);
  /// All samples of a band, each against its own part.
  Counted cast_parts(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                     const RaySet& set, bool bent_sum);
  /// Casts another `rays` rays of each of some samples, and counts those that hit nothing: by round, by sample of the band.
  /// \param rounds  other rays each
  std::vector<Counted> cast_more(const TexelBand& band, const DeviceCorrespondence& match,
                                 bool second, std::span<const std::uint32_t> samples,
                                 std::uint32_t rays, std::span<const std::uint32_t> rounds);
  const RaySet& outward_rays(std::uint32_t count);
  void upload_rays(RaySet& set, std::uint32_t count, double radius);
  void upload();
  /// Meshes that rays outward meet: the high poly alone, or all that occludes.
  const RayCaster& occluders();
  struct Occluding {
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
  };
  Occluding all_occluding() const;
  /// By depth views: visibility() and bent_sum().
  std::vector<float> visibility_by_views(const TexelBand& band, const DeviceCorrespondence& match,
                                         bool second);
  void see(const TexelBand& band, const DeviceCorrespondence& match, bool second);
  std::vector<float> shares(const TexelBand& band, const cl::Array<std::uint32_t>& counts,
                            std::uint32_t rays) const;
  void make_turns(const TexelBand& band);
  /// As make_turns(), for rays whose sums are smoothed: neighbours' rays are spread over each other.
  void make_keys(const TexelBand& band);
  void turn(const TexelBand& band, const std::string& kernel, cl::Array<std::uint32_t>& to);
  void cast(const TexelBand& band, const DeviceCorrespondence& match, bool second);
  void measure(const TexelBand& band, const DeviceCorrespondence& match, bool second);
  /// Makes rays, piece by piece, and gives each to `use` with what describes it.
  /// With few samples of many rays and `turns_well`, a sample's rays lie one after another (by_sample).
  using Use = std::function<void(const kiln_hemisphere_params& params, std::uint32_t count)>;
  void over_rays(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                 const RaySet& set, const cl::Array<std::uint32_t>& turns, bool turns_well,
                 const Use& use);
  /// Points of the band's samples, so many at a time, in points_.
  using OfPiece = std::function<void(kiln_hemisphere_params params)>;
  void over_pieces(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                   const RaySet& set, std::uint32_t together, const OfPiece& use);
  static bool casts_by_sample(const TexelBand& band, const RaySet& set);
  /// Rays that samples have: how far theirs are turned, and where those that hit nothing are counted.
  struct Turned {
    const cl::Array<std::uint32_t>*turns, *open;
  };
  /// Adds to each sample how many of its rays outward hit nothing, and the sums of their directions.
  /// \param bent_sum  empty: not asked for
  void count_open(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                  const RaySet& set, std::span<const Turned> turned, const RayCaster& caster,
                  const cl::Array<float>& bent_sum);
  kiln_hemisphere_params ray_params(const TexelBand& band, const DeviceCorrespondence& match,
                                    bool second, const RaySet& set) const;
  /// Makes the points of samples [params.first, params.first + params.count).
  void make_points(const kiln_hemisphere_params& params, const TexelBand& band,
                   const DeviceCorrespondence& match, const cl::Array<float>& points);
  void cast_piece(kiln_hemisphere_params params, const RaySet& set, std::span<const Turned> turned,
                  const RayCaster& caster, const RayQuery& query, const cl::Array<float>& points,
                  const cl::Array<float>& bent_sum);
  /// Adds to each sample how far its rays inward come. For Traversal::cpu.
  void measure_piece(kiln_hemisphere_params params, const RayCaster& caster, const RayQuery& query,
                     const cl::Array<float>& depth);
  /// Casts rays of the picked samples, whose points are texel_points_. For Traversal::cpu.
  void cast_texels(std::uint32_t count, const RaySet& set, std::span<const Turned> turned);
  /// Rays of all of prepare_filter()'s texels, which have a sample each.
  void cast_all(std::uint32_t rays, std::span<std::vector<std::uint32_t>* const> open,
                Estimates& of);
  /// The same in one kernel, for Traversal::cpu.
  void cast_blocks(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                   const RaySet& set, std::span<const Turned> turned, const RayCaster& caster,
                   const RayQuery& query, const cl::Array<float>& bent_sum);
  /// The same of few samples with many rays, as casts_by_sample() says.
  void cast_own(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                const RaySet& set, std::span<const Turned> turned, const RayCaster& caster,
                const RayQuery& query);
  /// Adds what hits_ says to counts of open rays.
  void add_open(const kiln_hemisphere_params& params, const cl::Array<std::uint32_t>& open);

  cl::Context& context_;
  const Source::Impl& source_;
  const LowSurface& surface_;
  std::shared_ptr<BandReads> reads_;
  std::uint32_t width_, height_, slot_bits_;
  bool keep_, two_sided_, back_faces_, by_high_, by_low_;
  const Parts* parts_;                // whose own triangles alone occlude; null: all do
  float beyond_, occluding_, thick_;  // frame units
  OcclusionFalloff falloff_ = OcclusionFalloff::none;
  double lengths_ = 1;  // of the falloff's distance, of occluding_
  bool wants_bent_sum_ = false;
  std::uint32_t view_directions_ = 0;  // 0: by rays

  cl::Array<kiln_low_shading> shading_;
  RaySet rays_out_, rays_in_, rays_to_light_;
  std::map<std::uint32_t, RaySet> more_rays_;  // by their number
  double max_error_;
  Vec3 light_;
  cl::Array<float> turn_table_;

  std::vector<Mesh> others_;                // frame units, positions and triangles alone
  std::optional<RayCaster> all_occluders_;  // where the high poly is not the only one
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
  TexelBand some_;  // samples that are not done yet
  DeviceCorrespondence some_match_;
  cl::Array<std::uint32_t> picked_, some_turns_, more_turns_, some_open_, more_open_;
  cl::Array<float> some_bent_sum_;
  std::optional<AoDenoiser> filter_;
  cl::Array<std::uint8_t> hits_;
  DeviceCorrespondence first_hits_;
};

}  // namespace kiln
