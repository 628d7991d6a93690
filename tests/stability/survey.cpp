#include "stability/survey.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <random>

#include "kiln/assess.h"
#include "shared/match.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

constexpr std::uint32_t kSize = 96;

BakeOptions options_for(const Way& way, std::uint32_t size, const Length& reach,
                        const Length& cage) {
  BakeOptions options = way.options;
  options.width = options.height = size;
  options.encoding.gutter = 0;
  options.report.keep_match = true;
  options.report.recall = 0;  // rated here by what is known of each sample
  options.match.max_distance = reach;
  if (way.use_cage) {
    options.match.cage = cage;
    options.match.max_distance = {reach.value * 2, reach.relative};
  }
  return options;
}

BakeOptions movement_options(const Way& way) {
  BakeOptions options = options_for(way, 128, Length::share(0.03), Length::share(0.03));
  options.encoding.space = NormalMapSpace::object;
  options.encoding.raw = true;
  return options;
}

using Turn = std::array<std::array<double, 3>, 3>;

Vec3 turned(const Turn& turn, const Vec3& v) {
  const auto row = [&](const std::array<double, 3>& r) {
    return static_cast<float>(r[0] * v.x + r[1] * v.y + r[2] * v.z);
  };
  return {row(turn[0]), row(turn[1]), row(turn[2])};
}

Turn rotation(double x, double y, double z, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), d = 1 - c;
  return {{{c + x * x * d, x * y * d - z * s, x * z * d + y * s},
           {y * x * d + z * s, c + y * y * d, y * z * d - x * s},
           {z * x * d - y * s, z * y * d + x * s, c + z * z * d}}};
}

void turn_mesh(const Turn& turn, Mesh& mesh) {
  for (Vec3& p : mesh.positions) p = turned(turn, p);
  for (Vec3& n : mesh.normals) n = turned(turn, n);
}

void mirror(Mesh& mesh) {
  for (Vec3& p : mesh.positions) p.x = -p.x;
  for (Vec3& n : mesh.normals) n.x = -n.x;
  for (auto* triangles : {&mesh.triangles, &mesh.uv_triangles, &mesh.normal_triangles}) {
    for (Triangle& t : *triangles) std::swap(t[1], t[2]);
  }
}

/// Uniform in [0, 1), the same everywhere.
double uniform(std::mt19937& random) { return random() * (1.0 / 4294967296.0); }

void jitter(double by, std::uint32_t seed, Mesh& mesh) {
  std::mt19937 random(seed);
  for (Vec3& p : mesh.positions) {
    for (float* axis : {&p.x, &p.y, &p.z}) {
      *axis += static_cast<float>(by * (2 * uniform(random) - 1));
    }
  }
}

template <typename T>
void shuffle(std::vector<T>& values, std::mt19937& random) {
  for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random() % i]);
}

void permute(Mesh& mesh) {
  std::mt19937 random(7);
  shuffle(mesh.triangles, random);
  std::vector<std::uint32_t> order(mesh.positions.size());
  std::iota(order.begin(), order.end(), 0U);
  shuffle(order, random);
  std::vector<Vec3> positions(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) positions[order[i]] = mesh.positions[i];
  mesh.positions = std::move(positions);
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) v = order[v];
  }
}

/// An angle, as far as it means something: below a ten-thousandth of a degree are a float's last bits.
std::string in_degrees(double angle) {
  if (angle > 0 && angle < 1e-4) return "<1e-4";
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", angle);
  return text;
}

std::string percent(double share) {
  char text[32];
  if (share == 0) return "0";
  if (share == 1) return "100";
  std::snprintf(text, sizeof text, share < 0.001 ? "<0.1" : "%.1f", 100 * share);
  return text;
}

}  // namespace

struct Survey::Scenery {
  Source source;
  Mesh low;
  Turn back;
};

Survey::Survey(const Device& device) : device_(device) {}
Survey::~Survey() = default;

const Source& Survey::source_of(const FailureScene& scene) {
  const auto found = sources_.find(scene.name);
  if (found != sources_.end()) return found->second;
  return sources_.emplace(scene.name, Source(device_, scene.high)).first->second;
}

