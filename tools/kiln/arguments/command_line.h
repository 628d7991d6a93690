// The command line: commands and their options. CLI11 assigns words to options; the rows of the option table parse and
// check the values. CLI11 is hidden in command_line.cpp, since its headers add seconds to the compile time of each file
// that includes them.
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

/// An error in the syntax of a command line.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An option, flag or positional argument of a command, which owns it.
class Option {
 public:
  using Words = OptionWords;
  /// Receives the given values, at least one. \throws UsageError, Error(usage)
  using Take = std::function<void(const Words&)>;

  /// Sets its heading in help.
  Option* group(std::string_view name);
  /// Sets the default value that help shows.
  Option* default_text(const std::string& text);
  /// Makes it required: parsing fails without it.
  Option* required();
  /// Sets the names that the error for a missing value lists.
  Option* choices(std::vector<std::string> names);
  /// Allows repetition; a positional argument then takes several words.
  Option* repeats();
  /// Sets the separator of several values in one word.
  Option* delimiter(char between);
  /// Requires another option: parsing fails if only this one is given.
  Option* needs(const Option* other);
  /// Excludes another option: parsing fails if both are given.
  Option* excludes(Option* other);
  /// Sets the placeholder of its value in help.
  Option* type_name(std::string_view words);

  /// Its name in help: "--size", or "HIGH" for a positional argument.
  std::string get_name() const;
  /// Its names without dashes.
  const std::vector<std::string>& get_lnames() const;
  /// Its help text.
  std::string get_help() const;
  /// How often it was given.
  std::size_t count() const;
  /// True if it takes no value.
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
  /// The program, which requires one of its commands. \param footer last lines of help
  Command(std::string_view description, std::string_view name, const std::string& version,
          const std::string& footer);
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  /// Adds an option if the name starts with dashes, else a positional argument. \param take receives the values
  Option* add_option(std::string_view name, Option::Take take, std::string_view help);
  /// Adds a flag with an optional value after `=`. Without one, `take` receives "true".
  Option* add_flag(std::string_view name, Option::Take take, std::string_view help);
  /// Adds a flag that prints a text and exits.
  void add_text_flag(std::string_view name, std::function<std::string()> text,
                     const std::string& help);

  std::string get_name() const;
  /// All options but --help.
  std::vector<const Option*> get_options() const;
  /// The option of a name; nullptr if there is none.
  const Option* find_option(std::string_view name) const;

  /// Adds a command to the program.
  Command* add_command(std::string_view name, std::string_view description);
  /// All commands of the program.
  std::vector<Command*> commands() const;
  /// The command given on the command line; nullptr if there was none.
  Command* chosen() const;
  /// Parses the program's words and passes values to the options. \returns false if nothing remains to run, as after
  /// --help and --version. \throws UsageError
  bool parse(std::vector<std::string> words);
  /// Words that no option or command accepted.
  std::vector<std::string> not_understood() const;

 private:
  explicit Command(CLI::App* app);
  Option* add(std::string_view name, Option::Take take, std::string_view help);
  std::string what_is_missing() const;
  void join_choices(std::vector<std::string>& words) const;

  std::unique_ptr<CLI::App> owned_;  ///< Set for the program, null for commands
  CLI::App* app_;
  std::vector<std::unique_ptr<Command>> commands_;
  std::vector<std::unique_ptr<Option>> options_;
};

}  // namespace kiln::cli
