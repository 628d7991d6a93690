#include "measure/light_looks.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/heartbeat.h"
#include "base/stopwatch.h"
#include "detail/registry.h"
#include "kiln/plan.h"
#include "lowpoly/unwrap_charts.h"
#include "measure/far_enough.h"
#include "measure/light_limits.h"
#include "measure/plan_limits.h"

namespace kiln {
namespace {

/// Each level has this share of the faces of the one before, down to so few.
constexpr double kShare = 0.96;
constexpr std::uint32_t kFewestFaces = 2;
/// Of pictures: their pixels, without a size on screen; and of coarse ones, with and without.
constexpr std::uint32_t kPixels = 48, kCoarsePixels = 24, kCoarseScreenPixels = 16;
/// Of visibility fields, to compare ways to match with.
constexpr std::uint32_t kLookDirections = 32;
/// And of those that maps are tried with: 64 and 512 give errors within a thousandth of each other.
constexpr std::uint32_t kTrialDirections = 64;

/// Those of height fields are their layout, which matching by UVs reads.
Mesh with_some_uvs(const Mesh& low) { return low.uvs.empty() ? with_any_uvs(low) : low; }

}  // namespace

Mesh with_any_uvs(Mesh mesh) {
  mesh.uvs = {{0, 0}, {1, 0}, {0, 1}};
  mesh.uv_triangles.assign(mesh.triangles.size(), Triangle{0, 1, 2});
  return mesh;
}

BakeOptions normals_alone(BakeOptions options) {
  options.maps = {shading_map(options).value()};
  options.transfers.clear();
  options.own_maps.clear();
  options.raw = options.two_component = options.report_errors = options.keep_match = false;
  options.recall = 0;
  return options;
}

void few_directions(BakeOptions& options) {
  options.visibility.directions = std::min(options.visibility.directions, kTrialDirections);
}

BakeOptions for_size(const BakeOptions& bake, std::uint32_t size, std::uint32_t samples) {
  BakeOptions options = bake;
  options.width = options.height = size;
  options.samples = samples;
  if (bake.progress) {
    options.progress = [progress = bake.progress, size](double, std::string_view) {
      const std::string side = std::to_string(size);
      return progress(0.5, "trying " + side + " x " + side);
    };
  }
  return options;
}

std::vector<std::uint32_t> map_channels(const BakeOptions& bake) {
  std::vector<std::uint32_t> channels;
  for (const MapInfo& info : maps()) {
    const auto asked = std::count(bake.maps.begin(), bake.maps.end(), info.kind);
    channels.insert(channels.end(), static_cast<std::size_t>(asked), info.channels);
  }
  channels.insert(channels.end(), bake.transfers.size() + bake.own_maps.size(), 4);
  return channels;
}

void set_measured(const NormalError& error, LightTrial& trial) {
  trial.measured = error.mean_degrees;
  trial.standard_error = error.standard_error_degrees;
  trial.one_sided = error.one_sided_share;
}

Image rounded(Image map, std::uint32_t bits) {
  const float steps = static_cast<float>((1U << bits) - 1);
  for (float& value : map.pixels) {
    value = std::floor(std::clamp(value, 0.0F, 1.0F) * steps + 0.5F) / steps;
  }
  return map;
}

void LightLooks::say(double done, const char* doing) const { Heartbeat::at(done, doing); }

DenseShown shown_to_plans(const Source& source, std::uint32_t screen, bool coarse) {
  return shown_from(source, screen, held_out_views(kPlanViews, spread_views(12)), coarse);
}

DenseShown shown_from(const Source& source, std::uint32_t screen, const std::vector<Vec3>& toward,
                      bool coarse) {
  std::vector<ViewAngles> views;
  views.reserve(toward.size());
  for (const Vec3& direction : toward) views.push_back(view_angles(direction));
  const std::uint32_t fine = screen == 0 ? kPixels : kScreenPixels;
  const std::uint32_t few = screen == 0 ? kCoarsePixels : kCoarseScreenPixels;
  const PictureGrid grid{coarse ? few : fine, screen};
  DenseShown shown;
  shown.pictures = pictures_of(impl_of(source), views, grid);
  shown.hits = hits_by_rays(context_of(impl_of(source).device), impl_of(source).rays(),
                            shown.pictures, kDenseStart);
  return shown;
}

const LaidOut& LightLooks::laid_out(std::size_t level, const LightPlanOptions& options,
                                    std::uint32_t size) {
  const auto found = known_->laid_out.find({level, size});
  if (found != known_->laid_out.end()) return found->second;
  const Mesh& simplified = mesh(level);
  const Stopwatch watch;
  LaidOut next;
  if (options.height_field) {
    next.mesh = simplified;
    next.report.charts = 1;
    next.report.coverage = 1;
  } else {
    say(0.4, "laying out charts");
    if (options.density == TexelDensity::detail && !detail_) detail_.emplace(high_);
    next.mesh = unwrap_for(simplified, {options.unwrap, size, std::max(2U, size / 256)},
                           detail_ ? &*detail_ : nullptr, &next.report);
  }
  levels().fit_normals(next.mesh);
  plan_.seconds_unwrap += watch.total();
  return known_->laid_out[{level, size}] = std::move(next);
}

/// Low polys are made meanwhile.
void LightLooks::take_pictures(std::uint32_t screen) {
  say(0, "looking at the high poly");
  pictures_.emplace([&source = source_, screen] {
    return Seen{shown_to_plans(source, screen), shown_to_plans(source, screen, /*coarse=*/true)};
  });
}

const LightLooks::Seen& LightLooks::seen() {
  if (pictures_) {
    const Stopwatch watch;
    seen_ = pictures_->get();
    pictures_.reset();
    plan_.seconds_measure += watch.total();
  }
  return seen_;
}

void LightLooks::make_levels(std::uint32_t most, double share, bool height_field) {
  say(0.05, "simplifying");
  const Stopwatch watch;
  std::vector<std::uint32_t> faces;
  double goal = std::min<double>(most, share * static_cast<double>(high_.triangles.size()));
  for (; goal >= kFewestFaces; goal *= kShare) {
    const auto whole = static_cast<std::uint32_t>(goal);
    if (faces.empty() || whole < faces.back()) faces.push_back(whole);
  }
  if (faces.empty()) faces.push_back(kFewestFaces);
  known_ = &cache_[most];
  if (known_->levels == nullptr)
    known_->levels = std::make_shared<const SimplifyLevels>(
        high_, faces, height_field ? LevelRule::height_field : LevelRule::shape);
  plan_.seconds_simplify += watch.total();
  std::vector<double> counts;
  for (std::size_t i = 0; i < levels().count(); ++i) {
    counts.push_back(static_cast<double>(levels().faces(i)));
  }
  model_ = std::make_unique<LightModel>(
      counts, [this](std::size_t level) { return look(level); },
      [this](std::size_t level) { return look_plain(level); });
}

std::optional<std::size_t> LightLooks::fewest_within(double limit, bool height_field,
                                                     double max_outline) {
  const auto fewest = [&] {
    std::optional<std::size_t> found = fewest_known(limit);
    if (!found || max_outline == 0) return found;
    const auto shown = coarsest_shown(max_outline, model().count());
    if (shown) model().leave_out_from(*shown + 1);
    return shown ? std::min(*found, *shown) : shown;
  };
  const std::size_t all = high_.triangles.size();
  std::uint32_t most = light_limits::kMostFaces;
  make_levels(most, all <= most ? 1 : light_limits::kMostShare, height_field);
  std::optional<std::size_t> found = fewest();
  // Finer levels take long, so no more of them are made than the errors so far ask for.
  const double wanted = light_limits::kRoomForFaces * model().faces_for(limit);
  while (!found && most < all && most < light_limits::kManyFaces) {
    do {
      most *= 2;
    } while (most < wanted && most < light_limits::kManyFaces);
    make_levels(most, 1, height_field);
    found = fewest();
  }
  return found;
}

std::optional<std::size_t> LightLooks::fewest_known(double limit) {
  return model().fewest([&](std::size_t level) { return model().at(level).limit / limit; });
}

std::optional<std::size_t> LightLooks::coarsest_shown(double most, std::size_t end) {
  const DenseShown& coarse = seen().coarse;
  const auto does = [&](std::size_t at) {
    return without_map(glance(at)[0], coarse).one_sided_share <= most;
  };
  if (end == 0 || !does(0)) return std::nullopt;
  std::size_t good = 0, bad = end;
  while (bad - good > 1) {
    const std::size_t middle = (good + bad) / 2;
    (does(middle) ? good : bad) = middle;
  }
  return good;
}

bool LightLooks::leave_out_coarse(std::size_t level, double most) {
  constexpr int kMostTimes = 3;
  constexpr double kLooked = 0.8;  // Few places are looked at.
  if (left_out_++ == kMostTimes) return false;
  const auto shown = coarsest_shown(kLooked * most, level);
  if (shown) model().leave_out_from(*shown + 1);
  return shown.has_value();
}

std::size_t LightLooks::faces(std::size_t level) const {
  const auto found = known_->meshes.find(level);
  return found != known_->meshes.end() ? found->second.triangles.size() : levels().faces(level);
}

std::size_t LightLooks::vertices(std::size_t level) const {
  const auto found = known_->meshes.find(level);
  return found != known_->meshes.end() ? found->second.positions.size() : levels().vertices(level);
}

std::size_t LightLooks::finest(std::uint64_t most_faces) const {
  std::size_t level = 0;
  while (most_faces > 0 && level + 1 < levels().count() && faces(level) > most_faces) ++level;
  return level;
}

const Mesh& LightLooks::mesh(std::size_t level) {
  const auto found = known_->meshes.find(level);
  if (found != known_->meshes.end()) return found->second;
  const Stopwatch watch;
  Mesh made = levels().mesh(level);
  plan_.seconds_simplify += watch.total();
  return known_->meshes[level] = std::move(made);
}

/// Also where the very mesh is known: what a plan does must not depend on what plans before it made.
const std::array<Mesh, 2>& LightLooks::glance(std::size_t level) {
  const auto found = known_->glances.find(level);
  if (found != known_->glances.end()) return found->second;
  const Stopwatch watch;
  std::array<Mesh, 2> made = levels().glance(level);
  plan_.seconds_simplify += watch.total();
  return known_->glances[level] = std::move(made);
}

void LightLooks::solve(std::size_t level) {
  say(0.9, "simplifying anew, without flaws");
  const Stopwatch watch;
  levels().solve(level);
  known_->meshes[level] = levels().mesh(level);
  std::erase_if(known_->laid_out, [&](const auto& item) { return item.first.first == level; });
  plan_.seconds_simplify += watch.total();
}

LightModel::Node LightLooks::look(std::size_t level) {
  say(0.2, "looking at low polys");
  const auto& [plainly, mapped] = glance(level);
  const DenseShown& coarse = seen().coarse;
  const Stopwatch watch;
  Beside<double> plain([&, &low = plainly] { return without_map(low, coarse).mean_degrees; });
  LightModel::Node node = limits_of(NormalProbe(impl_of(source_), with_some_uvs(mapped), coarse));
  node.plain = plain.get();
  plan_.seconds_measure += watch.total();
  return node;
}

double LightLooks::look_plain(std::size_t level) {
  const Mesh& plainly = glance(level)[0];
  const DenseShown& coarse = seen().coarse;
  const Stopwatch watch;
  const double plain = without_map(plainly, coarse).mean_degrees;
  plan_.seconds_measure += watch.total();
  return plain;
}

NormalError LightLooks::without_map(const Mesh& low, const DenseShown& shown) const {
  return NormalProbe(impl_of(source_), with_some_uvs(low), shown).without_map();
}

NormalError LightLooks::plain(const Mesh& low) {
  const DenseShown& fine = shown();
  const Stopwatch watch;
  const NormalError error = without_map(low, fine);
  plan_.seconds_measure += watch.total();
  return error;
}

LightModel::Node LightLooks::look_with(std::size_t level, const NormalProbe& mapped) {
  LightModel::Node node = limits_of(mapped);
  const bool surely_too_much = model().may_guess_plain(level) &&
                               model().guess(level).plain > light_limits::kSurely * plan_.wanted;
  if (!surely_too_much) node.plain = without_map(mesh(level), shown()).mean_degrees;
  return node;
}

LightModel::Node LightLooks::limits_of(const NormalProbe& mapped) const {
  std::shared_ptr<const VisibilityField> field;
  BakeOptions options = limit_options(bake_.method);
  const NormalProbe::Limit limit = far_enough(
      options, [&](const BakeOptions& wide) { return mapped.limit(wide, field); },
      [](const NormalProbe::Limit& found) { return found.missed; });
  return {.bare = mapped.without_map().mean_degrees, .limit = limit.error.mean_degrees};
}

BakeOptions LightLooks::limit_options(MatchMethod method) const {
  BakeOptions options = bake_;
  options.method = method;
  std::erase(options.fallback, method);
  options.visibility.at = VisibilityAt::vertex;
  options.visibility.directions = std::min(options.visibility.directions, kLookDirections);
  options.progress = {};
  return options;
}

bool LightLooks::choose_match(std::size_t level, bool height_field) {
  const Mesh& low = glance(level)[1];
  const auto& [fine, coarse] = seen();
  const Stopwatch watch;
  // The mesh is what maps are tried with first, whatever the match is. Looks leave `levels()` alone.
  std::optional<Beside<Mesh>> made;
  if (!known_->meshes.contains(level)) made.emplace([&] { return levels().mesh(level); });
  const DenseShown& shown = fine.pictures.front().subpixels > 1 ? coarse : fine;
  const NormalProbe probe(impl_of(source_), with_some_uvs(low), shown);
  std::shared_ptr<const VisibilityField> field;
  std::vector<MatchMethod> ways = planned_matches(&MatchRow::light_turn);
  if (bake_.cage) {
    std::erase_if(ways, [](MatchMethod way) { return !match_row(way).info.takes_cage; });
  }
  const MatchMethod first = ways.front(), before = bake_.method;
  if (height_field) ways.insert(ways.begin(), match_at_uvs());
  double least = 0;
  for (const MatchMethod way : ways) {
    say(0.3, "looking at ways to match");
    const NormalProbe::Limit limit = probe.limit(limit_options(way), field);
    const bool nearer = least == 0 || limit.error.mean_degrees < kGain * least;
    if (!nearer) continue;
    least = limit.error.mean_degrees;
    if (way != bake_.method) {
      bake_.method = way;
      model_->forget();
    }
    // What no way whatever gets below: hard edges seldom leave another room.
    if (way == first && probe.least_share(limit) >= kGain) break;
  }
  std::erase(bake_.fallback, bake_.method);
  if (made) known_->meshes[level] = made->get();
  plan_.seconds_measure += watch.total();
  return bake_.method != before;
}

}  // namespace kiln
