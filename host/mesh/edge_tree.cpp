#include "mesh/edge_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "base/parallel.h"
#include "mesh/ball_clip.h"
#include "mesh/box.h"

namespace kiln {
namespace {

constexpr std::size_t kPiecesPerLeaf = 4;  // Pieces in a leaf of the tree
// Largest half diagonal, as a multiple of the radius, of boxes that are counted without opening them.
constexpr double kMaxUnopenedShare = 1.0 / 16;
// A box whose diagonal exceeds this multiple of the radius fits into no ball: the ball's diameter and a margin for
// rounding.
constexpr double kMinOutsideDiagonal = 2.001;
constexpr float kCutAngle = 0;
// If a ball's boundary crosses more pieces than this, sums are not exact
constexpr std::size_t kMaxCutPieces = 4096;
// If a ball's boundary crosses more leaves than this, a sheet is sampled
constexpr std::size_t kMaxCutLeaves = 8192;
// Maximum number of boxes that are opened per level when sampling
constexpr std::size_t kMaxBoxesPerLevel = 64;
constexpr std::size_t kMaxCellPieces = 256;  // Maximum number of pieces that a cell lists
constexpr std::size_t kCachedCells = 128;    // Number of cells that each thread caches
// Pieces need no cutting if a ball around a random point of the mesh's box touches the boxes of at most this many
// pieces, on average.
constexpr double kMaxTouchedPieces = 8;
// Maximum mean number of pieces per triangle after cutting
constexpr std::size_t kMaxPiecesPerTriangle = 4;
// Smallest reach of a piece that is cut, as a multiple of the reach of a point. The reach is the set of centres whose
// balls may touch the piece, measured as the volume of the piece's box enlarged by the radius on all sides.
constexpr double kMinReachFactor = 8;
constexpr std::uint32_t kMaxHalvings = 60;
// Bound on the rounding error of a piece's clipped area, as a share of the squared radius.
constexpr double kRoundedArea = 1e-9;
// Share of the radius within which a piece counts as inside of a ball without testing its corners. The difference to 1
// exceeds the rounding error of their distances.
constexpr double kInsideShare = 1 - 1e-6;
// Maximum number of leaves that represent a Sheet
constexpr std::size_t kMaxSampledLeaves = 2048;

/// Squared distance from the origin to a box.
double squared_nearest_distance(const Vec3d& low, const Vec3d& high) {
  const Vec3d offset{std::max({low.x, -high.x, 0.0}), std::max({low.y, -high.y, 0.0}),
                     std::max({low.z, -high.z, 0.0})};
  return dot(offset, offset);
}
double squared_farthest_distance(const Vec3d& low, const Vec3d& high) {
  const Vec3d offset{std::max(-low.x, high.x), std::max(-low.y, high.y), std::max(-low.z, high.z)};
  return dot(offset, offset);
}

/// Volume of a box enlarged by a radius on all sides.
double enlarged_volume(const Box<Vec3>& box, double radius) {
  const Vec3d size = box.size();
  return (size.x + 2 * radius) * (size.y + 2 * radius) * (size.z + 2 * radius);
}

Box<Vec3> box_of(const BendPiece& piece) {
  Box<Vec3> box;
  for (const Vec3& p : piece.corner) box.add(p);
  return box;
}

/// Halves a piece across its longest edge until the reach of each part is small enough.
template <typename Body>
void cut(const BendPiece& piece, double radius, double most, std::uint32_t left, const Body& body) {
  if (left == 0 || enlarged_volume(box_of(piece), radius) <= most) return body(piece);
  std::size_t k = 0;
  double longest_squared = -1;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d offset = to_double(piece.corner[(i + 1) % 3]) - to_double(piece.corner[i]);
    if (dot(offset, offset) <= longest_squared) continue;
    longest_squared = dot(offset, offset);
    k = i;
  }
  const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
  const Vec3 middle = to_float((to_double(piece.corner[k]) + to_double(piece.corner[l])) * 0.5);
  BendPiece first = piece, second = piece;
  first.corner[l] = second.corner[k] = middle;
  first.angle[l] = second.angle[m] = kCutAngle;
  cut(first, radius, most, left - 1, body);
  cut(second, radius, most, left - 1, body);
}

/// Cuts long triangles with random directions, whose boxes nearly every ball would touch. The number of pieces is
/// limited.
std::vector<BendPiece> cut_long_triangles(std::vector<BendPiece> pieces, double radius) {
  Box<Vec3> all;
  for (const BendPiece& piece : pieces) all.join(box_of(piece));
  const auto cut_to_reach = [&](double most, const auto& body) {
    for (const BendPiece& piece : pieces) cut(piece, radius, most, kMaxHalvings, body);
  };
  const double max_reach = enlarged_volume(all, radius);
  // Cutting pieces that are not much longer than the radius would hardly reduce their reach.
  const double min_reach = enlarged_volume({{0, 0, 0}, {0, 0, 0}}, radius) * kMinReachFactor;
  double best = std::numeric_limits<double>::infinity();
  for (double most = max_reach; most >= min_reach; most /= 2) {
    double touched_pieces = 0;
    std::size_t count = 0;
    cut_to_reach(best, [&](const BendPiece& piece) {
      touched_pieces += enlarged_volume(box_of(piece), radius) / max_reach;
    });
    if (touched_pieces <= kMaxTouchedPieces) break;
    cut_to_reach(most, [&](const BendPiece&) { ++count; });
    if (count > kMaxPiecesPerTriangle * pieces.size()) break;
    best = most;
  }
  if (best > max_reach) return pieces;
  std::vector<BendPiece> cut_pieces;
  cut_to_reach(best, [&](const BendPiece& piece) { cut_pieces.push_back(piece); });
  return cut_pieces;
}

}  // namespace

