#include "kiln/match.h"
#include "kiln/simplify.h"

namespace kiln {

void set_search_distances(const SimplifyReport& made, MatchOptions& match) {
  if (match.max_distance || match.cage || match.cage_mesh != nullptr || match.saved != nullptr) {
    return;
  }
  if (!match.near_distance && made.near_distance() > 0) {
    match.near_distance = Length::share(made.near_distance());
  }
  // Otherwise the default search distance suffices, which suits low polys that are close to the high
  // poly.
  if (made.search_distance() > SimplifyReport().search_distance()) {
    match.max_distance = Length::share(made.search_distance());
  }
}

}  // namespace kiln
