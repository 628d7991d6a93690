// How the error of rendered normals depends on a low poly's faces and its map's size.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

namespace kiln {

/// A model of e(level, size). Levels are low polys by falling number of faces.
class LightModel {
 public:
  struct Node {
    double plain = 0;  ///< Made to be seen without a map
    double bare = 0;   ///< Made for a map, without it: normals are others
    double limit = 0;  ///< With a map of endless size
  };
  /// \param faces  of each level
  /// \param look   finds out about one; called once each at most
  /// \param plain  the same without a map, which takes less time; null: as `look`
  LightModel(std::vector<double> faces, std::function<Node(std::size_t)> look,
             std::function<double(std::size_t)> plain = {});

  std::size_t count() const { return count_; }
  /// Levels from here on are not in question any more.
  void leave_out_from(std::size_t level) { count_ = std::min(count_, level); }
  /// Between levels that were looked at: the logarithm is linear in that of the number of faces. Looks where these
  /// are far apart.
  Node at(std::size_t level);
  /// The same from what is known, without a look: beyond the last levels that were, along the line of these.
  Node guess(std::size_t level) const;
  /// Looks at the very level.
  Node exactly(std::size_t level);
  /// The same without a map alone, between levels that were looked at: the rest follows from these.
  Node plainly(std::size_t level);
  /// The error without a map alone, of any level. Nothing is remembered.
  double glance(std::size_t level);
  /// What was found of a level's mesh as it is made. Looks are at meshes that are fitted roughly: what the two differ
  /// by at this level, they differ by at others.
  /// \param node  its `plain` may be 0, which is not known, where may_guess_plain()
  void know(std::size_t level, const Node& node);
  /// The same of one that is made without a map: what it does with one is still by looks.
  void know_plain(std::size_t level, double plain);
  /// Faces, more than those of any level, whose error with an endless map is a limit: along the line of the finest two
  /// that are known.
  double faces_for(double limit) const;
  /// By level, looks corrected.
  std::map<std::size_t, Node> known() const;
  bool knows(std::size_t level) const { return nodes_.contains(level); }
  /// Whether looks around a level, and a mesh that was made, tell its error without a map.
  bool may_guess_plain(std::size_t level) const;

  /// Another way to match: limits are no longer known.
  void forget();

  /// What a map is.
  enum class Map {
    own,   ///< Laid out for its size
    mip,   ///< A larger map's mip-map
    wide,  ///< Laid out for half its size
  };
  /// What a map turned out to reach. Mip-maps count until a map of their size is measured.
  void measured(std::size_t level, std::uint32_t size, double error, Map map = Map::own);
  /// size = 0: without a map.
  double expected(std::size_t level, std::uint32_t size);
  /// By guess().
  double guessed(std::size_t level, std::uint32_t size) const;

  /// The level of fewest faces within a bound, as long as all finer ones are within it, too.
  /// \param share   a level's error over the bound
  /// \param finest  levels before it are not looked at
  std::optional<std::size_t> fewest(const std::function<double(std::size_t)>& share,
                                    std::size_t finest = 0);

 private:
  struct Found {
    Node looked, made;
    bool is_looked = false, is_made = false, is_plain_made = false;
    bool is_plain_looked = false;  ///< Without a map alone
  };
  /// A mean of ratios, and of how many, by their logarithms.
  struct Shares {
    double sum = 0;
    int count = 0;
    void add(double made, double looked);
    double mean() const;
  };
  using Nodes = std::map<std::size_t, Found>;
  Node corrected(const Found& found) const;
  /// Along a line through the last of what is known.
  template <class Iterator>
  Node beyond(std::size_t level, Iterator last, Iterator end) const;
  /// Along the line of the nearest two of all, or of those that were looked at, uncorrected.
  Node between_looks(std::size_t level) const;
  Node on_line(std::size_t level, std::size_t a, const Node& at_a, std::size_t b,
               const Node& at_b) const;
  double with_map(const Node& node, std::size_t level, std::uint32_t size) const;
  /// 1 / what texels of a size add to the limit, where the mesh without a map is endlessly bad.
  double sharpness(std::size_t level, std::uint32_t size) const;
  struct Sharpness {
    std::size_t level = 0;
    double value = 0;
    Map map = Map::own;
  };
  /// Of maps of one size: more faces have more charts, so fewer texels are used.
  using Known = std::vector<Sharpness>;
  double at_level(const Known& known, std::size_t level) const;
  /// Of sharpness against faces, both as logarithms.
  double slope() const;

  std::vector<double> faces_;
  std::size_t count_;  ///< Of levels that are in question
  std::function<Node(std::size_t)> look_;
  std::function<double(std::size_t)> look_plain_;
  Nodes nodes_;
  /// Of meshes that were made over looks.
  Shares plain_share_, bare_share_, limit_share_;
  std::map<std::uint32_t, Known> sharpness_;
  double slope_ = 0;  ///< slope() of them
};

}  // namespace kiln
