#include <algorithm>
#include <cstdio>

#include "arguments/parse.h"
#include "lab/chart_output.h"
#include "lab/chart_plan.h"

namespace kiln::cli {
namespace {

double kib(std::uint64_t bytes) { return static_cast<double>(bytes) / 1024; }

std::string map_text(std::uint32_t size) {
  return size == 0 ? "no map" : std::to_string(size) + "²";
}

/// With the bits of its channels: "256², 8 bits".
std::string map_text(std::uint32_t size, std::uint32_t bits) {
  return map_text(size) + (size == 0 ? "" : ", " + std::to_string(bits) + " bits");
}

/// Of all maps of the grids.
std::string grid_bits() { return std::to_string(kGridBits) + " bits"; }

/// ", 600 pixels on screen", where that was asked for.
std::string seen(const PlanChart& chart) {
  return chart.screen == 0 ? "" : ", " + with_commas(chart.screen) + " pixels on screen";
}

/// Points that go into one curve, by rising bytes.
template <class Wanted>
std::vector<const PlanPoint*> points_of(const PlanChart& chart, const Wanted& wanted) {
  std::vector<const PlanPoint*> points;
  for (const PlanPoint& point : chart.points) {
    if (wanted(point)) points.push_back(&point);
  }
  std::sort(points.begin(), points.end(), [](const PlanPoint* a, const PlanPoint* b) {
    return a->bytes.total() < b->bytes.total();
  });
  return points;
}

std::vector<const PlanPoint*> front_of(const PlanChart& chart, PlanWay way) {
  return points_of(chart, [&](const PlanPoint& p) { return p.way == way && p.front; });
}

Json curve(const std::string& title, const Json& look,
           const std::vector<const PlanPoint*>& points) {
  Json json = {{"title", title}, {"look", look}, {"x", Json::array()}, {"y", Json::array()}};
  for (const PlanPoint* point : points) {
    json["x"].push_back(kib(point->bytes.total()));
    json["y"].push_back(point->degrees);
  }
  return json;
}

Json panel(const PlanChart& chart) {
  Json json = {{"y_title", "Mean angle between rendered normals, degrees"},
               {"title", chart.name + ", " + with_commas(chart.faces) + " faces" + seen(chart)},
               {"curves", Json::array()},
               {"levels", Json::array()},
               {"rings",
                {{"title", "the plans"},
                 {"x", Json::array()},
                 {"y", Json::array()},
                 {"labels", Json::array()}}}};
  std::vector<std::uint32_t> sizes;
  for (const PlanPoint& point : chart.points) sizes.push_back(point.size);
  std::sort(sizes.begin(), sizes.end());
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const auto points = points_of(
        chart, [&](const PlanPoint& p) { return p.way == PlanWay::kiln && p.size == sizes[i]; });
    if (points.empty()) continue;
    json["curves"].push_back(
        curve(map_text(sizes[i]),
              {{"thin", static_cast<double>(i) / static_cast<double>(sizes.size())}}, points));
  }
  json["curves"].push_back(curve("Kiln: the front of faces and sizes, " + grid_bits(), "kiln",
                                 front_of(chart, PlanWay::kiln)));
  json["curves"].push_back(curve("meshoptimizer and a plain bake: the front, " + grid_bits(),
                                 "paper", front_of(chart, PlanWay::plain)));
  for (const PlanStand& stand : chart.plans) {
    json["rings"]["x"].push_back(kib(stand.chosen.bytes.total()));
    json["rings"]["y"].push_back(stand.degrees);
    json["rings"]["labels"].push_back("for " + text_of(stand.wanted) +
                                      "°: " + with_commas(stand.chosen.faces) + " faces, " +
                                      map_text(stand.chosen.size, stand.chosen.bits));
  }
  return json;
}

/// "1.02", or a stroke where that front does not get there.
std::string times(const PlanStand& stand, double bytes) {
  return bytes > 0 ? fixed_text(static_cast<double>(stand.chosen.bytes.total()) / bytes, 2) : "-";
}

/// Plans measure by pictures of their own, so that those of the chart may differ: " (1.2% over)".
std::string over(const PlanStand& stand) {
  const double more = stand.degrees / stand.wanted - 1;
  return more > 0.0005 ? " (" + fixed_text(100 * more, 1) + "% over)" : "";
}

}  // namespace

std::string plan_chart_data(const std::vector<PlanChart>& charts) {
  std::string text =
      "mesh,kind,faces,vertices,size,bits,bytes_vertices,bytes_texels,bytes,mean_degrees,front,"
      "wanted_degrees,front_bytes,plain_front_bytes,seconds\n";
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const auto line = [&](const char* kind, const auto& made, std::uint32_t bits,
                          const LightBytes& bytes, double degrees,
                          const std::vector<std::string>& rest) {
      text +=
          join({std::to_string(i + 1), kind, std::to_string(made.faces),
                std::to_string(made.vertices), std::to_string(made.size),
                made.size == 0 ? "" : std::to_string(bits), std::to_string(bytes.vertices),
                std::to_string(bytes.texels), std::to_string(bytes.total()), exact_text(degrees)},
               ",");
      text += "," + join(rest, ",") + "\n";
    };
    for (const PlanPoint& p : charts[i].points) {
      line(way_name(p.way), p, kGridBits, p.bytes, p.degrees,
           {p.front ? "1" : "0", "", "", "", ""});
    }
    for (const PlanStand& s : charts[i].plans) {
      const auto known = [](double bytes) { return bytes > 0 ? exact_text(bytes) : std::string(); };
      line("plan", s.chosen, s.chosen.bits, s.chosen.bytes, s.degrees,
           {"", exact_text(s.wanted), known(s.front_bytes), known(s.plain_bytes),
            exact_text(s.seconds)});
    }
  }
  return text;
}