CoarseNormal coarse_normal(const Vec3d& direction) {
  const double size = length(direction);
  if (!(size > 0)) return {};
  const auto step = [&](double part) {
    return static_cast<std::int8_t>(std::lround(127 * part / size));
  };
  return {step(direction.x), step(direction.y), step(direction.z)};
}

EdgeTree::EdgeTree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                   std::span<const std::uint8_t> usable,
                   std::span<const std::array<float, 3>> angle, double radius)
    : radius_(radius), squared_(radius * radius) {
  std::vector<BendPiece> pieces;
  pieces.reserve(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (usable[t] == 0) continue;
    const Triangle& c = triangles[t];
    const std::array<Vec3, 3> corner = {positions[c[0]], positions[c[1]], positions[c[2]]};
    const Vec3d first = to_double(corner[0]);
    pieces.push_back({.corner = corner,
                      .angle = angle[t],
                      .triangle = t,
                      .normal = coarse_normal(
                          cross(to_double(corner[1]) - first, to_double(corner[2]) - first))});
  }
  pieces = cut_long_triangles(std::move(pieces), radius);
  count_ = pieces.size();
  std::vector<PieceCentre> item_order(count_);
  for (std::uint32_t i = 0; i < count_; ++i) {
    Vec3d sum{};
    for (const Vec3& corner : pieces[i].corner) sum += to_double(corner);
    const Vec3 centre = to_float(sum * (1.0 / 3));
    item_order[i] = {{centre.x, centre.y, centre.z}, i};
  }
  while (count_ >> levels_ > kPiecesPerLeaf) ++levels_;
  for (std::uint32_t level = 0; level < levels_; ++level) {
    for_each_node_of(level, [&](std::size_t i) { split_node(item_order, level, i); });
  }
  nodes_.resize((std::size_t{2} << levels_) - 1);
  pieces_.resize(count_);
  for_each_node_of(levels_, [&](std::size_t leaf) {
    const auto begin =
        item_order.begin() + static_cast<std::ptrdiff_t>(first_piece_of(levels_, leaf));
    const auto end =
        item_order.begin() + static_cast<std::ptrdiff_t>(first_piece_of(levels_, leaf + 1));
    // Sorts the pieces of the leaf again, since the order of sums must not depend on nth_element().
    std::sort(begin, end,
              [](const PieceCentre& a, const PieceCentre& b) { return a.piece < b.piece; });
    for (auto item = begin; item != end; ++item) {
      pieces_[static_cast<std::size_t>(item - item_order.begin())] = pieces[item->piece];
    }
    fill_leaf(leaf);
  });
  for (std::uint32_t level = levels_; level-- > 0;) {
    for_each_node_of(level, [&](std::size_t i) { join(first_node_of_level(level) + i); });
  }
}

