#include "hard_scenes.h"

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "hard.h"

namespace kiln::sample {
namespace {

struct Builder {
  explicit Builder(std::string_view name)
      : high(std::string(name) + "_high"), low(std::string(name) + "_low") {}

  /// Starts a part: all shapes added next belong to the groups NAME_high and NAME_low.
  void part(const std::string& name) {
    high.group(name + "_high");
    low.group(name + "_low");
  }
  /// Starts a group on the current part: the high-poly shapes added next belong to NAME_high_ON_IT.
  void start_group_on_part(const std::string& name, const std::string& on_it) {
    high.group(name + "_high_" + on_it);
  }
  /// A raised disc from `base` to `top` above the frame's origin.
  void add_raised_disc(const PartFrame& part_frame, double radius, double base, double top) {
    high.disc(part_frame.translated(0, 0, base), radius, top - base,
              0.3 * (top - std::max(base, 0.0)));
    raised_discs.push_back({part_frame.origin, part_frame.z, radius, top});
  }
  void box(const PartFrame& part_frame, const Point& half, double radius) {
    high.rounded_box(part_frame, half, radius);
    low.box(part_frame, half);
  }
  /// A rod along z from 0 to `height`, with a rounded upper rim.
  void rod(const PartFrame& part_frame, double radius, double height, double rounding,
           int sides = 12) {
    high.disc(part_frame, radius, height, rounding, 96);
    low.cylinder(part_frame, sides, radius, height, true);
  }
  HardScene done() { return {high.mesh(), low.pack_charts_and_finish(), raised_discs}; }

