// Parses the statements of STL in text, for readers of whole files and of pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "asset/mesh_builder.h"
#include "io/file/text_scanner.h"

namespace kiln {

/// Parses statements, and passes them to the functions that a reader overrides, in the order of the file. Errors name the
/// line.
class StlTextParser {
 public:
  explicit StlTextParser(const MeshInput& input) : input_(input), scan_({}) {}
  StlTextParser(const StlTextParser&) = delete;
  StlTextParser& operator=(const StlTextParser&) = delete;
  virtual ~StlTextParser() = default;

  /// True for a file with these first bytes and this size if it is a text. A binary file's header may start with "solid",
  /// too, so its size decides first. \param head  the first 1,024 bytes, or all
  static bool is_text(std::string_view head, std::uint64_t bytes);
  /// Counts the facets that begin in some lines of a file.
  static std::uint64_t count_facets(std::string_view text);

  /// Parses whole lines. May be called for consecutive pieces of a file. \throws Error(input)
  void parse(std::string_view lines);
  /// \throws Error(input) if a facet does not end
  void finish() const;

 protected:
  /// \returns the index of the vertex at a position
  virtual std::uint32_t add_vertex(const MeshBuilder::Position& position) = 0;
  /// A facet with any number of corners.
  virtual void add_facet(const std::vector<std::uint32_t>& corners) = 0;
  /// The name of the facets that follow; not empty.
  virtual void set_solid(std::string_view name) = 0;

  const MeshInput& input() const { return input_; }
  std::uint64_t line() const { return scan_.line(); }
  std::string place() const { return scan_.place(); }

 private:
  void parse_vertex();

  const MeshInput& input_;
  TextScanner scan_;
  std::vector<std::uint32_t> corners_;
  bool in_facet_ = false;
};

}  // namespace kiln
