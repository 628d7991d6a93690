// `kiln chart HIGH --plan`.
#include <algorithm>

#include "arguments/files.h"
#include "arguments/map_words.h"
#include "arguments/parse.h"
#include "kiln/plan.h"
#include "lab/chart.h"
#include "lab/chart_plan.h"
#include "lab/table.h"

namespace kiln::cli {
namespace {

using Points = std::vector<const PlanPoint*>;

double kib(const LowPolyBytes& bytes) { return static_cast<double>(bytes.total()) / 1024; }

std::string map_text(std::uint32_t size) {
  return size == 0 ? "no map" : std::to_string(size) + "²";
}

/// With the bits of its channels: "256², 8 bits".
std::string map_text(std::uint32_t size, std::uint32_t bits) {
  return map_text(size) + (size == 0 ? "" : ", " + std::to_string(bits) + " bits");
}

/// Bits of all maps of the grids.
std::string grid_bits() { return std::to_string(kGridBits) + " bits"; }

/// Name and faces, and where that was asked for ", 600 pixels on screen".
std::string title_of(const PlanChart& chart, const std::string& name) {
  return name + ", " + with_commas(chart.faces) + " faces" +
         (chart.screen == 0 ? "" : ", " + with_commas(chart.screen) + " pixels on screen");
}

/// Points that go into one curve, by rising bytes.
template <class Wanted>
Points points_of(const PlanChart& chart, const Wanted& wanted) {
  Points points;
  for (const PlanPoint& point : chart.points) {
    if (wanted(point)) points.push_back(&point);
  }
  std::sort(points.begin(), points.end(), [](const PlanPoint* a, const PlanPoint* b) {
    return a->bytes.total() < b->bytes.total();
  });
  return points;
}

Points front_of(const PlanChart& chart, PlanWay way) {
  return points_of(chart, [&](const PlanPoint& p) { return p.way == way && p.front; });
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

Json panel_of(const PlanChart& chart) {
  Json panel = plot_panel("Mean angle between rendered normals, degrees");
  panel["title"] = title_of(chart, chart.name);
  const auto add = [&](const std::string& title, const Json& look, const Points& points) {
    panel["curves"].push_back(plot_curve(
        title, look, points, [](const PlanPoint* p) { return kib(p->bytes); },
        [](const PlanPoint* p) { return p->degrees; }));
  };
  std::vector<std::uint32_t> sizes;
  for (const PlanPoint& point : chart.points) sizes.push_back(point.size);
  std::sort(sizes.begin(), sizes.end());
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const Points points = points_of(
        chart, [&](const PlanPoint& p) { return p.way == PlanWay::kiln && p.size == sizes[i]; });
    const double shade = static_cast<double>(i) / static_cast<double>(sizes.size());
    if (!points.empty()) add(map_text(sizes[i]), {{"thin", shade}}, points);
  }
  add("Kiln: the front of faces and sizes, " + grid_bits(), "kiln", front_of(chart, PlanWay::kiln));
  add("meshoptimizer and a plain bake: the front, " + grid_bits(), "paper",
      front_of(chart, PlanWay::plain));
  Json& rings = panel["rings"];
  rings["title"] = "the plans";
  rings["labels"] = Json::array();
  for (const PlanStand& stand : chart.plans) {
    const Candidate& made = stand.chosen;
    rings["x"].push_back(kib(made.bytes));
    rings["y"].push_back(stand.degrees);
    rings["labels"].push_back("for " + text_of(stand.wanted) + "°: " + with_commas(made.faces) +
                              " faces, " + map_text(made.size, made.bits));
  }
  return panel;
}

Json json_of(const PlanChart& chart) {
  const auto bytes = [](const LowPolyBytes& b) {
    return fields("vertices texels total", {b.vertices, b.texels, b.total()});
  };
  const auto known = [](double value) { return value > 0 ? Json(value) : Json(); };
  Json points = Json::array(), plans = Json::array();
  for (const PlanPoint& p : chart.points) {
    points.push_back(
        fields("way faces vertices size bits bytes mean_degrees front",
               {way_name(p.way), p.faces, p.vertices, p.size,
                p.size == 0 ? Json() : Json(kGridBits), bytes(p.bytes), p.degrees, p.front}));
  }
  for (const PlanStand& s : chart.plans) {
    const Candidate& c = s.chosen;
    plans.push_back(fields(
        "wanted_degrees reached faces vertices size samples bits match bytes planned_degrees "
        "mean_degrees front_bytes plain_front_bytes seconds",
        {s.wanted, s.reached, c.faces, c.vertices, c.size, c.samples, c.bits, c.method.name,
         bytes(c.bytes), c.measured, s.degrees, known(s.front_bytes), known(s.plain_bytes),
         s.seconds}));
  }
  return {{"points", points}, {"plans", plans}};
}

class PlansChart : public ChartKind {
 public:
  explicit PlansChart(const ChartArguments& a) : arguments_(a) {
    inputs_key = "meshes";
    inputs = a.meshes;
    options_.size = a.size;
    if (!a.screen.empty()) options_.screen = parse_pixels("--screen", a.screen);
    for (const std::string& text : a.max_errors) {
      // A bound with a name, as elsewhere: "normal=1.5".
      const std::string bound = normal_bound(text);
      options_.errors.push_back(parse_degrees("--max-error", bound.empty() ? text : bound));
    }
  }

  bool look(const Progress&) override {
    for (const std::string& path : inputs) {
      if (!is_readable_file(path)) load_high(path, {}, warnings);  // says what is wrong with it
    }
    return true;
  }