/// The candidates for balls around points in a cell. They are found for the whole cell, so they do not depend on
/// previous queries.
const EdgeTree::Cell& EdgeTree::cell_of(const Vec3d& centre, Scratch& scratch) const {
  const auto along = [&](double at) { return static_cast<std::int64_t>(std::floor(at / radius_)); };
  const std::array<std::int64_t, 3> at = {along(centre.x), along(centre.y), along(centre.z)};
  scratch.cells.resize(kCachedCells);
  const auto slot = static_cast<std::uint64_t>(at[0] + 7 * at[1] + 53 * at[2]) % kCachedCells;
  Cell& cell = scratch.cells[slot];
  if (cell.is_filled && cell.at == at) return cell;
  cell.at = at;
  cell.is_filled = true;
  const auto end = [&](double up) {
    return Vec3d{(static_cast<double>(at[0]) + up) * radius_,
                 (static_cast<double>(at[1]) + up) * radius_,
                 (static_cast<double>(at[2]) + up) * radius_};
  };
  // Margin as a share of the radius. It exceeds the rounding error of the division
  constexpr double kCellMargin = 1e-3;
  const Vec3d low = end(-kCellMargin), high = end(1 + kCellMargin);
  cell.lists_all_pieces = collect_pieces(low, high, cell, scratch.steps);
  if (!cell.lists_all_pieces) find_start_boxes(low, high, cell, scratch.steps);
  return cell;
}

/// Collects all pieces within one radius of a box.
/// \returns false if there are too many
bool EdgeTree::collect_pieces(const Vec3d& low, const Vec3d& high, Cell& cell,
                              std::uint64_t& steps) const {
  cell.pieces.clear();
  cell.spheres.clear();
  cell.normals = {};
  if (count_ == 0) return true;
  std::array<std::size_t, 66> stack{};  // Depth first: at most one node per tree level waits
  std::size_t height = 1;
  while (height != 0) {
    const std::size_t at = stack[--height];
    const Node& node = nodes_[at];
    ++steps;
    if (squared_nearest_distance(to_double(node.low) - high, to_double(node.high) - low) >=
        squared_)
      continue;
    if (at < first_node_of_level(levels_)) {
      stack[height++] = 2 * at + 2;
      stack[height++] = 2 * at + 1;
      continue;
    }
    const std::size_t leaf = at - first_node_of_level(levels_);
    for (std::size_t i = first_piece_of(levels_, leaf); i < first_piece_of(levels_, leaf + 1);
         ++i) {
      const Box<Vec3> box = box_of(pieces_[i]);
      ++steps;
      if (squared_nearest_distance(to_double(box.low) - high, to_double(box.high) - low) >=
          squared_)
        continue;
      cell.pieces.push_back(pieces_[i]);
      cell.normals.add(pieces_[i].normal);
      BoundingSphere& sphere = cell.spheres.emplace_back();
      sphere.centre = box.center();
      double farthest = 0;
      for (const Vec3& corner : pieces_[i].corner) {
        farthest = std::max(farthest, length(to_double(corner) - sphere.centre));
      }
      const double reach = radius_ + farthest;
      const double inside = std::max(0.0, radius_ * kInsideShare - farthest);
      sphere.squared_reach = reach * reach;
      sphere.squared_inside_distance = inside * inside;
    }
    if (cell.pieces.size() > kMaxCellPieces) return false;
  }
  return true;
}

