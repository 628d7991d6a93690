// The error analysis of Wang, Froehlich and Goebel 2003 ("Fast Normal Map Generation for Simplified Meshes",
// section 5, figure 3): normal and distance errors against views, faces and map size.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "picture/plot.h"

namespace kiln::cli {

/// What varies.
enum class StudyKind { views, faces, size };

struct StudyOptions {
  StudyKind kind = StudyKind::views;
  std::uint32_t views = 12;     ///< Matched from, where they do not vary
  std::uint32_t view_size = 0;  ///< Pixels a side of a depth view; 0: by the density of HIGH
  std::uint32_t size = 1024;    ///< Texels a side of the map, where it does not vary
  std::uint32_t faces = 2000;   ///< Of the low poly, where they do not vary and none is given
  Length max_distance = Length::share(0.02);
  std::uint32_t pixels = 512;  ///< A side of the pictures measured
  bool z_up = false;           ///< In the error picture
};

constexpr std::array<std::uint32_t, 11> kStudyViews = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48};
constexpr std::array<std::uint32_t, 6> kStudyFaces = {500, 1000, 2000, 4000, 8000, 16000};
constexpr std::array<std::uint32_t, 5> kStudySizes = {128, 256, 512, 1024, 2048};

/// How a setting's map was made: one curve of a plot.
enum class Curve {
  paper,  ///< Depth views by the least depth difference, points left on the view's line
  kiln,  ///< Depth views as Kiln matches them by default: best angle, points moved to the normal's line
  ray,   ///< Rays along the low poly's normals: no views
  none,  ///< No map at all: the low poly's own normals
};
std::string curve_name(Curve curve);

/// One setting with its figures.
struct Setting {
  Curve curve = Curve::kiln;
  std::uint32_t views = 0;         ///< 0: not matched by views
  std::uint32_t target_faces = 0;  ///< As asked; of a given LOW: its own
  std::uint32_t size = 0;          ///< Texels a side; 0: no map

  std::uint64_t faces = 0;      ///< Of the low poly
  std::uint32_t view_size = 0;  ///< Pixels a side; 0: not matched by views
  NormalError normal;           ///< Over the held-out views
  DistanceError distance;       ///< Of the match, low poly to high poly, world units
  DepthError depth;             ///< Of the low poly over the held-out views; of StudyKind::faces
  double seconds_bake = 0, seconds_measure = 0;
  std::vector<Warning> warnings;
};

/// A setting's error where one looks from one held-out view.
struct ErrorPicture {
  std::size_t setting = 0;  ///< Index
  Image degrees;            ///< normal_angles()
};

struct Study {
  std::vector<Setting> settings;   ///< By curve, faces, map size, views
  std::vector<Vec3> held_out;      ///< Directions measured from
  double least_angle_degrees = 0;  ///< Between them and those matched from
  double diagonal = 0;             ///< Of HIGH, world units
  double max_distance = 0;         ///< World units
  Image original;                  ///< HIGH, from the picture's view
  ErrorPicture worst, best;        ///< By mean angle, of the settings matched by views
  std::vector<Warning> warnings;   ///< Of HIGH and of LOW
  double seconds_low = 0;          ///< Making low polys
  bool cancelled = false;
};

/// \param low  null: made from `high`
/// \throws Error(input) where HIGH has too few faces for a study of them
Study run_study(const Device& device, const Mesh& high, const Mesh* low,
                const StudyOptions& options, const Progress& progress);

/// "views", "faces" or "size".
const char* study_name(StudyKind kind);
/// Comma-separated values, a line a setting after a line of column names: the same bytes on every run.
std::string study_data(const Study& study);
/// The figures as curves.
Plot study_plot(const Study& study, const StudyOptions& options, const std::string& mesh);
/// HIGH, the setting with the largest mean error and that with the least, each pixel coloured by its error.
Plot error_plot(const Study& study, const StudyOptions& options);
/// Lines for a person: settings, and what the figures say.
std::vector<std::string> study_lines(const Study& study, const StudyOptions& options);
/// Settings and findings, for the report.
Json describe(const Study& study, const StudyOptions& options);

}  // namespace kiln::cli
