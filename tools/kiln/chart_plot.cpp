#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "chart_labels.h"
#include "chart_output.h"
#include "parse.h"
#include "plot.h"
#include "study.h"

namespace kiln::cli {
namespace {

// Columns of chart_data().
enum Column {
  pair_column = 1,
  family_column = 3,
  seconds_column = 4,
  first_error_column = 5,
  least_column = 13,
  most_column = 14
};

// Pixels.
constexpr double kWidth = 1900, kHead = 112, kFoot = 64, kRowHead = 106, kPanelHeight = 520;
constexpr double kRowFoot = 112, kLeft = 124, kBetween = 124, kRight = 30;
constexpr double kLabelFont = 15, kLabelHeight = 1.35 * kLabelFont;
constexpr double kMarkRadius = 10, kLegendFont = 15;
constexpr double kLetterWidth = 0.69;  // of the font's size, at most on average
constexpr const char* kFrontLook = "lw 6 lc rgb '#f0c070'";

struct Style {
  ChartFamily family;
  const char* title;
  const char* mark;
};
// Told apart by shape and lightness too (after Okabe and Ito's colours for all kinds of sight).
constexpr std::array<Style, 7> kStyles = {
    {{ChartFamily::rays, "rays", "pt 9 ps 2.3 lc rgb '#222222'"},
     {ChartFamily::views, "depth views", "pt 7 ps 2 lc rgb '#0072b2'"},
     {ChartFamily::views_rays, "views, then rays", "pt 13 ps 2.4 lc rgb '#009e73'"},
     {ChartFamily::paper, "views as in the paper", "pt 5 ps 1.8 lc rgb '#d55e00'"},
     {ChartFamily::closest, "nearest points", "pt 11 ps 2.3 lc rgb '#cc79a7'"},
     {ChartFamily::visibility, "visibility", "pt 15 ps 2.3 lc rgb '#8a6d00'"},
     {ChartFamily::uv, "same UVs", "pt 3 ps 2.3 lw 3 lc rgb '#56b4e9'"}}};

/// From values to pixels.
struct Axis {
  double least = 0, most = 1;  ///< At the ends
  bool logarithmic = false;
  double zero = 0;    ///< The value where 0 is shown; 0: at 0 itself, or nowhere
  double broken = 0;  ///< The value between that and all others

  double share(double value) const {
    if (!logarithmic) return (value - least) / (most - least);
    const double shown = value > 0 ? value : zero;
    return std::log(shown / least) / std::log(most / least);
  }
};

Axis seconds_axis(const ChartPair& pair) {
  Axis axis{1e300, 0, true};
  for (const ChartRow& row : pair.rows) {
    for (const ChartSeconds& run : row.runs) {
      // A clock may not see the shortest.
      const double value = std::max(run.correspondence(), 1e-9);
      axis.least = std::min(axis.least, value);
      axis.most = std::max(axis.most, value);
    }
  }
  const double widened = std::pow(axis.most / axis.least, 0.12) * 1.05;
  axis.least /= widened;
  axis.most *= widened;
  return axis;
}

/// Logarithmic where values span much; 0 then has a place of its own below the others.
Axis error_axis(const ChartPair& pair, ChartMeasure measure) {
  double least = 1e300;
  double most = 0;
  bool has_zero = false;
  for (const ChartRow& row : pair.rows) {
    const double value = row.error(measure);
    has_zero = has_zero || !(value > 0);
    if (value > 0) least = std::min(least, value);
    most = std::max(most, value);
  }
  if (!(most > 0)) return {0, 1};
  if (most < 4 * least) {
    const double margin = std::max(0.12 * (most - least), 0.02 * most);
    return {has_zero ? -margin : std::max(0.0, least - margin), most + margin};
  }
  const double step = std::pow(most / least, 0.1) * 1.05;
  Axis axis{least / step, most * step, true};
  if (has_zero) {
    axis.zero = least / std::pow(step, 1.8);
    axis.broken = least / std::pow(step, 0.8);
    axis.least = axis.zero / step;
  }
  return axis;
}

/// Letters as seen, of UTF-8.
double text_width(const std::string& text, double font) {
  return kLetterWidth * font *
         static_cast<double>(std::count_if(text.begin(), text.end(), [](char c) {
           return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
         }));
}

/// In the picture: where a number was chosen or an error is 0, it says so.
std::string label_of(const ChartRow& row, ChartMeasure measure) {
  std::string text = row.setting.label;
  if (row.report.views && row.setting.bake.views.automatic) {
    text = std::to_string(row.report.views->directions.size()) + " views chosen";
  }
  if (measure == ChartMeasure::map && row.setting.name == kChartReference) {
    text += ": the reference itself";
  }
  return text;
}

/// Draws one panel.
class Panel {
 public:
  Panel(const ChartPair& pair, std::size_t index, ChartMeasure measure, const Point& corner,
        double width, double page_height)
      : pair_(pair),
        index_(index),
        measure_(measure),
        x_(seconds_axis(pair)),
        y_(error_axis(pair, measure)),
        corner_(corner),
        width_(width),
        page_height_(page_height) {}