/// Finds the boxes from which searches start for balls around points in a cell. Boxes that are too large to lie in a
/// ball are opened, and boxes that no such ball reaches are left out.
void EdgeTree::find_start_boxes(const Vec3d& low, const Vec3d& high, Cell& cell,
                                std::uint64_t& steps) const {
  cell.boxes.clear();
  std::array<std::size_t, 66> stack{};  // Depth first: at most one node per tree level waits
  std::size_t height = 1;
  while (height != 0) {
    const std::size_t at = stack[--height];
    const Node& node = nodes_[at];
    ++steps;
    if (squared_nearest_distance(to_double(node.low) - high, to_double(node.high) - low) >=
        squared_)
      continue;
    const bool must_open =
        length(to_double(node.high) - to_double(node.low)) > radius_ * kMinOutsideDiagonal;
    if (!must_open || at >= first_node_of_level(levels_)) {
      cell.boxes.push_back(at);
      if (cell.boxes.size() <= kMaxCutLeaves) continue;
      cell.boxes.assign(1, 0);
      return;
    }
    stack[height++] = 2 * at + 2;
    stack[height++] = 2 * at + 1;
  }
}

void NormalBox::add(const CoarseNormal& normal) { add(NormalBox{normal, normal}); }

void NormalBox::add(const NormalBox& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], other.low[k]);
    high[k] = std::max(high[k], other.high[k]);
  }
}

bool NormalBox::may_be_opposed(const Sheet& sheet) const {
  const auto min_component = [](double along, std::int8_t from, std::int8_t to) {
    return along * (along > 0 ? from : to);
  };
  return min_component(sheet.normal.x, low[0], high[0]) +
             min_component(sheet.normal.y, low[1], high[1]) +
             min_component(sheet.normal.z, low[2], high[2]) <
         Sheet::kMaxOpposedCosine * 127;
}

bool EdgeTree::may_hold_opposed(const Vec3d& centre, const Sheet& sheet, Scratch& scratch) const {
  const auto reaches = [&](const BendPiece& piece) {
    const Box<Vec3> box = box_of(piece);
    return squared_nearest_distance(to_double(box.low) - centre, to_double(box.high) - centre) <
           squared_;
  };
  const Cell& cell = cell_of(centre, scratch);
  if (cell.lists_all_pieces) {
    if (!cell.normals.may_be_opposed(sheet)) return false;
    scratch.steps += cell.pieces.size();
    return std::any_of(cell.pieces.begin(), cell.pieces.end(), [&](const BendPiece& piece) {
      return sheet.is_opposed(piece.normal) && reaches(piece);
    });
  }
  std::array<std::size_t, 66> stack{};  // Depth first: at most one node per tree level waits
  std::size_t height = 0;
  for (std::size_t box = 0; height != 0 || box < cell.boxes.size();) {
    const std::size_t at = height != 0 ? stack[--height] : cell.boxes[box++];
    const Node& node = nodes_[at];
    ++scratch.steps;
    if (!node.normals.may_be_opposed(sheet) ||
        squared_nearest_distance(to_double(node.low) - centre, to_double(node.high) - centre) >=
            squared_) {
      continue;
    }
    if (at < first_node_of_level(levels_)) {
      stack[height++] = 2 * at + 2;
      stack[height++] = 2 * at + 1;
      continue;
    }
    const std::size_t leaf = at - first_node_of_level(levels_);
    for (std::size_t i = first_piece_of(levels_, leaf); i < first_piece_of(levels_, leaf + 1);
         ++i) {
      ++scratch.steps;
      if (sheet.is_opposed(pieces_[i].normal) && reaches(pieces_[i])) return true;
    }
  }
  return false;
}

