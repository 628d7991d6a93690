// Looking at low polys of one high poly: how near each gets without a map and with an endless one.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/beside.h"
#include "kiln/light_plan.h"
#include "lowpoly/texel_detail.h"
#include "measure/light_model.h"
#include "measure/light_planner.h"
#include "measure/normal_probe.h"

namespace kiln {

/// What plans see of the high poly.
/// \param screen  pixels that the high poly covers, the longer of width and height; 0: endlessly many
/// \param coarse  fewer places: enough to compare low polys, not to say what one reaches
DenseShown shown_to_plans(const Source& source, std::uint32_t screen, bool coarse = false);
/// The same from given directions, unit vectors towards the eye.
DenseShown shown_from(const Source& source, std::uint32_t screen, const std::vector<Vec3>& toward,
                      bool coarse = false);
/// A mesh with UVs, though they say nothing: probes of surfaces do not read them.
Mesh with_any_uvs(Mesh mesh);
/// The same bake, of the normal map and nothing else.
BakeOptions normals_alone(BakeOptions options);
/// Of each map that is baked.
std::vector<std::uint32_t> map_channels(const BakeOptions& bake);
/// What visibility is found from where maps are only tried: drawing all directions takes longer than a small map.
void few_directions(BakeOptions& options);
/// A try with a map of one size.
BakeOptions for_size(const BakeOptions& bake, std::uint32_t size, std::uint32_t samples);
/// What was measured of a try.
void set_measured(const NormalError& error, LightTrial& trial);
/// A map as files of so many bits hold it.
Image rounded(Image map, std::uint32_t bits);

/// Pictures of the high poly, low polys of all numbers of faces, and what is known of them.
class LightLooks {
 public:
  /// \param bake  how to match; may be changed by choose_match(). All outlive this
  /// \param plan  where seconds are added to
  /// \param cache  low polys that are known, or become so
  LightLooks(const Source& source, const Mesh& high, BakeOptions& bake, LightBake& plan,
             LevelCache& cache)
      : source_(source), high_(high), bake_(bake), plan_(plan), cache_(cache) {}

  void take_pictures(std::uint32_t screen);
  /// Makes levels: up to the high poly itself, unless it has very many faces, where coarser ones do not do.
  /// \param height_field  the high poly is one
  /// \param max_outline  outlines may differ by this share: coarser levels are left out; 0: any
  /// \returns the coarsest whose error with an endless map is at most `limit`
  std::optional<std::size_t> fewest_within(double limit, bool height_field, double max_outline);
  /// The same of the levels that there are.
  std::optional<std::size_t> fewest_known(double limit);
  /// The first of the ways that gets nearest, on one mesh. \returns whether it is another than before
  bool choose_match(std::size_t level, bool height_field);

  /// Leaves out a level, coarser ones, and finer ones whose outlines differ by more than a share. A few times.
  /// \returns false where nothing is left out: no other level does
  bool leave_out_coarse(std::size_t level, double most);

  /// What a level does whose normals are for a map, measured; without a map, too, unless that is surely too much. Its
  /// caller counts the time.
  /// \param mapped  of the former, whatever its layout
  LightModel::Node look_with(std::size_t level, const NormalProbe& mapped);
  /// The first of these alone.
  NormalError plain(const Mesh& low);

  /// A level with UVs for a map of `size` texels a side: charts, or those of a height field, which it has.
  /// Made once.
  const LaidOut& laid_out(std::size_t level, const LightPlanOptions& options, std::uint32_t size);

  const DenseShown& shown() { return seen().fine; }
  const SimplifyLevels& levels() const { return *known_->levels; }
  /// Of a level, as far as is known: meshes that are made may have fewer, since flaws are mended.
  std::size_t faces(std::size_t level) const;
  std::size_t vertices(std::size_t level) const;
  /// The finest level of at most so many faces; 0: of all.
  std::size_t finest(std::uint64_t most_faces) const;
  /// A level's mesh, made once.
  const Mesh& mesh(std::size_t level);
  /// Whether its mesh has flaws that simplify() may not have.
  bool is_flawed(std::size_t level) const { return levels().is_flawed(level); }
  /// Makes it again as simplify() does.
  void solve(std::size_t level);
  LightModel& model() const { return *model_; }

 private:
  /// \param most   faces of the finest level
  /// \param share  of the high poly's faces, which it has at most, too
  void make_levels(std::uint32_t most, double share, bool height_field);
  void say(double done, const char* doing) const;
  /// Pictures of the high poly: to measure by, and to look by.
  struct Seen {
    DenseShown fine, coarse;
  };
  const Seen& seen();
  const std::array<Mesh, 2>& glance(std::size_t level);
  /// The coarsest level before `end` whose outlines differ by at most a share, by looks; none where the finest's do not.
  std::optional<std::size_t> coarsest_shown(double most, std::size_t end);
  LightModel::Node look(std::size_t level);
  double look_plain(std::size_t level);
  NormalError without_map(const Mesh& low, const DenseShown& shown) const;
  LightModel::Node limits_of(const NormalProbe& mapped) const;
  BakeOptions limit_options(MatchMethod method) const;

  const Source& source_;
  const Mesh& high_;
  BakeOptions& bake_;
  LightBake& plan_;
  LevelCache& cache_;
  Seen seen_;
  KnownLevels* known_ = nullptr;  ///< In `cache_`
  std::unique_ptr<LightModel> model_;
  int left_out_ = 0;                      ///< How often levels were
  std::optional<Beside<Seen>> pictures_;  ///< While they are taken
  std::optional<TexelDetail> detail_;     ///< Of the high poly, where it was asked for
};

}  // namespace kiln