const FailureRate& Survey::rate(const FailureScene& scene, const Way& way) {
  const auto [place, is_new] = rates_.try_emplace({scene.name, way.name});
  FailureRate& rate = place->second;
  if (!is_new) return rate;
  const Source& source = source_of(scene);
  BakeOptions options = options_for(way, kSize, scene.reach, scene.cage);
  if (!scene.says_reach && !way.use_cage) options.match.max_distance.reset();
  std::optional<Parts> parts;
  if (way.by_parts && !scene.high.groups.empty()) {
    PartNames names;
    names.by = PartsBy::name;
    parts = pair_parts(scene.high, scene.low, names);
    options.match.parts = &*parts;
  }
  const BakeResult baked = bake(source, scene.low, options);
  const Match& match = *baked.match;
  std::uint64_t samples = 0, wrong = 0, undecided = 0;
  for (std::size_t i = 0; i < match.status.size(); ++i) {
    if (match.status[i] == KILN_STATUS_NONE) continue;
    ++samples;
    const double u = (static_cast<double>(i % kSize) + 0.5) / kSize;
    const double v = 1 - (static_cast<double>(i / kSize) + 0.5) / kSize;
    const Verdict verdict = scene.judge(u, v, match.triangle[i], match.distance[i]);
    wrong += verdict == Verdict::wrong ? 1 : 0;
    undecided += verdict == Verdict::undecided ? 1 : 0;
  }
  rate.wrong = static_cast<double>(wrong) / static_cast<double>(samples);
  rate.undecided = static_cast<double>(undecided) / static_cast<double>(samples);
  AssessOptions few;
  few.directions = 12;
  const MatchAssessment assessment = assess(source, scene.low, match, few);
  rate.jump = assessment.largest_jump / assessment.diagonal;
  rate.folded = assessment.folded;
  return rate;
}

std::vector<std::pair<std::string, Disturbance>> disturbances() {
  return {{"jitter by 1e-6", Disturbance::jitter}, {"rotate", Disturbance::rotate},
          {"scale by 1000", Disturbance::scale},   {"translate by 100", Disturbance::translate},
          {"permute", Disturbance::permute},       {"mirror", Disturbance::mirror}};
}

