// Makes low polys with their maps, and measures them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "base/beside.h"
#include "kiln/light_plan.h"
#include "measure/light_looks.h"
#include "measure/light_trials.h"
#include "measure/normal_probe.h"

namespace kiln {

/// A mesh laid out for a size, with its map.
struct LightMade {
  std::size_t level = 0;
  Mesh low;
  UnwrapReport unwrapped;
  BakeOptions bake;
  LightTrial trial;
  std::shared_ptr<const NormalProbe> probe;  ///< Of `low`; null without a map
  std::shared_ptr<const Image> map;          ///< That was measured, as files hold it
};

/// What tells the model of errors what maps reach. All that it is made with outlives it.
class LightMaker {
 public:
  LightMaker(const Source& source, const Mesh& high, const LightPlanOptions& options,
             const BakeOptions& bake, LightLooks& looks, LightBake& plan);

  LightBytes bytes(std::size_t level, std::uint32_t size) const;
  double weight(std::size_t level, std::uint32_t size) const {
    return static_cast<double>(bytes(level, size).total());
  }
  /// What is expected of a level with a map of a size; 0: without one. guess() looks at nothing.
  LightTrial expect(std::size_t level, std::uint32_t size) const;
  LightTrial guess(std::size_t level, std::uint32_t size) const;

  /// By guesses. None where the first mesh that maps are tried with may be lighter with one of these sizes. It is laid
  /// out to count its seams, if that decides.
  /// \param sizes         rising
  /// \param finest        levels before it are not in question
  /// \param laid_out_for  a size that the first mesh is laid out for anyway
  std::optional<std::size_t> lightest_without_map(std::span<const std::uint32_t> sizes,
                                                  std::size_t finest, std::size_t first,
                                                  std::uint32_t laid_out_for);
  LightMade without_map(std::size_t level);
  /// Looks at the finest mesh without a map that weighs at most so many bytes. \returns false where it was looked at, or
  /// does not reach the error
  bool may_do_without_map(double bytes, std::size_t finest);

  /// Lays a level out, and begins to find what pictures show of it: for measured_map(), which is to follow.
  std::shared_ptr<const NormalProbe> lay_out(std::size_t level, std::uint32_t size);
  /// Of these sizes, one with about as many bytes of texels as of vertices, or larger. \param sizes  rising
  std::uint32_t first_size(std::size_t level, std::span<const std::uint32_t> sizes) const;
  /// The first map tells of many sizes, by its mip-maps. Layouts for small maps take less time.
  LightMade first_map(std::size_t level, std::uint32_t size);
  /// The size that its charts are laid out for: half of its own, where a map of that could be.
  std::uint32_t first_layout(std::size_t level, std::uint32_t size) const {
    const bool for_half = size / 2 >= kSmallestMap && has_texels(looks_.faces(level), size / 2);
    return for_half ? size / 2 : size;
  }
  /// The finest level, from `finest` on, that weighs at most so many bytes with a map; the last where none does.
  std::size_t finest_within(double bytes, std::uint32_t size, std::size_t finest) const;
  /// Little is known of meshes and maps far finer than those that were made. Layouts take long, so what lies
  /// between tells more first.
  /// \param level   of `next`; out: of what is returned
  /// \param finest  levels before it are not in question
  LightTrial within_leap(const LightTrial& next, std::size_t& level, std::size_t finest) const;
  /// Bakes a map and measures it.
  /// \param laid_out_for  the size that charts were laid out for: `size`, or half of it
  /// \param probe         of that layout
  /// \param learn         from the map's mip-maps, too
  LightMade measured_map(std::size_t level, std::uint32_t size, std::uint32_t laid_out_for,
                         const std::shared_ptr<const NormalProbe>& probe, bool learn = false);

  /// Tries look from few directions, until this is called.
  void look_from_all_directions() { all_directions_ = true; }

  /// Bakes all maps, as asked for: the plan's result. Measures how its mesh deviates.
  /// \param on_measured  called as soon as the plan's choice is measured
  void bake_all_maps(const LightMade& made, const std::function<void()>& on_measured);

 private:
  LightModel& model() const { return looks_.model(); }
  std::uint32_t samples_for(std::uint32_t size) const;
  void bake_chosen(const LightMade& made, const std::function<void()>& on_measured);

  const Source& source_;
  const Mesh& high_;
  const LightPlanOptions& options_;
  const BakeOptions& bake_;
  LightLooks& looks_;
  LightBake& plan_;
  LightCost cost_;
  bool all_directions_ = false;
  std::optional<Beside<LightModel::Node>> learning_;  ///< Of the level that was laid out last
};

}  // namespace kiln
