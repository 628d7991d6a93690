#include "lab/chart_page.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "lab/chart_labels.h"
#include "lab/plot.h"

namespace kiln::cli {
namespace {

// Columns of the data.
enum Column { group_column = 1, family_column = 3, seconds_column = 4 };

// Pixels.
constexpr double kWidth = 1900, kHead = 112, kFoot = 64, kRowHead = 106, kPanelHeight = 520;
constexpr double kRowFoot = 112, kLeft = 124, kBetween = 124, kRight = 30;
constexpr double kLabelFont = 15, kLabelHeight = 1.35 * kLabelFont;
constexpr double kMarkRadius = 10, kLegendFont = 15;
constexpr double kLetterWidth = 0.69;  // of the font's size, at most on average
constexpr const char* kFrontLook = "lw 6 lc rgb '#f0c070'";

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

// A clock may not see the shortest.
constexpr double kLeastSeconds = 1e-9;

Axis seconds_axis(const std::vector<ChartMark>& marks) {
  Axis axis{1e300, 0, true};
  for (const ChartMark& mark : marks) {
    for (const double run : mark.runs) {
      const double value = std::max(run, kLeastSeconds);
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
Axis error_axis(const std::vector<ChartMark>& marks) {
  double least = 1e300;
  double most = 0;
  bool has_zero = false;
  for (const ChartMark& mark : marks) {
    const double value = mark.error;
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

/// Those that nothing is better than, by seconds.
std::vector<const ChartMark*> front_marks(const std::vector<ChartMark>& marks) {
  std::vector<const ChartMark*> front;
  for (const ChartMark& mark : marks) {
    if (mark.on_front) front.push_back(&mark);
  }
  std::stable_sort(front.begin(), front.end(),
                   [](const ChartMark* a, const ChartMark* b) { return a->seconds < b->seconds; });
  return front;
}

/// Draws one panel.
class Panel {
 public:
  Panel(const ChartPage& page, const ChartPanel& panel, std::size_t group, const Point& corner,
        double width, double page_height)
      : page_(page),
        panel_(panel),
        group_(group),
        x_(seconds_axis(panel.marks)),
        y_(error_axis(panel.marks)),
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
  Point pixel(const ChartMark& mark) const { return pixel(mark, mark.seconds); }
  Point pixel(const ChartMark& mark, double seconds) const {
    return {corner_.x + width_ * x_.share(std::max(seconds, kLeastSeconds)),
            corner_.y + kPanelHeight * (1 - y_.share(mark.error))};
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
          << "]\nset xtics (" << logarithmic_tics() << ")\nset xlabel "
          << quoted(page_.seconds_title + " (logarithmic)") << "\n";
    text_ << "set yrange [" << exact_text(y_.least) << ":" << exact_text(y_.most) << "]\n";
    if (y_.logarithmic) {
      text_ << "set logscale y 10\nset ytics (" << logarithmic_tics(y_.broken);
      if (y_.zero > 0) text_ << ", '0' " << exact_text(y_.zero);
      text_ << ")\n";
    } else {
      text_ << "unset logscale y\nset ytics autofreq\n";
    }
    // Not the axis's own label, which comes over the tics where they are short.
    const Point beside = {corner_.x - 76, corner_.y + kPanelHeight / 2};
    text_ << "set label 4 "
          << quoted(panel_.unit + (y_.logarithmic ? " (logarithmic)" : " (not from 0)")) << " at "
          << screen(beside) << " center rotate by 90\n";
    const Point at = {corner_.x, corner_.y - 24};
    text_ << "set label 1 " << quoted(panel_.title) << " at " << screen(at)
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
    for (const ChartMark& mark : panel_.marks) {
      marks.push_back(pixel(mark));
      names.push_back(mark.label);
      const double bold = mark.on_front ? 1.12 : 1;
      sizes.push_back({{}, bold * text_width(names.back(), kLabelFont) + 8, kLabelHeight});
    }
    LabelScene scene;
    scene.panel = {
        {corner_.x + width_ / 2, corner_.y + kPanelHeight / 2}, width_ - 8, kPanelHeight - 8};
    scene.mark_radius = kMarkRadius;
    const std::vector<const ChartMark*> front = front_marks(panel_.marks);
    for (std::size_t i = 1; i < front.size(); ++i) {
      scene.lines.push_back({pixel(*front[i - 1]), pixel(*front[i])});
    }
    for (const ChartMark& mark : panel_.marks) {
      for (const double run : mark.runs) {
        scene.lines.push_back({pixel(mark), pixel(mark, run)});
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
      const bool on_front = panel_.marks[i].on_front;
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
    text << "'" << page_.name << ".csv' skip 1 using (" << condition << " && $" << group_column
         << " == " << group_ + 1 << " ? $" << seconds_column << " : NaN):";
    if (y_.zero > 0) {
      text << "($" << column << " > 0 ? $" << column << " : " << exact_text(y_.zero) << ")";
    } else {
      text << column;
    }
    return text.str();
  }

  void curves() {
    const int column = panel_.column;
    const std::string data = "$front_" + std::to_string(group_ + 1) + "_" + panel_.name;
    text_ << data << " << EOD\n";
    for (const ChartMark* mark : front_marks(panel_.marks)) {
      const double error = mark->error;
      text_ << exact_text(mark->seconds) << ","
            << exact_text(error > 0 || y_.zero == 0 ? error : y_.zero) << "\n";
    }
    text_ << "EOD\n";
    std::vector<std::string> parts = {"  " + data + " using 1:2 notitle with lines " + kFrontLook,
                                      "  " + points("1", column) + ":" +
                                          std::to_string(page_.least_column) + ":" +
                                          std::to_string(page_.most_column) +
                                          " notitle with xerrorbars pt -1 lw 1.5 lc rgb '#b0b0b0'"};
    for (const ChartStyle& style : page_.styles) {
      const std::string condition =
          "strcol(" + std::to_string(family_column) + ") eq '" + style.family + "'";
      parts.push_back("  " + points(condition, column) + " notitle with points " + style.mark);
    }
    text_ << "plot \\\n" << join(parts, ", \\\n") << "\n";
  }

  const ChartPage& page_;
  const ChartPanel& panel_;
  std::size_t group_;
  Axis x_, y_;
  Point corner_;
  double width_, page_height_;
  std::ostringstream text_;
};

/// What marks and the line mean, in one row at a height of the page, centred.
std::string legend(const std::vector<ChartStyle>& styles, double y, double page_height) {
  constexpr double kSample = 34;
  constexpr double kGap = 36;
  const std::string best = "the best: nothing else is both faster and closer";
  double width = kSample + text_width(best, kLegendFont);
  for (const ChartStyle& style : styles)
    width += kGap + kSample + text_width(style.title, kLegendFont);
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
  for (const ChartStyle& style : styles) {
    text << "set label " << next++ << " '' at " << at(x + kSample - 18) << " point " << style.mark
         << "\n";
    words(style.title);
  }
  return text.str();
}

}  // namespace

std::string runs_note(unsigned repeat) {
  return repeat == 1
             ? ", one run"
             : ", median of " + std::to_string(repeat) + " runs (thin lines: fastest to slowest)";
}

std::string page_script(const ChartPage& page) {
  constexpr std::size_t kColumns = 2;
  constexpr double kPanelRow = kPanelHeight + kRowFoot + 30;
  const auto row_height = [&](const ChartGroup& group) {
    return kRowHead + kPanelRow * static_cast<double>((group.panels.size() + 1) / kColumns);
  };
  double height = kHead + kFoot;
  for (const ChartGroup& group : page.groups) height += row_height(group);
  const double width = (kWidth - kLeft - kBetween - kRight) / kColumns;
  std::string text = plot_header(page.name, static_cast<int>(kWidth), static_cast<int>(height), "");
  text += "set encoding utf8\nunset key\nset multiplot\n";
  int next = 2000;
  const auto line = [&](const std::string& words, double y, const std::string& look) {
    char place[64];
    std::snprintf(place, sizeof place, " at screen 0.5, screen %.5f center ", 1 - y / height);
    return "set label " + std::to_string(next++) + " " + quoted(words) + place + look + "\n";
  };
  std::string titles = line(page.title, 36, "font 'sans,25'") +
                       line(page.subtitle, 76, "font 'sans,17' tc rgb '#555555'");
  titles += legend(page.styles, height - 34, height);
  double top = kHead;
  for (std::size_t i = 0; i < page.groups.size(); ++i) {
    const ChartGroup& group = page.groups[i];
    if (!group.note.empty()) {
      titles += line(group.note, top + 46, "font 'sans,15' tc rgb '#555555'");
    }
    titles += line(group.title, top + 18, "font 'sans:Bold,19'");
    for (std::size_t place = 0; place < group.panels.size(); ++place) {
      const Point corner = {kLeft + static_cast<double>(place % kColumns) * (width + kBetween),
                            top + kRowHead + static_cast<double>(place / kColumns) * kPanelRow};
      text += Panel(page, group.panels[place], i, corner, width, height).script(titles);
      titles.clear();
    }
    top += row_height(group);
  }
  return text + "unset multiplot\n";
}

}  // namespace kiln::cli
