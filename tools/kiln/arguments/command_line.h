// The command line: commands, their options and what these accept. The library behind it (CLI11, in
// command_line.cpp alone) splits words into options; values are read, and refused, by the rows of options. Its headers
// take compilers seconds for each file that includes them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "options/values.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace kiln::cli {

/// An error in the words of a command line.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An option, flag or position of a command. Its command owns it.
class Option {
 public:
  using Words = OptionWords;
  /// Takes the values that were given, of which there is one at least. \throws UsageError, Error(usage)
  using Take = std::function<void(const Words&)>;

  /// The heading of help that it stands below.
  Option* group(std::string_view name);
  /// Help says this value.
  Option* default_text(const std::string& text);
  /// Parsing fails without it.
  Option* required();
  /// Words for the missing value in an error.
  Option* choices(std::vector<std::string> names);
  /// It may be given again; a position takes several words.
  Option* repeats();
  /// The separator between several values of one word.
  Option* delimiter(char between);
  /// Parsing fails where it is given without the other.
  Option* needs(const Option* other);
  /// Parsing fails where it is given with the other.
  Option* excludes(Option* other);
  /// Values, in the words of help.
  Option* type_name(std::string_view words);

  /// As help says it: "--size", or "HIGH" of a position.
  std::string get_name() const;
  /// Its names without dashes.
  const std::vector<std::string>& get_lnames() const;
  /// The text of help.
  std::string get_help() const;
  /// Number of times that it was given.
  std::size_t count() const;
  /// True if it is given without a value.
  bool is_flag() const;

 private:
  friend class Command;
  void take(const Words& words) const;

  CLI::Option* option_ = nullptr;
  Take take_;
  std::vector<std::string> choices_;
  std::vector<const Option*> needs_, excludes_;
  bool repeats_ = false, required_ = false;
};

/// A command, or the program with its commands.
class Command {
 public:
  /// The program, which needs one of its commands. \param footer  what help ends with
  Command(std::string_view description, std::string_view name, const std::string& version,
          const std::string& footer);
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  /// Adds an option of a name that starts with dashes, or a position, whose values a function takes.
  Option* add_option(std::string_view name, Option::Take take, std::string_view help);
  /// Adds a flag that may have a value after =; without one the function is given "true".
  Option* add_flag(std::string_view name, Option::Take take, std::string_view help);
  /// Adds a flag that prints a text, and ends the run.
  void add_text_flag(std::string_view name, std::function<std::string()> text,
                     const std::string& help);

  std::string get_name() const;
  /// Without --help.
  std::vector<const Option*> get_options() const;
  /// nullptr: there is none of that name.
  const Option* find_option(std::string_view name) const;

  /// Adds a command to the program.
  Command* add_command(std::string_view name, std::string_view description);
  /// All commands of the program.
  std::vector<Command*> commands() const;
  /// The program's command that was given; nullptr: none.
  Command* chosen() const;
  /// Parses the program's words and sets variables. \returns whether a command is to run: not after --help and --version,
  /// which it answers. \throws UsageError
  bool parse(std::vector<std::string> words);
  /// Words that parsing did not understand.
  std::vector<std::string> not_understood() const;

 private:
  explicit Command(CLI::App* app);
  Option* add(std::string_view name, Option::Take take, std::string_view help);
  std::string what_is_missing() const;
  void join_choices(std::vector<std::string>& words) const;

  std::unique_ptr<CLI::App> owned_;  ///< Of the program
  CLI::App* app_;
  std::vector<std::unique_ptr<Command>> commands_;
  std::vector<std::unique_ptr<Option>> options_;
};

}  // namespace kiln::cli