BendSums EdgeTree::within(const Vec3d& centre, const Sheet& sheet, Scratch& scratch) const {
  const Cell& cell = cell_of(centre, scratch);
  if (cell.lists_all_pieces) {
    return sum_by_pieces(cell, centre, scratch,
                         [&](const BendPiece& piece) { return sheet.belongs_to_sheet(piece); });
  }
  BendSums sums;
  bool has_left_out = false;
  std::array<std::size_t, 66> stack{};  // Depth first: at most one node per tree level waits
  std::size_t height = 0, leaf_count = 0;
  for (std::size_t box = 0; height != 0 || box < cell.boxes.size();) {
    const std::size_t at = height != 0 ? stack[--height] : cell.boxes[box++];
    const Node& node = nodes_[at];
    ++scratch.steps;
    if (squared_nearest_distance(to_double(node.low) - centre, to_double(node.high) - centre) >=
        squared_)
      continue;
    if (!node.normals.may_be_opposed(sheet) &&
        try_add_unopened(node, centre, /*coarse=*/false, sums))
      continue;
    if (at < first_node_of_level(levels_)) {
      stack[height++] = 2 * at + 2;
      stack[height++] = 2 * at + 1;
      continue;
    }
    if (++leaf_count > kMaxCutLeaves) return sum_by_leaves(sheet, centre, scratch);
    const BendSums counted =
        sum_leaf(at - first_node_of_level(levels_), sheet, centre, has_left_out);
    sums += counted;
    scratch.steps += kPiecesPerLeaf;
  }
  // If all pieces belong to the sheet, the result must be bit-identical to that of within() without a sheet, which sums
  // in another order.
  return has_left_out ? sums : within(centre, scratch);
}

/// Sums those pieces of a leaf that belong to the sheet.
/// \param has_left_out  set to true if some pieces do not belong to it
BendSums EdgeTree::sum_leaf(std::size_t leaf, const Sheet& sheet, const Vec3d& centre,
                            bool& has_left_out) const {
  BendSums sums;
  for (std::size_t i = first_piece_of(levels_, leaf); i < first_piece_of(levels_, leaf + 1); ++i) {
    bool is_cut_by_ball = false;
    const BendSums piece = clipped(pieces_[i], centre, is_cut_by_ball);
    if (sheet.belongs_to_sheet(pieces_[i])) {
      sums += piece;
    } else {
      has_left_out = has_left_out || piece.area > kRoundedArea * squared_;
    }
  }
  return sums;
}

/// Approximates the sums over a sheet that has very many pieces in a ball. Opens boxes level by level up to a limit.
/// Then the leaf in the middle of each box represents the box, scaled by its area.
BendSums EdgeTree::sum_by_leaves(const Sheet& sheet, const Vec3d& centre, Scratch& scratch) const {
  BendSums sums;
  const std::uint32_t level = open_levels(kMaxSampledLeaves, scratch, [&](const Node& node) {
    if (squared_nearest_distance(to_double(node.low) - centre, to_double(node.high) - centre) >=
        squared_)
      return true;
    return !node.normals.may_be_opposed(sheet) &&
           try_add_unopened(node, centre, /*coarse=*/true, sums);
  });
  for (const std::size_t at : scratch.next) {
    const std::size_t levels_below = levels_ - level;
    const std::size_t i = at - first_node_of_level(level);
    const std::size_t leaf = (i << levels_below) + ((std::size_t{1} << levels_below) >> 1);
    const Node& all = nodes_[first_node_of_level(levels_) + leaf];
    if (!(all.sums.area > 0)) continue;
    bool has_left_out = false;
    const BendSums counted = sum_leaf(leaf, sheet, centre, has_left_out);
    const double area_ratio = nodes_[at].sums.area / all.sums.area;
    sums += {counted.area * area_ratio, counted.bend * area_ratio};
  }
  scratch.steps += scratch.next.size() * kPiecesPerLeaf;
  return sums;
}

BendSums EdgeTree::within(const Vec3d& centre, Scratch& scratch) const {
  const Cell& cell = cell_of(centre, scratch);
  if (cell.lists_all_pieces)
    return sum_by_pieces(cell, centre, scratch, [](const BendPiece&) { return true; });
  BendSums sums;
  for (const bool coarse : {false, true}) {
    if (sum_by_boxes(cell, centre, coarse, scratch, sums)) return sums;
  }
  return sum_by_levels(centre, scratch);
}