  HighPolyParts high;
  LightParts low;
  std::vector<RaisedDisc> raised_discs;
};

HardScene cube() {
  Builder b("cube");
  b.box({}, {1, 1, 1}, 0.06);
  const std::array<Point, 6> axes = {Point{1, 0, 0},  Point{-1, 0, 0}, Point{0, 1, 0},
                                     Point{0, -1, 0}, Point{0, 0, 1},  Point{0, 0, -1}};
  for (const Point& axis : axes) {
    const PartFrame face = frame_along(axis, axis);
    b.add_raised_disc(face.translated(-0.5, -0.5, 0), 0.22, -0.02, 0.04);  // sunk in
    b.add_raised_disc(face.translated(0.45, -0.35, 0), 0.18, 0, 0.05);     // on it
    b.add_raised_disc(face.translated(0.1, 0.6, 0), 0.2, 0.02, 0.05);      // floating
  }
  return b.done();
}

HardScene cylinder() {
  Builder b("cylinder");
  const PartFrame part_frame = frame_along({0, -1, 0}, {0, 1, 0});
  b.rod(part_frame, 0.8, 2, 0.05);
  for (int i = 0; i < 6; ++i) {
    const double angle = 2 * std::numbers::pi * i / 6;
    b.high.bent_plate(part_frame.translated(0, 0, 1), 0.78, 0.815, angle,
                      2 * std::numbers::pi / 6 * 0.7, 0.55, 16);
    for (const double z : {0.22, 1.78}) {
      for (const double turn : {0.15, 0.55}) {
        const double a = angle + turn;
        const Point out = part_frame.direction({std::cos(a), std::sin(a), 0});
        const Point at = part_frame.at({0.8 * std::cos(a), 0.8 * std::sin(a), z});
        b.high.disc(frame_along(at - 0.02 * out, out), 0.05, 0.035, 0.01, 24);
      }
    }
  }
  b.add_raised_disc(part_frame.translated(0.2, 0.1, 2), 0.3, 0.005, 0.04);
  return b.done();
}

HardScene bracket() {
  Builder b("bracket");
  const Outline outline = {{-0.8, -0.8},   {0.8, -0.8},  {0.8, -0.45},
                           {-0.45, -0.45}, {-0.45, 0.8}, {-0.8, 0.8}};
  const std::array<double, 2> centre = {-0.625, -0.625};
  b.high.extrusion({}, outline, centre, 0.7, 0.05);
  b.low.extrusion({}, outline, centre, 0.7);
  const PartFrame floor = frame_along({0.15, -0.45, 0}, {0, 1, 0});
  const PartFrame wall = frame_along({-0.45, 0.15, 0}, {1, 0, 0});
  for (const PartFrame& part_frame : {floor, wall}) {
    b.add_raised_disc(part_frame.translated(0, 0.35, 0), 0.15, -0.01, 0.045);
    b.add_raised_disc(part_frame.translated(0, -0.35, 0), 0.15, 0, 0.045);
  }
  b.add_raised_disc(frame_along({-0.33, -0.45, 0.1}, {0, 1, 0}), 0.08, 0,
                    0.03);  // in the inner corner of the L
  b.add_raised_disc(frame_along({0.8, -0.625, 0.2}, {1, 0, 0}), 0.12, 0.01, 0.03);
  return b.done();
}

HardScene bolt() {
  Builder b("bolt");
  b.box(frame_along({0, -0.15, 0}, {0, 1, 0}), {1, 1, 0.15}, 0.04);
  const PartFrame up = frame_along({0, 0, 0}, {0, 1, 0});
  b.high.disc(up.translated(0, 0, -0.01), 0.56, 0.045, 0.01, 96);  // the washer
  b.high.prism(up.translated(0, 0, -0.05), 6, 0.42, 0.4, 0.04);
  b.low.cylinder(up.translated(0, 0, -0.05), 6, 0.42, 0.4, false);
  b.add_raised_disc(up.translated(0, 0, 0.35), 0.15, 0.005, 0.03);
  for (const double x : {-0.75, 0.75}) {
    for (const double y : {-0.75, 0.75}) b.add_raised_disc(up.translated(x, y, 0), 0.12, 0, 0.04);
  }
  return b.done();
}

HardScene pipe() {
  Builder b("pipe");
  b.box({}, {1, 1, 0.12}, 0.03);
  const PartFrame along = frame_along({0, 0, -1}, {0, 0, 1});
  b.rod(along, 0.35, 2, 0.03);
  for (const double side : {-1.0, 1.0}) {
    const PartFrame face = frame_along({0, 0, 0.12 * side}, {0, 0, side});
    b.high.disc(face.translated(0, 0, -0.02), 0.55, 0.06, 0.015, 96);  // the flange
    for (int i = 0; i < 4; ++i) {
      const double a = std::numbers::pi / 4 + std::numbers::pi / 2 * i;
      b.add_raised_disc(face.translated(0.8 * std::cos(a), 0.8 * std::sin(a), 0), 0.1, 0.01, 0.045);
    }
  }
  return b.done();
}

HardScene assembly() {
  Builder b("assembly");
  b.part("receiver");
  b.box({}, {0.6, 0.16, 0.1}, 0.02);
  b.part("rail");
  b.box(PartFrame{}.translated(0, 0.2, 0), {0.5, 0.045, 0.05}, 0.012);
  b.part("barrel");
  b.rod(frame_along({0.58, 0.03, 0}, {1, 0, 0}), 0.07, 0.75, 0.015);
  b.part("muzzle");
  b.rod(frame_along({1.28, 0.03, 0}, {1, 0, 0}), 0.1, 0.18, 0.02);
  b.part("hand_guard");
  b.box(PartFrame{}.translated(0.85, 0.03, 0), {0.24, 0.11, 0.11}, 0.02);
  b.part("stock");
  b.box(PartFrame{}.translated(-0.95, -0.02, 0), {0.36, 0.12, 0.07}, 0.025);
  b.part("butt_plate");
  b.box(PartFrame{}.translated(-1.29, -0.06, 0), {0.035, 0.2, 0.08}, 0.015);
  const double tilt = 0.3;
  const PartFrame leaning{{-0.4, -0.33, 0},
                          {std::cos(tilt), std::sin(tilt), 0},
                          {-std::sin(tilt), std::cos(tilt), 0},
                          {0, 0, 1}};
  b.part("grip");
  b.box(leaning, {0.1, 0.24, 0.07}, 0.025);
  b.part("magazine");
  b.box(PartFrame{}.translated(0.2, -0.36, 0), {0.11, 0.26, 0.06}, 0.015);
  b.part("trigger_guard");
  b.box(PartFrame{}.translated(-0.12, -0.27, 0), {0.16, 0.015, 0.04}, 0.006);
  b.part("trigger");
  b.box(PartFrame{}.translated(-0.14, -0.2, 0), {0.02, 0.06, 0.015}, 0.006);
  b.part("front_sight");
  b.box(PartFrame{}.translated(1.2, 0.16, 0), {0.03, 0.07, 0.015}, 0.006);
  b.part("rear_sight");
  b.box(PartFrame{}.translated(-0.42, 0.27, 0), {0.05, 0.04, 0.04}, 0.01);
  b.part("bolt_handle");
  b.rod(frame_along({0.2, 0.05, 0.09}, {0, 0, 1}), 0.05, 0.1, 0.012);
  for (const double z : {-1.0, 1.0}) {
    b.start_group_on_part("receiver", "discs");
    for (const double x : {-0.45, -0.1, 0.42}) {
      b.add_raised_disc(frame_along({x, -0.06, 0.1 * z}, {0, 0, z}), 0.05, -0.01, 0.015);
    }
    b.start_group_on_part("hand_guard", "discs");
    b.add_raised_disc(frame_along({0.85, 0.03, 0.11 * z}, {0, 0, z}), 0.05, 0.003, 0.015);
    b.start_group_on_part("stock", "discs");
    b.add_raised_disc(frame_along({-0.95, -0.02, 0.07 * z}, {0, 0, z}), 0.06, 0, 0.02);
  }
  return b.done();
}

double leaf_height(double x, double y) {
  const double droop = 0.35 * y * y, fold = 0.25 * std::abs(x) * std::abs(x);
  return 0.2 - droop + fold + 0.01 * std::sin(20 * y + 8 * std::abs(x));
}

HardScene leaf() {
  Builder b("leaf");
  b.high.open_sheet({}, 0.5, 1, 96, leaf_height);
  b.low.card({}, 0.5, 1);
  return b.done();
}

constexpr std::array<std::string_view, 7> kSceneNames = {"cube", "cylinder", "bracket", "bolt",
                                                         "pipe", "assembly", "leaf"};
constexpr std::array kScenes = {cube, cylinder, bracket, bolt, pipe, assembly, leaf};
static_assert(kSceneNames.size() == kScenes.size());

}  // namespace

std::span<const std::string_view> hard_scene_names() { return kSceneNames; }

HardScene hard_scene(std::string_view name) {
  for (std::size_t i = 0; i < kSceneNames.size(); ++i) {
    if (kSceneNames[i] == name) return kScenes[i]();
  }
  throw std::invalid_argument("no scene " + std::string(name));
}

}  // namespace kiln::sample