const Survey::Scenery& Survey::disturbed(Disturbance disturbance) {
  std::unique_ptr<Scenery>& scenery = sceneries_[disturbance];
  if (scenery) return *scenery;
  Mesh high = BumpySphere::dense(20000);
  Mesh low = BumpySphere::light(24, 12);
  const double diagonal = 2 * std::sqrt(3.0);
  Turn back = rotation(0, 0, 1, 0);
  switch (disturbance) {
    case Disturbance::none:
      break;
    case Disturbance::jitter:
      jitter(1e-6 * diagonal, 1, high);
      jitter(1e-6 * diagonal, 2, low);
      break;
    case Disturbance::rotate: {
      // No axis of symmetry of anything here.
      const Turn turn = rotation(0.48, 0.6, 0.64, 0.7);
      turn_mesh(turn, high);
      turn_mesh(turn, low);
      back = rotation(0.48, 0.6, 0.64, -0.7);
      break;
    }
    case Disturbance::scale:
      for (Mesh* mesh : {&high, &low}) {
        for (Vec3& p : mesh->positions) p = {p.x * 1000, p.y * 1000, p.z * 1000};
      }
      break;
    case Disturbance::translate:
      for (Mesh* mesh : {&high, &low}) mesh->origin = {100 * diagonal, 0, -50 * diagonal};
      break;
    case Disturbance::permute:
      permute(high);
      break;
    case Disturbance::mirror:
      mirror(high);
      mirror(low);
      back = {{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
      break;
  }
  scenery = std::make_unique<Scenery>(Scenery{Source(device_, high), std::move(low), back});
  return *scenery;
}

const BakeResult& Survey::undisturbed(const Way& way) {
  const auto found = undisturbed_.find(way.name);
  if (found != undisturbed_.end()) return found->second;
  const Scenery& scenery = disturbed(Disturbance::none);
  BakeResult result = bake(scenery.source, scenery.low, movement_options(way));
  return undisturbed_.emplace(way.name, std::move(result)).first->second;
}

const Movement& Survey::movement(const Way& way, Disturbance disturbance) {
  const auto [place, is_new] = movements_.try_emplace({way.name, disturbance});
  Movement& result = place->second;
  if (!is_new) return result;
  const Scenery& scenery = disturbed(disturbance);
  const BakeResult& before = undisturbed(way);
  const BakeResult after = bake(scenery.source, scenery.low, movement_options(way));
  std::uint64_t both = 0, above = 0, changed = 0, covered = 0;
  double sum = 0;
  constexpr std::uint8_t kBaked = 1, kMissed = 2;
  for (std::size_t i = 0; i < before.coverage.size(); ++i) {
    const std::uint8_t a = before.coverage[i], b = after.coverage[i];
    if (a != kBaked && a != kMissed) continue;
    ++covered;
    changed += a != b ? 1 : 0;
    if (a != kBaked || b != kBaked) continue;
    const float* p = &before.maps[0].image.pixels[3 * i];
    const float* q = &after.maps[0].image.pixels[3 * i];
    const Vec3 n = turned(scenery.back, {q[0], q[1], q[2]});
    const double x = double{p[1]} * n.z - double{p[2]} * n.y;
    const double y = double{p[2]} * n.x - double{p[0]} * n.z;
    const double z = double{p[0]} * n.y - double{p[1]} * n.x;
    const double dot = double{p[0]} * n.x + double{p[1]} * n.y + double{p[2]} * n.z;
    const double degrees =
        std::atan2(std::sqrt(x * x + y * y + z * z), dot) * 180 / std::acos(-1.0);
    ++both;
    sum += degrees;
    above += degrees > 1 ? 1 : 0;
    result.max_degrees = std::max(result.max_degrees, degrees);
  }
  result.mean_degrees = sum / static_cast<double>(both);
  result.above_1_degree = static_cast<double>(above) / static_cast<double>(both);
  result.changed_cover = static_cast<double>(changed) / static_cast<double>(covered);
  return result;
}

std::string Survey::tables() {
  std::string text =
      "Texels that are wrong / undecided, %, and the largest jump between the matches of "
      "neighbouring "
      "texels, % of the diagonal:\n\n| |";
  for (const Way& way : ways_) text += " " + way.name + " |";
  text += "\n| --- |";
  for (std::size_t i = 0; i < ways_.size(); ++i) text += " --: |";
  text += "\n";
  std::string legend;
  for (const FailureScene& scene : scenes_) {
    text += "| " + scene.name + " |";
    for (const Way& way : ways_) {
      const FailureRate& rate = this->rate(scene, way);
      text += " " + percent(rate.wrong) + " / " + percent(rate.undecided) + ", " +
              percent(rate.jump) + " |";
    }
    text += "\n";
    legend += "- *" + scene.name + "*: " + scene.what + "\n";
  }
  text += "\n" + legend +
          "\nHow far the map of a bumpy sphere moves where the input is disturbed: mean / largest "
          "angle in degrees, and the share of texels that move by over 1 degree or come or go, "
          "%:\n\n| |";
  for (const Way& way : ways_) text += " " + way.name + " |";
  text += "\n| --- |";
  for (std::size_t i = 0; i < ways_.size(); ++i) text += " --: |";
  text += "\n";
  for (const auto& [name, disturbance] : disturbances()) {
    text += "| " + name + " |";
    for (const Way& way : ways_) {
      const Movement& m = movement(way, disturbance);
      char cell[96];
      std::snprintf(cell, sizeof cell, " %s / %s, ", in_degrees(m.mean_degrees).c_str(),
                    in_degrees(m.max_degrees).c_str());
      text += cell + percent(m.above_1_degree + m.changed_cover) + " |";
    }
    text += "\n";
  }
  return text;
}

}  // namespace kiln::test
