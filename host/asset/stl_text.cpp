#include "asset/stl_text.h"

#include "asset/stl_triangles.h"
#include "base/lower_case.h"

namespace kiln {
namespace {

constexpr const char* kCorrectTheLine = "Correct the line or export the mesh again.";

/// True if a token is this keyword, in upper or lower case. The keyword is given in lower case.
bool is_word(std::string_view token, std::string_view keyword) {
  return token.size() == keyword.size() && lower_case(token) == keyword;
}

/// Reads the keyword of a statement. "end loop" becomes "endloop".
std::string keyword_at(TextScanner& scan) {
  const std::string word = lower_case(scan.token());
  if (word != "end") return word;
  const TextScanner token_start = scan;
  const std::string_view keyword = scan.token_in_line();
  for (const char* kind : {"solid", "facet", "loop"}) {
    if (is_word(keyword, kind)) return word + kind;
  }
  scan = token_start;
  return word;
}

}  // namespace

bool StlTextParser::is_text(std::string_view head, std::uint64_t bytes) {
  const bool sized =
      head.size() >= kStlHeaderBytes &&
      bytes == kStlHeaderBytes + kStlTriangleBytes * std::uint64_t{little_endian_word(
                                                         head.data() + kStlHeaderBytes - 4)};
  return !sized && is_word(TextScanner(head).token(), "solid") &&
         head.substr(0, 1024).find('\0') == std::string_view::npos;
}

std::uint64_t StlTextParser::count_facets(std::string_view text) {
  TextScanner scan(text);
  std::uint64_t facets = 0;
  bool ends = false;
  for (std::string_view word = scan.token(); !word.empty(); word = scan.token()) {
    if (!ends && is_word(word, "facet")) ++facets;
    ends = is_word(word, "end");
  }
  return facets;
}

void StlTextParser::parse(std::string_view lines) {
  scan_ = TextScanner(lines, 0, false, scan_.line());
  for (;;) {
    const std::string word = keyword_at(scan_);
    if (word.empty()) return;
    if (word == "vertex") {
      parse_vertex();
    } else if (word == "facet") {
      if (in_facet_) input_.fail(scan_.place(), "a facet starts inside another", kCorrectTheLine);
      in_facet_ = true;
      corners_.clear();
      scan_.rest_of_line();
    } else if (word == "endfacet") {
      if (!in_facet_) input_.fail(scan_.place(), "endfacet without facet", kCorrectTheLine);
      in_facet_ = false;
      add_facet(corners_);
    } else if (word == "solid" || word == "endsolid") {
      const std::string_view name = scan_.rest_of_line();
      if (word == "solid" && !name.empty()) set_solid(name);
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      input_.fail(scan_.place(),
                  "\"" + printable(word) + "\" is not a keyword of an ASCII STL file",
                  kCorrectTheLine);
    }
  }
}

void StlTextParser::parse_vertex() {
  if (!in_facet_) input_.fail(scan_.place(), "a vertex lies outside of any facet", kCorrectTheLine);
  MeshBuilder::Position p;
  for (double& value : p) {
    const std::string_view token = scan_.token_in_line();
    const auto number = to_double(token);
    if (!number) {
      input_.fail(scan_.place(),
                  "a vertex must have three numbers, but there is \"" + printable(token) + "\"",
                  kCorrectTheLine);
    }
    value = *number;
  }
  corners_.push_back(add_vertex(p));
}

void StlTextParser::finish() const {
  if (in_facet_)
    input_.fail(scan_.place(), "the file ends inside a facet (truncated)", "Copy it again.");
}

}  // namespace kiln
