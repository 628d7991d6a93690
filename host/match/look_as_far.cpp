#include "kiln/match.h"
#include "kiln/simplify.h"

namespace kiln {

void look_as_far(const SimplifyReport& made, MatchOptions& match) {
  if (match.max_distance || match.cage || match.cage_mesh != nullptr || match.saved != nullptr) {
    return;
  }
  if (!match.near_distance && made.near_distance() > 0) {
    match.near_distance = Length::share(made.near_distance());
  }
  // Without this, bakes search as far as for a low poly that lies close.
  if (made.search_distance() > SimplifyReport().search_distance()) {
    match.max_distance = Length::share(made.search_distance());
  }
}

}  // namespace kiln