  /// \param titles  drawn along with it: lines of the script
  std::string script(const std::string& titles) {
    text_ << "unset label\nunset arrow\n" << titles;
    frame();
    axes();
    labels();
    curves();
    return text_.str();
  }

 private:
  Point pixel(const ChartRow& row) const { return pixel(row, row.seconds); }
  Point pixel(const ChartRow& row, const ChartSeconds& seconds) const {
    return {corner_.x + width_ * x_.share(std::max(seconds.correspondence(), 1e-9)),
            corner_.y + kPanelHeight * (1 - y_.share(row.error(measure_)))};
  }
  std::string screen(const Point& p) const {
    char text[64];
    std::snprintf(text, sizeof text, "screen %.5f, screen %.5f", p.x / kWidth,
                  1 - p.y / page_height_);
    return text;
  }

  void frame() {
    char text[256];
    std::snprintf(text, sizeof text,
                  "set lmargin at screen %.5f\nset rmargin at screen %.5f\n"
                  "set tmargin at screen %.5f\nset bmargin at screen %.5f\n",
                  corner_.x / kWidth, (corner_.x + width_) / kWidth, 1 - corner_.y / page_height_,
                  1 - (corner_.y + kPanelHeight) / page_height_);
    text_ << text;
  }

  void axes() {
    text_ << "set logscale x 10\nset xrange [" << exact_text(x_.least) << ":" << exact_text(x_.most)
          << "]\nset xtics (" << logarithmic_tics()
          << ")\nset xlabel 'Seconds to match, hierarchy and views included (logarithmic)'\n";
    std::string title;
    if (measure_ == ChartMeasure::map) {
      title = "Error of the map: angle to the reference (rays, 4×4 samples)";
    } else if (measure_ == ChartMeasure::object_distance) {
      title = "Distance in space from the light surface to its matches";
    } else if (measure_ == ChartMeasure::image_distance) {
      title = "Distance in pictures from all around, normalised";
    } else {
      char figure[32];
      std::snprintf(figure, sizeof figure, "%.2f", pair_.without_map.mean_degrees);
      title = "Error of the picture: rendered normals to the dense mesh's (no map: " +
              std::string(figure) + "°)";
    }
    const bool is_angle = measure_ == ChartMeasure::map || measure_ == ChartMeasure::picture;
    const std::string what = is_angle ? "Mean angle, degrees" : "Mean, % of the diagonal";
    text_ << "set yrange [" << exact_text(y_.least) << ":" << exact_text(y_.most) << "]\n";
    if (y_.logarithmic) {
      text_ << "set logscale y 10\nset ytics (" << logarithmic_tics(y_.broken);
      if (y_.zero > 0) text_ << ", '0' " << exact_text(y_.zero);
      text_ << ")\nset ylabel '" << what << " (logarithmic)' offset 1\n";
    } else {
      text_ << "unset logscale y\nset ytics autofreq\nset ylabel '" << what
            << " (not from 0)' offset 1\n";
    }
    const Point at = {corner_.x, corner_.y - 24};
    text_ << "set label 1 " << quoted(title) << " at " << screen(at)
          << " left font 'sans,16' tc rgb '#222222'\n";
    if (y_.zero > 0) {
      // The axis is broken here: below it is nothing but 0.
      const double y = corner_.y + kPanelHeight * (1 - y_.share(y_.broken));
      text_ << "set arrow 1 from " << screen({corner_.x, y}) << " to "
            << screen({corner_.x + width_, y}) << " nohead back lw 2 dt 2 lc rgb '#888888'\n"
            << "set label 3 'below this line: no error at all (0)' at "
            << screen({corner_.x + width_ - 8, y + 14})
            << " right font 'sans,13' tc rgb '#888888'\n";
    }
  }

