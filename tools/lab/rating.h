// Ways to match rated on one pair of meshes: `kiln measure HIGH LOW --match ...`.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "lab/measuring.h"
#include "picture/plot.h"
#include "report/report.h"

namespace kiln::cli {

struct RatingOptions {
  std::vector<std::string> methods;  ///< As `kiln bake --match` has them
  /// Where those that take directions of visibility gather them: each is rated so often. Empty: where
  /// `kiln bake` does.
  std::vector<VisibilityAt> visibility_at;
  bool strict = false;  ///< All must do for the meshes. Else those that do not are left out
  UvOptions uv;
  /// How a method is baked, but for its name, size and what is kept. Empty: as by default.
  std::function<BakeOptions(const std::string& method)> bake_of;
  std::uint32_t size = 512;        ///< Texels a side
  std::uint32_t directions = 512;  ///< Of viewing rays
  std::uint32_t pixels = 512;      ///< A side of the pictures whose normals are measured
  Length max_distance = Length::share(0.02);
  bool pictures = false;
  std::vector<std::string> maps;  ///< Whose errors are told, as bake_of has them; may be none
  RenderOptions view;  ///< Of the pictures. Size 0: by how much of a picture the mesh fills
};

/// One way to match.
struct Rating {
  std::string
      name;  ///< In files: the method, and where it gathers directions if that was asked for
  std::string method;
  std::optional<VisibilityAt> visibility_at;
  BakeReport bake;
  MatchAssessment match;
  NormalError normal;  ///< Rendered normals against the high poly's, over held-out views
  // With pictures, one channel: each field as it lies on the low poly, and the error of the normal; degrees
  // -1 and -2 as normal_angles() has them.
  Image shape;                                 ///< Clay: shading for the others
  Image object_space, normalised, uniformity;  ///< Values as AssessmentFields, by pixel; -99 beside
  Image angle;
  Image normal_error;  ///< Mean angle of the rendered normals at each texel, degrees; -1: not seen
  std::vector<Recalled>
      recalled;  ///< Of HIGH's vertices, with pictures; empty where it cannot be told
};

struct Ratings {
  std::vector<Rating> rows;
  std::vector<std::string> maps;  ///< Whose errors BakeReport::errors has, where they state one
  std::vector<LeftOut> left_out;  ///< By methods' names
  NormalError without_map;
  double diagonal = 0;
  std::vector<Warning> warnings;
};

/// \returns nothing where progress said stop
/// \throws Error(input) where nothing matches, or (strict) a method does not do
std::optional<Ratings> rate(const Device& device, const Mesh& high, const Mesh& low,
                            const RatingOptions& options, const Progress& progress);

/// measure.png: a block of pictures a measure, each with its scale.
Plot ratings_plot(const Ratings& ratings);

/// HIGH coloured by what a match made of its vertices: green held, red lost, grey where it does not count.
Mesh recall_mesh(const Mesh& high, const Rating& row);

Json describe(const Ratings& ratings);
/// A table for people.
std::vector<std::string> ratings_table(const Ratings& ratings);

}  // namespace kiln::cli
