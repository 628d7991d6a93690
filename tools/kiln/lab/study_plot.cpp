#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "arguments/parse.h"
#include "lab/plot.h"
#include "lab/study_output.h"

namespace kiln::cli {
namespace {

// Columns of study_data().
enum Column {
  views = 2,
  target_faces = 3,
  size = 5,
  mean = 7,
  p95 = 9,
  eight_bit = 12,
  distance_mean = 23,
  distance_p95 = 24,
  distance_max = 25
};

// Told apart by lightness too (after Okabe and Ito's colours for all kinds of sight).
constexpr const char* kPaper = "lw 3 pt 5 ps 1.4 lc rgb '#d55e00'";
constexpr const char* kKiln = "lw 3 pt 7 ps 1.5 lc rgb '#0072b2'";
constexpr const char* kRay = "lw 2.5 dt 2 pt 9 ps 1.4 lc rgb '#333333'";
constexpr const char* kNone = "lw 2 dt 3 pt 4 ps 1.2 lc rgb '#888888'";

/// "'study_views.csv' using (condition ? $x : NaN):y skip 1 ..."
std::string curve(const std::string& file, const std::string& condition, int x, int y,
                  const std::string& title, const std::string& style) {
  std::ostringstream text;
  text << "  '" << file << "'"
       << " skip 1 using (" << condition << " ? $" << x << " : NaN):" << y << " title "
       << quoted(title) << " with linespoints " << style;
  return text.str();
}

std::string of(Curve which) { return std::string("strcol(1) eq '") + curve_name(which) + "'"; }

std::string plot(const std::vector<std::string>& curves) {
  return "plot \\\n" + join(curves, ", \\\n") + "\n";
}

template <typename List>
std::string tics(const List& values) {
  std::vector<std::string> texts;
  for (const std::uint32_t value : values) {
    texts.push_back("'" + with_commas(value) + "' " + std::to_string(value));
  }
  return "set xtics (" + join(texts, ", ") + ")\n";
}

/// The axis upwards for such values: logarithmic where they span much, with few tics and plain numbers.
std::string y_axis(const std::string& label, std::vector<double> values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  if (!(*least > 0) || *most < 3 * *least) {
    return "unset logscale y\nset yrange [0:" + text_of(std::max(*most * 1.5, 1e-9)) +
           "]\nset ytics autofreq\nset ylabel '" + label + "'\n";
  }
  return "set logscale y 10\nset yrange [" + text_of(*least / 1.3) + ":" + text_of(*most * 1.25) +
         "]\nset ytics (" + logarithmic_tics() + ")\nset ylabel '" + label + " (logarithmic)'\n";
}

std::vector<double> means(const Study& study) {
  std::vector<double> values;
  for (const Setting& setting : study.settings) values.push_back(setting.normal.mean_degrees);
  return values;
}

std::string two_panels(const std::string& title) {
  return "set multiplot layout 1,2 title " + title +
         " font 'sans,20' offset 0,-0.4 margins 0.062,0.985,0.105,0.87 spacing 0.075,0.1\n";
}

std::string figure(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string size_text(std::uint32_t size) {
  return std::to_string(size) + "x" + std::to_string(size);
}

std::string views_script(const Study& study, const StudyOptions&, const std::string& mesh) {
  const Setting& ray = *select(study, Curve::ray).front();
  const Setting& none = *select(study, Curve::none).front();
  const std::string file = "study_views.csv";
  std::string text = plot_header(
      "study_views", 1800, 860,
      two_panels(quoted("Normal error against the number of views matched from: " + mesh + ", " +
                        with_commas(ray.faces) + " faces, " + size_text(ray.size) + " map")));
  text += "set logscale x 2\nset xrange [0.9:53]\n" + tics(kStudyViews);
  text += "set xlabel 'Depth views matched from (logarithmic)'\n";
  text += "set arrow 1 from 12, graph 0 to 12, graph 0.6 nohead lw 2 lc rgb '#bbbbbb' back\n";
  text += "set label 1 \"12: the paper's\\nchoice\" at 12.6, graph 0.4 left tc rgb '#777777'\n";
  const auto panel = [&](const std::string& label, int column, double ray_value, double none_value,
                         const std::string& unit) {
    std::vector<double> values;
    for (const Setting& setting : study.settings) {
      values.push_back(column == eight_bit ? setting.normal.mean_8bit
                                           : setting.normal.mean_degrees);
    }
    std::string part = y_axis(label, values) + "set key at graph 0.99, graph 0.86 right top\n";
    part +=
        plot({curve(file, of(Curve::paper), views, column, "paper: least depth difference", kPaper),
              curve(file, of(Curve::kiln), views, column, "Kiln: best angle, refined", kKiln),
              "  " + std::to_string(ray_value) + " title 'rays (no views): " + figure(ray_value) +
                  unit + "' with lines " + "lw 2.5 dt 2 lc rgb '#333333'",
              "  " + std::to_string(none_value) + " title 'no map: " + figure(none_value) + unit +
                  "' with lines lw 2 dt 3 lc rgb '#888888'"});
    return part;
  };
  text += panel("Mean angle between normals, degrees", mean, ray.normal.mean_degrees,
                none.normal.mean_degrees, " degrees");
  text += panel("Mean 8-bit difference of normals, 0 to 255", eight_bit, ray.normal.mean_8bit,
                none.normal.mean_8bit, "");
  return text + "unset multiplot\n";
}

std::string faces_script(const Study& study, const StudyOptions& options, const std::string& mesh) {
  const std::string file = "study_faces.csv";
  std::vector<std::uint32_t> faces;
  for (const Setting* s : select(study, Curve::kiln)) faces.push_back(s->target_faces);
  std::string text =
      plot_header("study_faces", 1800, 860,
                  two_panels(quoted("Errors against the light mesh's faces: " + mesh + ", " +
                                    std::to_string(options.views) + " views, " +
                                    size_text(options.size) + " map")));
  text += "set logscale x 2\n" + tics(faces);
  text += "set xrange [" + std::to_string(faces.front() * 0.85) + ":" +
          std::to_string(faces.back() * 1.18) + "]\n";
  text += "set xlabel 'Faces of the light mesh (logarithmic)'\nset key bottom left\n";
  std::vector<double> distances;
  for (const Setting* s : select(study, Curve::kiln)) {
    distances.push_back(100 * s->distance.mean / study.diagonal);
    distances.push_back(100 * s->distance.max / study.diagonal);
  }
  text += y_axis("Distance light to dense, % of the diagonal", distances);
  const std::string own = of(Curve::kiln);
  text += plot(
      {curve(file, own, target_faces, distance_max,
             "farthest (looked " + text_of(100 * study.max_distance / study.diagonal) + "% far)",
             "lw 2 dt 3 pt 8 ps 1.4 lc rgb '#7f3b08'"),
       curve(file, own, target_faces, distance_p95, "95% are nearer",
             "lw 2.5 dt 2 pt 5 ps 1.3 lc rgb '#d55e00'"),
       curve(file, own, target_faces, distance_mean, "mean", "lw 3 pt 7 ps 1.5 lc rgb '#e69f00'")});
  text += y_axis("Mean angle between normals, degrees", means(study));
  text += plot(
      {curve(file, of(Curve::none), target_faces, mean, "no map", kNone),
       curve(file, of(Curve::paper), target_faces, mean, "paper: least depth difference", kPaper),
       curve(file, own, target_faces, mean, "Kiln: best angle, refined", kKiln),
       curve(file, of(Curve::ray), target_faces, mean, "rays (no views)", kRay)});
  return text + "unset multiplot\n";
}

std::string size_script(const Study& study, const StudyOptions& options, const std::string& mesh) {
  const std::string file = "study_size.csv";
  const Study& s = study;
  std::vector<std::string> curves;
  std::vector<std::string> knees;
  const std::vector<const Setting*> without = select(s, Curve::none);
  for (std::size_t i = 0; i < without.size(); ++i) {
    const std::uint32_t faces = without[i]->target_faces;
    // From light to dark: an order, not names.
    const double t = without.size() < 2 ? 1 : static_cast<double>(i) / (without.size() - 1);
    char color[16];
    std::snprintf(
        color, sizeof color, "#%02x%02x%02x", static_cast<int>(std::lround(250 - 225 * t)),
        static_cast<int>(std::lround(180 - 150 * t)), static_cast<int>(std::lround(80 + 20 * t)));
    curves.push_back(curve(
        file, of(Curve::kiln) + " && $3 == " + std::to_string(faces), size, mean,
        with_commas(faces) + " faces (no map: " + figure(without[i]->normal.mean_degrees) + ")",
        std::string("lw 3 pt 7 ps 1.3 lc rgb '") + color + "'"));
    const std::vector<const Setting*> series = select(s, Curve::kiln, faces);
    const Setting* enough = levels_off(series);
    if (enough != series.back()) {
      knees.push_back(std::to_string(enough->size) + " " +
                      std::to_string(enough->normal.mean_degrees));
    }
  }
  std::string text = plot_header("study_size", 1300, 860,
                                 "set tmargin 4\nset label 99 " +
                                     quoted("Normal error against map size and faces: " + mesh +
                                            ", " + std::to_string(options.views) + " views") +
                                     " at screen 0.5, 0.955 center font 'sans,20'\n");
  text += "set logscale x 2\nset xrange [110:2400]\n" + tics(kStudySizes);
  text += "set xlabel 'Texels a side of the map (logarithmic)'\n";
  std::vector<double> shown;
  for (const Setting* setting : select(s, Curve::kiln))
    shown.push_back(setting->normal.mean_degrees);
  text += y_axis("Mean angle between normals, degrees", shown);
  text += "set key outside right center vertical Left reverse\n";
  if (!knees.empty()) {
    text += "$enough << EOD\n" + join(knees, "\n") + "\nEOD\n";
    // Its numbers are parted by blanks, so that the separator stands for the file alone.
    curves.push_back(
        "  $enough using (real(word(strcol(1), 1))):(real(word(strcol(1), 2))) title "
        "'larger maps gain less than 5%' with points pt 6 ps 3 lw 3 lc rgb '#009e73'");
  }
  return text + plot(curves);
}

}  // namespace

std::string study_script(const Study& study, const StudyOptions& options, const std::string& mesh) {
  switch (options.kind) {
    case StudyKind::faces:
      return faces_script(study, options, mesh);
    case StudyKind::size:
      return size_script(study, options, mesh);
    case StudyKind::views:
      break;
  }
  return views_script(study, options, mesh);
}

}  // namespace kiln::cli