  void labels() {
    std::vector<Point> marks;
    std::vector<Box> sizes;
    std::vector<std::string> names;
    for (const ChartRow& row : pair_.rows) {
      marks.push_back(pixel(row));
      names.push_back(label_of(row, measure_));
      const double bold = row.front(measure_) ? 1.12 : 1;
      sizes.push_back({{}, bold * text_width(names.back(), kLabelFont) + 8, kLabelHeight});
    }
    LabelScene scene;
    scene.panel = {
        {corner_.x + width_ / 2, corner_.y + kPanelHeight / 2}, width_ - 8, kPanelHeight - 8};
    scene.mark_radius = kMarkRadius;
    const std::vector<const ChartRow*> front = front_rows(pair_, measure_);
    for (std::size_t i = 1; i < front.size(); ++i) {
      scene.lines.push_back({pixel(*front[i - 1]), pixel(*front[i])});
    }
    for (const ChartRow& row : pair_.rows) {
      for (const ChartSeconds& run : row.runs) {
        scene.lines.push_back({pixel(row), pixel(row, run)});
      }
    }
    const Box better = {{corner_.x + 78, corner_.y + kPanelHeight - 42}, 148, 76};
    scene.kept.push_back(better);
    const bool is_free = std::none_of(marks.begin(), marks.end(), [&](const Point& mark) {
      return std::abs(mark.x - better.center.x) < better.width / 2 + kMarkRadius &&
             std::abs(mark.y - better.center.y) < better.height / 2 + kMarkRadius;
    });
    if (is_free) better_arrow();
    const std::vector<PlacedLabel> places = place_labels(marks, sizes, scene);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Box& box = places[i].box;
      const bool on_front = pair_.rows[i].front(measure_);
      text_ << "set label " << 10 + i << " " << quoted(names[i]) << " at " << screen(box.center)
            << " center front font 'sans" << (on_front ? ":Bold" : "") << "," << text_of(kLabelFont)
            << "' tc rgb '" << (on_front ? "#111111" : "#555555") << "'\n";
      if (!places[i].leader) continue;
      const Point end = {
          std::clamp(marks[i].x, box.center.x - box.width / 2, box.center.x + box.width / 2),
          std::clamp(marks[i].y, box.center.y - box.height / 2, box.center.y + box.height / 2)};
      text_ << "set arrow " << 10 + i << " from " << screen(marks[i]) << " to " << screen(end)
            << " nohead back lw 1 lc rgb '#999999'\n";
    }
  }

  void better_arrow() {
    const Point tip = {corner_.x + 14, corner_.y + kPanelHeight - 14};
    const Point tail = {tip.x + 42, tip.y - 42};
    text_ << "set arrow 2 from " << screen(tail) << " to " << screen(tip)
          << " head filled size screen 0.008,20 lw 3 lc rgb '#bbbbbb'\n"
          << "set label 2 'better' at " << screen({tail.x + 8, tail.y + 4})
          << " left font 'sans,15' tc rgb '#999999'\n";
  }

  /// A column's values of this panel, as gnuplot reads them.
  std::string points(const std::string& condition, int column) const {
    std::ostringstream text;
    text << "'" << kChartName << ".csv' skip 1 using (" << condition << " && $" << pair_column
         << " == " << index_ + 1 << " ? $" << seconds_column << " : NaN):";
    if (y_.zero > 0) {
      text << "($" << column << " > 0 ? $" << column << " : " << exact_text(y_.zero) << ")";
    } else {
      text << column;
    }
    return text.str();
  }

  void curves() {
    const int column = first_error_column + static_cast<int>(measure_);
    const std::string data = "$front_" + std::to_string(index_ + 1) + "_" + measure_name(measure_);
    text_ << data << " << EOD\n";
    for (const ChartRow* row : front_rows(pair_, measure_)) {
      const double error = row->error(measure_);
      text_ << exact_text(row->seconds.correspondence()) << ","
            << exact_text(error > 0 || y_.zero == 0 ? error : y_.zero) << "\n";
    }
    text_ << "EOD\n";
    std::vector<std::string> parts = {
        "  " + data + " using 1:2 notitle with lines " + kFrontLook,
        "  " + points("1", column) + ":" + std::to_string(least_column) + ":" +
            std::to_string(most_column) + " notitle with xerrorbars pt -1 lw 1.5 lc rgb '#b0b0b0'"};
    for (const Style& style : kStyles) {
      const std::string condition = std::string("strcol(") + std::to_string(family_column) +
                                    ") eq '" + family_name(style.family) + "'";
      parts.push_back("  " + points(condition, column) + " notitle with points " + style.mark);
    }
    text_ << "plot \\\n" << join(parts, ", \\\n") << "\n";
  }