/// Sums those candidates of a cell that belong to the sheet. Candidates that the ball's boundary may cross are clipped
/// together, eight at a time. The candidates are summed in their order.
template <typename Belongs>
BendSums EdgeTree::sum_by_pieces(const Cell& cell, const Vec3d& centre, Scratch& scratch,
                                 const Belongs& belongs) const {
  const std::size_t count = cell.pieces.size();
  scratch.sums.resize(std::max(scratch.sums.size(), count + 1));
  scratch.cut_pieces.resize(scratch.sums.size());
  scratch.cut_sums.resize(scratch.sums.size());
  std::size_t reached_count = 0, cut_count = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const BoundingSphere& sphere = cell.spheres[i];
    const BendPiece& piece = cell.pieces[i];
    const Vec3d offset = sphere.centre - centre;
    const double squared = dot(offset, offset);
    // Computed without branches, since the processor would often predict them wrongly.
    const bool is_reached = bool(squared < sphere.squared_reach) & belongs(piece);
    const bool is_cut = is_reached & !(squared < sphere.squared_inside_distance);
    scratch.sums[reached_count] = {piece.area, piece.bend};
    scratch.cut_pieces[cut_count] = &piece;
    scratch.cut_sums[cut_count] = static_cast<std::uint32_t>(reached_count);
    reached_count += is_reached ? 1 : 0;
    cut_count += is_cut ? 1 : 0;
  }
  BallBatch batch;
  for (std::size_t first = 0; first < cut_count; first += BallBatch::kLanes) {
    const std::size_t lanes = std::min(BallBatch::kLanes, cut_count - first);
    for (std::size_t i = 0; i < lanes; ++i) {
      const BendPiece& piece = *scratch.cut_pieces[first + i];
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d corner = to_double(piece.corner[k]) - centre;
        batch.corner[3 * k][i] = corner.x;
        batch.corner[3 * k + 1][i] = corner.y;
        batch.corner[3 * k + 2][i] = corner.z;
        batch.angle[k][i] = piece.angle[k];
      }
      batch.area[i] = piece.area;
      batch.bend[i] = piece.bend;
    }
    sum_in_ball(batch, squared_);
    for (std::size_t i = 0; i < lanes; ++i) {
      scratch.sums[scratch.cut_sums[first + i]] = {batch.area[i], batch.bend[i]};
    }
  }
  BendSums sums;
  for (std::size_t i = 0; i < reached_count; ++i) sums += scratch.sums[i];
  scratch.steps += count;
  return sums;
}

/// \param coarse  true: a small box on the boundary is not opened; instead, the share of the box that lies in the ball
///   is estimated
/// \returns false if this would take too long
bool EdgeTree::sum_by_boxes(const Cell& cell, const Vec3d& centre, bool coarse, Scratch& scratch,
                            BendSums& sums) const {
  sums = {};
  std::array<std::size_t, 66> stack{};  // Depth first: at most one node per tree level waits
  std::size_t height = 0, cut_count = 0, leaf_count = 0;
  for (std::size_t box = 0; height != 0 || box < cell.boxes.size();) {
    const std::size_t at = height != 0 ? stack[--height] : cell.boxes[box++];
    ++scratch.steps;
    if (try_add_unopened(nodes_[at], centre, coarse, sums)) continue;
    if (at < first_node_of_level(levels_)) {
      stack[height++] = 2 * at + 2;
      stack[height++] = 2 * at + 1;
      continue;
    }
    const std::size_t leaf = at - first_node_of_level(levels_);
    for (std::size_t i = first_piece_of(levels_, leaf); i < first_piece_of(levels_, leaf + 1);
         ++i) {
      bool is_cut_by_ball = false;
      sums += clipped(pieces_[i], centre, is_cut_by_ball);
      cut_count += is_cut_by_ball ? 1 : 0;
      ++scratch.steps;
    }
    if (cut_count > kMaxCutPieces || ++leaf_count > kMaxCutLeaves) return false;
  }
  return true;
}