std::string plan_chart_table(const std::vector<PlanChart>& charts, const DeviceInfo& device) {
  std::string text = "Bytes of low poly and maps against the mean angle of rendered normals, " +
                     markdown_cell(device.name) + ".\n";
  for (const PlanChart& chart : charts) {
    text += "\n## " + markdown_cell(chart.name) + ", " + with_commas(chart.faces) + " faces" +
            seen(chart) +
            "\n\nPlans; over: their bytes, times those of a front at the same angle. Maps of the "
            "fronts "
            "have " +
            grid_bits() +
            " a channel.\n\n"
            "| wanted | measured | faces | map | KiB | over the grid's front | over "
            "meshoptimizer's |\n| --: | --: | --: | --- | --: | --: | --: |\n";
    for (const PlanStand& s : chart.plans) {
      text += "| " + text_of(s.wanted) + "° | " + fixed_text(s.degrees, 3) + "°" + over(s) + " | " +
              with_commas(s.chosen.faces) + " | " + map_text(s.chosen.size, s.chosen.bits) + " | " +
              fixed_text(kib(s.chosen.bytes.total()), 1) + " | " + times(s, s.front_bytes) + " | " +
              times(s, s.plain_bytes) + " |\n";
    }
    for (const PlanWay way : {PlanWay::kiln, PlanWay::plain}) {
      text += std::string("\nThe front of ") +
              (way == PlanWay::kiln ? "Kiln's" : "meshoptimizer's") +
              " grid:\n\n| faces | map | KiB | angle |\n| --: | --- | --: | --: |\n";
      for (const PlanPoint* p : front_of(chart, way)) {
        text += "| " + with_commas(p->faces) + " | " + map_text(p->size) + " | " +
                fixed_text(kib(p->bytes.total()), 1) + " | " + fixed_text(p->degrees, 3) + "° |\n";
      }
    }
  }
  return text;
}

Plot plan_chart_plot(const std::vector<PlanChart>& charts) {
  Json data = {{"kind", "study"},
               {"title", "Bytes against error: faces, map sizes and plans"},
               {"x_title", "KiB of low poly and maps"},
               {"x_ticks", Json::array()},
               {"panels", Json::array()}};
  double least = 1e300, most = 0;
  for (const PlanChart& chart : charts) {
    data["panels"].push_back(panel(chart));
    const auto show = [&](const LightBytes& bytes) {
      least = std::min(least, kib(bytes.total()));
      most = std::max(most, kib(bytes.total()));
    };
    for (const PlanPoint& point : chart.points) show(point.bytes);
    for (const PlanStand& stand : chart.plans) show(stand.chosen.bytes);
  }
  // Powers of four around all of it.
  double tick = 1.0 / 256;
  while (4 * tick <= least) tick *= 4;
  Json& ticks = data["x_ticks"];
  for (; ticks.size() < 2 || ticks.back().number() < most; tick *= 4) ticks.push_back(tick);
  return {kChartName, std::move(data), std::nullopt};
}

std::vector<std::string> summary(const PlanChart& chart) {
  std::vector<std::string> lines;
  for (const PlanStand& s : chart.plans) {
    char text[256];
    std::snprintf(
        text, sizeof text,
        "%7.3g degrees: %s faces, %s, %.1f KiB, measured %.3g%s; %s times the grid's front, "
        "%s times meshoptimizer's",
        s.wanted, with_commas(s.chosen.faces).c_str(),
        map_text(s.chosen.size, s.chosen.bits).c_str(), kib(s.chosen.bytes.total()), s.degrees,
        over(s).c_str(), times(s, s.front_bytes).c_str(), times(s, s.plain_bytes).c_str());
    lines.emplace_back(text);
  }
  return lines;
}

Json describe(const PlanChart& chart) {
  const auto bytes = [](const LightBytes& b) {
    return Json{{"vertices", b.vertices}, {"texels", b.texels}, {"total", b.total()}};
  };
  const auto known = [](double value) { return value > 0 ? Json(value) : Json(); };
  Json json = {{"points", Json::array()}, {"plans", Json::array()}};
  for (const PlanPoint& p : chart.points) {
    json["points"].push_back({{"way", way_name(p.way)},
                              {"faces", p.faces},
                              {"vertices", p.vertices},
                              {"size", p.size},
                              {"bits", p.size == 0 ? Json() : Json(kGridBits)},
                              {"bytes", bytes(p.bytes)},
                              {"mean_degrees", p.degrees},
                              {"front", p.front}});
  }
  for (const PlanStand& s : chart.plans) {
    json["plans"].push_back({{"wanted_degrees", s.wanted},
                             {"reached", s.reached},
                             {"faces", s.chosen.faces},
                             {"vertices", s.chosen.vertices},
                             {"size", s.chosen.size},
                             {"samples", s.chosen.samples},
                             {"bits", s.chosen.bits},
                             {"match", std::string(s.chosen.method.name)},
                             {"bytes", bytes(s.chosen.bytes)},
                             {"planned_degrees", s.chosen.measured},
                             {"mean_degrees", s.degrees},
                             {"front_bytes", known(s.front_bytes)},
                             {"plain_front_bytes", known(s.plain_bytes)},
                             {"seconds", s.seconds}});
  }
  return json;
}

}  // namespace kiln::cli