  const ChartPair& pair_;
  std::size_t index_;
  ChartMeasure measure_;
  Axis x_, y_;
  Point corner_;
  double width_, page_height_;
  std::ostringstream text_;
};

/// What marks and the line mean, in one row at a height of the page, centred.
std::string legend(const std::vector<ChartPair>& pairs, double y, double page_height) {
  std::vector<Style> styles;
  for (const Style& style : kStyles) {
    const bool occurs = std::any_of(pairs.begin(), pairs.end(), [&](const ChartPair& pair) {
      return std::any_of(pair.rows.begin(), pair.rows.end(),
                         [&](const ChartRow& row) { return row.setting.family == style.family; });
    });
    if (occurs) styles.push_back(style);
  }
  constexpr double kSample = 34;
  constexpr double kGap = 36;
  const std::string best = "the best: nothing else is both faster and closer";
  double width = kSample + text_width(best, kLegendFont);
  for (const Style& style : styles) width += kGap + kSample + text_width(style.title, kLegendFont);
  double x = (kWidth - width) / 2;
  int next = 3000;
  std::ostringstream text;
  const auto at = [&](double px) {
    return "screen " + exact_text(px / kWidth) + ", screen " + exact_text(1 - y / page_height);
  };
  const auto words = [&](const std::string& what) {
    text << "set label " << next++ << " " << quoted(what) << " at " << at(x + kSample)
         << " left font 'sans," << kLegendFont << "'\n";
    x += kSample + text_width(what, kLegendFont) + kGap;
  };
  text << "set arrow 3000 from " << at(x) << " to " << at(x + kSample - 8) << " nohead "
       << kFrontLook << "\n";
  words(best);
  for (const Style& style : styles) {
    text << "set label " << next++ << " '' at " << at(x + kSample - 18) << " point " << style.mark
         << "\n";
    words(style.title);
  }
  return text.str();
}

}  // namespace

std::string chart_script(const std::vector<ChartPair>& pairs, const ChartOptions& options,
                         const DeviceInfo& device) {
  constexpr std::size_t kColumns = 2, kPanelRows = kChartMeasures.size() / kColumns;
  constexpr double kPanelRow = kPanelHeight + kRowFoot + 30;
  const double row_height = kRowHead + kPanelRow * kPanelRows;
  const double height = kHead + row_height * static_cast<double>(pairs.size()) + kFoot;
  const double width = (kWidth - kLeft - kBetween - kRight) / kColumns;
  std::string text =
      plot_header(kChartName, static_cast<int>(kWidth), static_cast<int>(height), "");
  text += "set encoding utf8\nunset key\nset multiplot\n";
  int next = 2000;
  const auto line = [&](const std::string& words, double y, const std::string& look) {
    char place[64];
    std::snprintf(place, sizeof place, " at screen 0.5, screen %.5f center ", 1 - y / height);
    return "set label " + std::to_string(next++) + " " + quoted(words) + place + look + "\n";
  };
  const std::string size = std::to_string(options.size);
  std::string titles =
      line("Normal maps: speed against accuracy of every way to match", 36, "font 'sans,25'") +
      line(size + " × " + size + " maps, " + device.name +
               (options.repeat == 1 ? ", one run"
                                    : ", median of " + std::to_string(options.repeat) +
                                          " runs (thin lines: fastest to slowest)"),
           76, "font 'sans,17' tc rgb '#555555'");
  titles += legend(pairs, height - 34, height);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double top = kHead + row_height * static_cast<double>(i);
    std::string default_size;
    for (const ChartRow& row : pairs[i].rows) {
      if (row.report.views && row.setting.bake.views.size == 0) {
        default_size = std::to_string(row.report.views->size) + "²";
      }
    }
    if (!default_size.empty()) {
      titles += line("views of " + default_size + " pixels where none are named", top + 46,
                     "font 'sans,15' tc rgb '#555555'");
    }
    titles += line(pairs[i].high_name + ", " + with_commas(pairs[i].high_faces) + " faces, to " +
                       pairs[i].low_name + ", " + with_commas(pairs[i].low_faces),
                   top + 18, "font 'sans:Bold,19'");
    for (const ChartMeasure measure : kChartMeasures) {
      const auto place = static_cast<std::size_t>(measure);
      const Point corner = {kLeft + static_cast<double>(place % kColumns) * (width + kBetween),
                            top + kRowHead + static_cast<double>(place / kColumns) * kPanelRow};
      Panel panel(pairs[i], i, measure, corner, width, height);
      text += panel.script(titles);
      titles.clear();
    }
  }
  return text + "unset multiplot\n";
}

}  // namespace kiln::cli