  void read(std::size_t i) override {
    dense_ =
        load_high(inputs[i], is_height_field(inputs[i]) ? arguments_.heights : HeightFieldOptions(),
                  warnings, load_options(arguments_, MeshSide::high));
    if (!dense_.heights) clean_high(dense_.mesh, CleanOptions(), warnings);
  }

  std::optional<Json> measure(const Device& device, std::size_t i,
                              const Progress& progress) override {
    std::optional<PlanChart> chart = run_plan_chart(device, dense_.mesh, options_, progress);
    if (!chart) return std::nullopt;
    warnings.insert(warnings.end(), chart->warnings.begin(), chart->warnings.end());
    Json json = {{"high", describe(dense_.mesh, inputs[i])}};
    json.update(json_of(*chart));
    charts_.push_back(std::move(*chart));
    return json;
  }

  std::string data() const override {
    Table table(
        "mesh|kind|faces|vertices|size|bits|bytes_vertices|bytes_texels|bytes|mean_degrees|front|"
        "wanted_degrees|front_bytes|plain_front_bytes|seconds");
    const auto known = [](double value) { return value > 0 ? Json(value) : Json(); };
    for (std::size_t i = 0; i < charts_.size(); ++i) {
      for (const PlanPoint& p : charts_[i].points) {
        table.add({i + 1, way_name(p.way), p.faces, p.vertices, p.size,
                   p.size == 0 ? Json() : Json(kGridBits), p.bytes.vertices, p.bytes.texels,
                   p.bytes.total(), p.degrees, p.front, "", "", "", ""});
      }
      for (const PlanStand& s : charts_[i].plans) {
        const Candidate& c = s.chosen;
        table.add({i + 1, "plan", c.faces, c.vertices, c.size, c.size == 0 ? Json() : Json(c.bits),
                   c.bytes.vertices, c.bytes.texels, c.bytes.total(), s.degrees, "", s.wanted,
                   known(s.front_bytes), known(s.plain_bytes), s.seconds});
      }
    }
    return table.csv();
  }

  std::string table(const DeviceInfo& device) const override {
    std::string text = "Bytes of low poly and maps against the mean angle of rendered normals, " +
                       markdown_cell(device.name) + ".\n";
    for (const PlanChart& chart : charts_) {
      Table plans(">wanted|>measured|>faces|map|>KiB|>over the grid's front|>over meshoptimizer's");
      for (const PlanStand& s : chart.plans) {
        const Candidate& c = s.chosen;
        plans.add({text_of(s.wanted) + "°", fixed_text(s.degrees, 3) + "°" + over(s),
                   with_commas(c.faces), map_text(c.size, c.bits), fixed_text(kib(c.bytes), 1),
                   times(s, s.front_bytes), times(s, s.plain_bytes)});
      }
      text += "\n## " + title_of(chart, markdown_cell(chart.name)) +
              "\n\nPlans; over: their bytes, times those of a front at the same angle. Maps of the "
              "fronts have " +
              grid_bits() + " a channel.\n\n" + plans.markdown();
      for (const PlanWay way : {PlanWay::kiln, PlanWay::plain}) {
        Table front(">faces|map|>KiB|>angle");
        for (const PlanPoint* p : front_of(chart, way)) {
          front.add({with_commas(p->faces), map_text(p->size), fixed_text(kib(p->bytes), 1),
                     fixed_text(p->degrees, 3) + "°"});
        }
        text += std::string("\nThe front of ") +
                (way == PlanWay::kiln ? "Kiln's" : "meshoptimizer's") + " grid:\n\n" +
                front.markdown();
      }
    }
    return text;
  }

  Json plot(const DeviceInfo&) const override {
    Json panels = Json::array(), ticks = Json::array();
    double least = 1e300, most = 0;
    for (const PlanChart& chart : charts_) {
      panels.push_back(panel_of(chart));
      const auto show = [&](const LowPolyBytes& bytes) {
        least = std::min(least, kib(bytes));
        most = std::max(most, kib(bytes));
      };
      for (const PlanPoint& point : chart.points) show(point.bytes);
      for (const PlanStand& stand : chart.plans) show(stand.chosen.bytes);
    }
    // Powers of four around all of it.
    double tick = 1.0 / 256;
    while (4 * tick <= least) tick *= 4;
    for (; ticks.size() < 2 || ticks.back().number() < most; tick *= 4) ticks.push_back(tick);
    return fields("kind title x_title x_ticks panels",
                  {"study", "Bytes against error: faces, map sizes and plans",
                   "KiB of low poly and maps", ticks, panels});
  }

  Json options() const override {
    return fields("size max_error screen", {options_.size, options_.errors,
                                            options_.screen == 0 ? Json() : Json(options_.screen)});
  }

  std::vector<std::string> lines() const override {
    std::vector<std::string> lines;
    for (const PlanChart& chart : charts_) {
      lines.push_back(chart.name + ", " + with_commas(chart.faces) + " faces, plans:");
      for (const PlanStand& s : chart.plans) {
        const Candidate& c = s.chosen;
        lines.push_back(formatted(
            "%7.3g degrees: %s faces, %s, %.1f KiB, measured %.3g%s; %s times the grid's front, "
            "%s times meshoptimizer's",
            s.wanted, with_commas(c.faces).c_str(), map_text(c.size, c.bits).c_str(), kib(c.bytes),
            s.degrees, over(s).c_str(), times(s, s.front_bytes).c_str(),
            times(s, s.plain_bytes).c_str()));
      }
    }
    return lines;
  }

 private:
  const ChartArguments& arguments_;
  PlanChartOptions options_;
  HighPolyInput dense_;
  std::vector<PlanChart> charts_;
};

}  // namespace

std::unique_ptr<ChartKind> chart_of_plans(const ChartArguments& arguments) {
  return std::make_unique<PlansChart>(arguments);
}

}  // namespace kiln::cli
