#include "arguments/bake_flags.h"
#include "arguments/bake_values.h"

namespace kiln::cli {

void add_view_flags(Command& command, BakeArguments& a) {
  const char* const group_views = "The depth views (--match views)";
  command
      .add_option("--views", a.views,
                  "N directions, spread evenly, or auto: chosen by what they see (default: 12; 1 "
                  "where both meshes are height fields)")
      ->group(group_views);
  command
      .add_option("--view", a.view,
                  "X,Y,Z: a view of your own, from the mesh to the viewer, beside the --views; may "
                  "be given "
                  "again (--views 0: only your own)")
      ->group(group_views);
  command
      .add_option("--view-size", a.view_size,
                  "Pixels a side of a view (default: by the density of HIGH, up to two a sample)")
      ->check(range(16U, 8192U))
      ->group(group_views);
  command
      .add_option("--view-criterion", a.view_criterion,
                  "Which view decides a sample: the least depth difference, the least true "
                  "distance, or the best angle")
      ->check(one_of(criterion_values()))
      ->capture_default_str()
      ->group(group_views);
  command
      .add_flag("--no-view-refine", a.no_view_refine,
                "Keep the point on the view's line (as in the paper) instead of moving it to the "
                "normal's")
      ->group(group_views);

  const char* const group_visibility = "Visibility (--match visibility, hybrid)";
  command
      .add_option("--visibility-at", a.visibility_at,
                  "Where directions are gathered: face (averaged at vertices), vertex or texel "
                  "(smoothed, across seams too)")
      ->check(one_of(visibility_at_values()))
      ->capture_default_str()
      ->group(group_visibility);
  command.add_option("--directions", a.directions, "How many directions look at LOW, 1 to 4096")
      ->check(range(1U, 4096U))
      ->capture_default_str()
      ->group(group_visibility);
  command
      .add_option("--visibility-test", a.visibility_test,
                  "What finds out what they see: views (pictures of LOW, as in the paper), rays "
                  "(no pixels, and slower), or auto: views")
      ->check(one_of(visibility_test_values()))
      ->capture_default_str()
      ->group(group_visibility);
  command.add_option("--visibility-size", a.visibility_size, "Pixels a side of these pictures")
      ->check(range(16U, 2048U))
      ->capture_default_str()
      ->group(group_visibility);
  command
      .add_option("--visibility-smooth", a.visibility_smooth,
                  "Rounds of smoothing texels' directions, 3 x 3 texels each")
      ->check(range(0U, 256U))
      ->capture_default_str()
      ->group(group_visibility);
  command
      .add_option("--view-weight", a.view_weight,
                  "From where LOW will be looked at: all, horizon, up (+Y), or a file with a line "
                  "\"X Y Z WEIGHT\" a direction to the viewer; each of --directions takes the "
                  "weight of the line nearest to it")
      ->capture_default_str()
      ->group(group_visibility);

  command
      .add_option("--visibility-clusters", a.visibility_clusters,
                  "K: with --match visibility, K maps (NAME_normal, NAME_normal_1, ...): where the "
                  "directions that see a texel scatter, a map for each cluster of them. "
                  "NAME_clusters.exr has the clusters' directions: use the map of the one that is "
                  "nearest to the view")
      ->check(range(1U, 4U))
      ->capture_default_str()
      ->group(group_visibility);
  command
      .add_option("--visibility-deviation", a.visibility_deviation,
                  "Standard deviation of directions, 0 to 1, above which they are parted into "
                  "clusters; that of an open plane is 0.745")
      ->check(range(0.0, 1.0))
      ->capture_default_str()
      ->group(group_visibility);
}

}  // namespace kiln::cli