/// Opens boxes from the root on, level by level, up to a number of boxes per level.
/// \param needs_no_opening  function that returns true for a box that need not be opened
/// \returns the tree level of the remaining boxes, which are in scratch.next
template <typename Settle>
std::uint32_t EdgeTree::open_levels(std::size_t most, Scratch& scratch,
                                    const Settle& needs_no_opening) const {
  scratch.front.assign(1, 0);
  for (std::uint32_t level = 0;; ++level) {
    scratch.steps += scratch.front.size();
    scratch.next.clear();
    for (const std::size_t at : scratch.front) {
      if (!needs_no_opening(nodes_[at])) scratch.next.push_back(at);
    }
    if (level == levels_ || scratch.next.empty() || scratch.next.size() > most / 2) return level;
    scratch.front.clear();
    for (const std::size_t at : scratch.next) {
      scratch.front.push_back(2 * at + 1);
      scratch.front.push_back(2 * at + 2);
    }
  }
}

/// Sums the pieces in a ball. Each box that remains unopened is represented by a piece in its middle.
BendSums EdgeTree::sum_by_levels(const Vec3d& centre, Scratch& scratch) const {
  BendSums sums;
  const std::uint32_t level = open_levels(kMaxBoxesPerLevel, scratch, [&](const Node& node) {
    return try_add_unopened(node, centre, /*coarse=*/true, sums);
  });
  for (const std::size_t at : scratch.next) {
    const std::size_t i = at - first_node_of_level(level);
    const std::size_t middle = (first_piece_of(level, i) + first_piece_of(level, i + 1)) / 2;
    const BallShares ball_shares = shares_in_ball(pieces_[middle], centre);
    sums += {nodes_[at].sums.area * ball_shares.area, nodes_[at].sums.bend * ball_shares.bend};
  }
  scratch.steps += scratch.next.size();
  return sums;
}

/// Adds the sums of a box without opening it, if that is possible.
/// \returns true if the box needs no further processing
bool EdgeTree::try_add_unopened(const Node& node, const Vec3d& centre, bool coarse,
                                BendSums& sums) const {
  const Vec3d low = to_double(node.low) - centre, high = to_double(node.high) - centre;
  if (squared_nearest_distance(low, high) >= squared_) return true;
  if (squared_farthest_distance(low, high) <= squared_) {
    sums += node.sums;
    return true;
  }
  if (!coarse) return false;
  const double half = length(high - low) / 2;
  if (half >= radius_ * kMaxUnopenedShare) return false;
  const double centre_distance = length(low + high) / 2;
  const double inside_share = std::clamp((radius_ + half - centre_distance) / (2 * half), 0.0, 1.0);
  sums += {node.sums.area * inside_share, node.sums.bend * inside_share};
  return true;
}

template <typename Body>
void EdgeTree::for_each_node_of(std::uint32_t level, const Body& body) const {
  // Each task has several thousand triangles, to outweigh the cost of threads.
  const std::size_t nodes_per_task = 1 + (std::size_t{1} << 13) / (1 + (count_ >> level));
  parallel_for(std::size_t{1} << level, nodes_per_task, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

/// Splits the pieces of a node into halves along the longest side of the bounding box of their centres.
void EdgeTree::split_node(std::vector<PieceCentre>& order, std::uint32_t level,
                          std::size_t i) const {
  const auto at = [&](std::size_t item) {
    return order.begin() + static_cast<std::ptrdiff_t>(item);
  };
  const auto begin = at(first_piece_of(level, i)), end = at(first_piece_of(level, i + 1));
  const auto middle = at(first_piece_of(level + 1, 2 * i + 1));
  std::array<float, 3> low = begin->centre, high = low;
  for (auto item = begin; item != end; ++item) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], item->centre[k]);
      high[k] = std::max(high[k], item->centre[k]);
    }
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  }
  std::nth_element(begin, middle, end, [axis](const PieceCentre& a, const PieceCentre& b) {
    return std::tie(a.centre[axis], a.piece) < std::tie(b.centre[axis], b.piece);
  });
}

