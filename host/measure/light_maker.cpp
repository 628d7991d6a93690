#include "measure/light_maker.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bake/pipeline.h"
#include "base/beside.h"
#include "base/stopwatch.h"
#include "lowpoly/keep_colors.h"
#include "measure/bounds.h"
#include "measure/far_enough.h"
#include "measure/light_limits.h"

namespace kiln {

using namespace light_limits;

LightMaker::LightMaker(const Source& source, const Mesh& high, const LightPlanOptions& options,
                       const BakeOptions& bake, LightLooks& looks, LightBake& plan)
    : source_(source), high_(high), options_(options), bake_(bake), looks_(looks), plan_(plan) {
  cost_.bits = options.bits != 0 ? options.bits : options.max_error < kEightBits ? 16 : 8;
  cost_.channels = map_channels(bake);
}

std::uint32_t LightMaker::samples_for(std::uint32_t size) const {
  if (!options_.choose_samples) return bake_.samples;
  return std::clamp(kSampleBudget / size, 1U, kMostSamples);
}

LightBytes LightMaker::bytes(std::size_t level, std::uint32_t size) const {
  return cost_.bytes(looks_.vertices(level), looks_.faces(level), size);
}

LightTrial LightMaker::expect(std::size_t level, std::uint32_t size) const {
  LightTrial trial = guess(level, size);
  trial.expected = model().expected(level, size);
  return trial;
}

LightTrial LightMaker::guess(std::size_t level, std::uint32_t size) const {
  LightTrial trial;
  trial.faces = looks_.faces(level);
  trial.positions = looks_.vertices(level);
  trial.vertices = cost_.vertices(trial.positions, size);
  trial.size = trial.laid_out_for = size;
  trial.samples = samples_for(size == 0 ? 1 : size);
  trial.bits = cost_.bits;
  trial.method = bake_.method;
  trial.bytes = bytes(level, size);
  trial.expected = model().guessed(level, size);
  return trial;
}

std::optional<std::size_t> LightMaker::lightest_without_map(std::span<const std::uint32_t> sizes,
                                                            std::size_t finest, std::size_t first,
                                                            std::uint32_t laid_out_for) {
  std::size_t next = model().count();  // The level after the one in question
  while (next > finest && model().guess(next - 1).plain > options_.max_error) --next;
  const auto size = std::find_if(sizes.begin(), sizes.end(), [&](std::uint32_t side) {
    return has_texels(looks_.faces(first), side);
  });
  if (next == finest) return std::nullopt;
  if (size == sizes.end()) return next - 1;
  const double most = kWorthwhile * weight(next - 1, 0);
  if (weight(first, *size) < most) return std::nullopt;
  if (model().knows(next - 1) && !cost_.seams_known) {
    LightTrial trial = guess(first, laid_out_for);
    trial.vertices = split_vertices(looks_.laid_out(first, options_, laid_out_for).mesh);
    cost_.measured(trial);
    if (weight(first, *size) < most) return std::nullopt;
  }
  return next - 1;
}

LightMade LightMaker::without_map(std::size_t level) {
  LightMade made;
  made.level = level;
  made.low = looks_.mesh(level);
  const NormalError error = looks_.plain(made.low);
  model().know_plain(level, error.mean_degrees);
  // Vertices have several normals at creases.
  const std::uint64_t vertices = split_vertices(made.low);
  cost_.splits = static_cast<double>(vertices) / static_cast<double>(made.low.positions.size());
  made.trial = expect(level, 0);
  made.trial.vertices = vertices;
  made.trial.bytes = light_bytes(vertices, made.trial.faces, 0, cost_.channels, cost_.bits);
  set_measured(error, made.trial);
  return made;
}

bool LightMaker::may_do_without_map(double bytes, std::size_t finest) {
  const std::size_t level = finest_within(bytes, 0, finest);
  if (model().knows(level)) return false;
  return model().glance(level) <= options_.max_error &&
         model().plainly(level).plain <= options_.max_error;
}

std::uint32_t LightMaker::first_size(std::size_t level,
                                     std::span<const std::uint32_t> sizes) const {
  std::uint32_t size = sizes.front();
  while (2 * size <= sizes.back() && bytes(level, 2 * size).texels < bytes(level, 0).total()) {
    size *= 2;
  }
  return std::min(size * (4 * size <= kSmallFirst ? 4 : 2), sizes.back());
}

LightMade LightMaker::first_map(std::size_t level, std::uint32_t size) {
  const std::uint32_t laid_out_for = first_layout(level, size);
  return measured_map(level, size, laid_out_for, lay_out(level, laid_out_for), /*learn=*/true);
}

std::size_t LightMaker::finest_within(double bytes, std::uint32_t size, std::size_t finest) const {
  std::size_t level = finest;
  while (level + 1 < model().count() && weight(level, size) > bytes) ++level;
  return level;
}

LightTrial LightMaker::within_leap(const LightTrial& next, std::size_t& level,
                                   std::size_t finest) const {
  const LightReach reach = LightReach::of(plan_.trials);
  const std::uint32_t size = reach.size(next.size);
  std::size_t nearer = size == next.size ? level : finest;
  const double most = kLighter * static_cast<double>(next.bytes.total());
  while (nearer + 1 < model().count() && (!reach.faces(looks_.faces(nearer)) ||
                                          (size != next.size && weight(nearer, size) > most))) {
    ++nearer;
  }
  const bool is_new = !tried_about(plan_.trials, looks_.faces(nearer), size);
  if ((nearer == level && size == next.size) || !is_new) return next;
  level = nearer;
  return expect(level, size);
}

std::shared_ptr<const NormalProbe> LightMaker::lay_out(std::size_t level, std::uint32_t size) {
  const Mesh& low = looks_.laid_out(level, options_, size).mesh;
  const Stopwatch watch;
  auto probe = std::make_shared<const NormalProbe>(impl_of(source_), low, looks_.shown());
  if (!model().knows(level)) {
    learning_.emplace([this, level, probe] { return looks_.look_with(level, *probe); });
  }
  plan_.seconds_measure += watch.total();
  return probe;
}

LightMade LightMaker::measured_map(std::size_t level, std::uint32_t size,
                                   std::uint32_t laid_out_for,
                                   const std::shared_ptr<const NormalProbe>& probe, bool learn) {
  const LaidOut& laid_out = looks_.laid_out(level, options_, laid_out_for);
  LightMade made;
  made.level = level;
  made.low = laid_out.mesh;
  made.unwrapped = laid_out.report;
  made.unwrapped.border_texels *= static_cast<double>(size) / laid_out_for;
  made.bake = for_size(bake_, size, samples_for(size));
  made.probe = probe;
  BakeOptions plain = normals_alone(made.bake);
  if (!all_directions_) few_directions(plain);
  plain.mips = learn;
  const BakeResult result = far_enough(
      plain,
      [&](const BakeOptions& options) {
        return bake_drawn(impl_of(source_), made.low, options, nullptr);
      },
      [](const BakeResult& baked) {
        const BakeReport& report = baked.report;
        return report.samples == 0 ? 0 : static_cast<double>(report.missed) / report.samples;
      });
  made.bake.max_distance = plain.max_distance;
  const Stopwatch measuring;
  if (learning_) model().know(level, learning_->get());
  learning_.reset();
  made.trial = expect(level, size);
  made.trial.laid_out_for = laid_out_for;
  if (learn) {
    for (const Image& map : result.maps.front().mips) {
      if (map.width < kSmallestMap) break;
      const NormalError error = probe->with_map(rounded(map, cost_.bits), plain);
      model().measured(level, map.width, error.mean_degrees,
                       map.width == laid_out_for ? LightModel::Map::own : LightModel::Map::mip);
    }
    made.trial.expected = model().expected(level, size);
  }
  made.map = std::make_shared<const Image>(rounded(result.maps.front().image, cost_.bits));
  set_measured(probe->with_map(*made.map, plain), made.trial);
  model().measured(level, size, made.trial.measured,
                   size == laid_out_for ? LightModel::Map::own : LightModel::Map::wide);
  made.trial.vertices = split_vertices(made.low);
  made.trial.charts = made.unwrapped.charts;
  made.trial.bytes = cost_.measured(made.trial);
  plan_.seconds_measure += measuring.total();
  return made;
}

void LightMaker::bake_all_maps(const LightMade& made, const std::function<void()>& on_measured) {
  // Deviations take long to measure, so only that of what was chosen is, and beside the bake.
  Beside<SimplifyReport> simplified([&] { return looks_.levels().report(made.level); });
  plan_.low = made.low;
  keep_colors(high_, plan_.low);
  plan_.chosen = made.trial;
  plan_.chosen.size != 0 ? bake_chosen(made, on_measured) : on_measured();
  const Stopwatch watch;
  plan_.simplified = simplified.get();
  plan_.seconds_simplify += watch.total();
}

void LightMaker::bake_chosen(const LightMade& made, const std::function<void()>& on_measured) {
  plan_.unwrapped = made.unwrapped;
  plan_.bake = made.bake;
  plan_.bake.progress = bake_.progress;
  plan_.result = bake_drawn(impl_of(source_), plan_.low, plan_.bake, &plan_.drawn);
  plan_.drawn = rounded(std::move(plan_.drawn), cost_.bits);
  // Where it was tried from all directions, it is known.
  if (plan_.drawn.pixels != made.map->pixels) {
    set_measured(made.probe->with_map(plan_.drawn, plan_.bake), plan_.chosen);
  }
  on_measured();
  plan_.bounds =
      reached_bounds(impl_of(source_), plan_.low, plan_.bake, options_.bounds, *plan_.result);
}

}  // namespace kiln