void EdgeTree::fill_leaf(std::size_t leaf) {
  Box<Vec3> box;
  BendSums all;
  NormalBox normals;
  for (std::size_t i = first_piece_of(levels_, leaf); i < first_piece_of(levels_, leaf + 1); ++i) {
    BendPiece& piece = pieces_[i];
    std::array<Vec3d, 3> p{};
    for (std::size_t k = 0; k < 3; ++k) {
      box.add(piece.corner[k]);
      p[k] = to_double(piece.corner[k]);
    }
    normals.add(piece.normal);
    piece.area = static_cast<float>(length(cross(p[1] - p[0], p[2] - p[0])) / 2);
    double bend = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bend += piece.angle[k] * length(p[(k + 1) % 3] - p[k]) / 4;
    }
    piece.bend = static_cast<float>(bend);
    all += {piece.area, piece.bend};
  }
  nodes_[first_node_of_level(levels_) + leaf] = {box.low, box.high, all, normals};
}

void EdgeTree::join(std::size_t at) {
  const Node &left = nodes_[2 * at + 1], &right = nodes_[2 * at + 2];
  Box<Vec3> box{left.low, left.high};
  box.join({right.low, right.high});
  BendSums sums = left.sums;
  sums += right.sums;
  NormalBox normals = left.normals;
  normals.add(right.normals);
  nodes_[at] = {box.low, box.high, sums, normals};
}

namespace {

std::array<Vec3d, 3> corners(const BendPiece& piece, const Vec3d& from) {
  return {to_double(piece.corner[0]) - from, to_double(piece.corner[1]) - from,
          to_double(piece.corner[2]) - from};
}

}  // namespace

/// The sums of a piece within a ball.
/// \param cut  set to true if the ball's boundary may cross the piece
BendSums EdgeTree::clipped(const BendPiece& piece, const Vec3d& centre, bool& cut) const {
  return clipped(piece, corners(piece, centre), cut);
}

/// Variant of clipped() with the corners \p p relative to the ball's centre.
BendSums EdgeTree::clipped(const BendPiece& piece, const std::array<Vec3d, 3>& p, bool& cut) const {
  const auto inside = [&](const Vec3d& c) { return dot(c, c) <= squared_; };
  if (inside(p[0]) && inside(p[1]) && inside(p[2])) return {piece.area, piece.bend};
  Box<Vec3d> box;
  for (const Vec3d& corner : p) box.add(corner);
  if (squared_nearest_distance(box.low, box.high) >= squared_) return {};
  cut = true;
  const BallClip clip = clip_by_ball(p, squared_);
  BendSums sums{clip.area, 0};
  for (std::size_t k = 0; k < 3; ++k) {
    if (piece.angle[k] == kCutAngle || clip.edge_share[k] == 0) continue;
    sums.bend += piece.angle[k] * clip.edge_share[k] * length(p[(k + 1) % 3] - p[k]) / 4;
  }
  return sums;
}

/// The shares of a piece's area and bend that lie in the ball. They are used for the whole box that the piece
/// represents. The share of the bend is weighted by absolute angles, since angles of opposite signs may cancel out.
EdgeTree::BallShares EdgeTree::shares_in_ball(const BendPiece& piece, const Vec3d& centre) const {
  const std::array<Vec3d, 3> p = corners(piece, centre);
  const BallClip clip = clip_by_ball(p, squared_);
  const double area = piece.area > 0 ? std::min(1.0, clip.area / piece.area) : 0;
  double inside_weight = 0, all = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double weight = std::abs(double{piece.angle[k]}) * length(p[(k + 1) % 3] - p[k]);
    inside_weight += clip.edge_share[k] * weight;
    all += weight;
  }
  return {area, all > 0 ? inside_weight / all : area};
}

}  // namespace kiln
