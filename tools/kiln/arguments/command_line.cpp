#include "arguments/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <utility>

#include "kiln/error.h"
#include "kiln/option_error.h"
#include "options/near_words.h"

namespace kiln::cli {

Option* Option::group(std::string_view name) {
  option_->group(std::string(name));
  return this;
}
Option* Option::default_text(const std::string& text) {
  option_->default_str(text);
  return this;
}
Option* Option::required() {
  required_ = true;
  option_->required();
  return this;
}
Option* Option::choices(std::vector<std::string> names) {
  value_names_ = std::move(names);
  return this;
}
Option* Option::repeats() {
  repeats_ = true;
  if (option_->get_positional()) option_->expected(CLI::detail::expected_max_vector_size);
  return this;
}
Option* Option::delimiter(char between) {
  option_->delimiter(between);
  return this;
}
Option* Option::needs(const Option* other) {
  needs_.push_back(other);
  option_->needs(other->option_);
  return this;
}
Option* Option::excludes(Option* other) {
  excludes_.push_back(other);
  option_->excludes(other->option_);
  return this;
}
Option* Option::type_name(std::string_view words) {
  option_->type_name(std::string(words));
  return this;
}

std::string Option::get_name() const { return option_->get_name(); }
const std::vector<std::string>& Option::get_lnames() const { return option_->get_lnames(); }
std::string Option::get_help() const { return option_->get_description(); }
std::size_t Option::count() const { return option_->count(); }
bool Option::is_flag() const { return option_->get_expected_max() == 0; }

void Option::take(const Words& words) const {
  const std::string name = get_name();
  if (words.size() > 1 && !repeats_ && !is_flag()) {
    throw UsageError(name + " was given " + std::to_string(words.size()) + " times: give it once");
  }
  for (const std::string& word : words) {
    if (word.empty()) {
      throw UsageError(name + (value_names_.empty()
                                   ? " has no value: give one, or leave the option out"
                                   : ": " + unknown_word_error(word, value_names_)));
    }
  }
  try {
    receive_values_(words);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::usage) throw;
    throw UsageError(error.message().text(option_as_flag));
  }
}

Command::Command(std::string_view description, std::string_view name, const std::string& version,
                 const std::string& footer)
    : owned_app_(std::make_unique<CLI::App>(std::string(description), std::string(name))),
      app_(owned_app_.get()) {
  app_->set_version_flag("--version", version);
  app_->allow_windows_style_options(
      false);  // `/scans/rock.ply` is a path, and not the flag --scans
  app_->require_subcommand(1);
  app_->footer(footer);
}
Command::Command(CLI::App* app) : app_(app) {}
Command::~Command() = default;

Option* Command::add(std::string_view name, Option::ValueCallback take, std::string_view help) {
  Option* const option = options_.emplace_back(std::make_unique<Option>()).get();
  option->receive_values_ = std::move(take);
  option->option_ = app_->add_option(
      std::string(name),
      [option](const CLI::results_t& words) {
        option->take(words);
        return true;
      },
      std::string(help));
  option->option_->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  return option;
}

Option* Command::add_option(std::string_view name, Option::ValueCallback take,
                            std::string_view help) {
  return add(name, std::move(take), help)->type_name("TEXT");
}

Option* Command::add_flag(std::string_view name, Option::ValueCallback take,
                          std::string_view help) {
  Option* const option = add(name, std::move(take), help);
  option->option_->expected(0);
  return option;
}
void Command::add_text_flag(std::string_view name, std::function<std::string()> text,
                            const std::string& help) {
  // CLI11 only allows one version flag per command, so further ones are made as callbacks.
  app_->add_flag_callback(
          std::string(name), [text = std::move(text)] { throw CLI::CallForVersion(text(), 0); },
          help)
      ->configurable(false);
}

std::string Command::get_name() const { return app_->get_name(); }

std::vector<const Option*> Command::get_options() const {
  std::vector<const Option*> options;
  for (const std::unique_ptr<Option>& option : options_) options.push_back(option.get());
  return options;
}
const Option* Command::find_option(std::string_view name) const {
  const auto found = std::find_if(options_.begin(), options_.end(), [&](const auto& option) {
    return option->option_->check_name(std::string(name));
  });
  return found == options_.end() ? nullptr : found->get();
}

Command* Command::add_command(std::string_view name, std::string_view description) {
  CLI::App* app = app_->add_subcommand(std::string(name), std::string(description));
  commands_.push_back(std::unique_ptr<Command>(new Command(app)));
  return commands_.back().get();
}

std::vector<Command*> Command::commands() const {
  std::vector<Command*> commands;
  for (const std::unique_ptr<Command>& command : commands_) commands.push_back(command.get());
  return commands;
}

Command* Command::given_command() const {
  const std::vector<CLI::App*> parsed = app_->get_subcommands();
  for (const std::unique_ptr<Command>& command : commands_) {
    if (!parsed.empty() && command->app_ == parsed.front()) return command.get();
  }
  return nullptr;
}

/// Returns a message about missing required options; empty if none is missing.
std::string Command::missing_options_message() const {
  for (const std::unique_ptr<Option>& option : options_) {
    const std::string name = option->get_name();
    if (option->required_ && option->count() == 0) {
      return name + " is required: " + option->get_help();
    }
    if (option->count() == 0) continue;
    for (const Option* other : option->needs_) {
      if (other->count() != 0) continue;
      return name + " needs " + other->get_name() + ": add it, or leave " + name + " out";
    }
    for (const Option* other : option->excludes_) {
      if (other->count() == 0) continue;
      return name + " and " + other->get_name() + " exclude each other: leave one of them out";
    }
  }
  return {};
}

/// If a flag with an optional value is followed by a word that is one of its values, joins both with `=`.
void Command::join_choices(std::vector<std::string>& words) const {
  const auto has_name = [&](const auto& command) {
    return !words.empty() && command->get_name() == words.front();
  };
  const auto command = std::find_if(commands_.begin(), commands_.end(), has_name);
  if (command == commands_.end()) return;
  for (std::size_t i = 1; i + 1 < words.size(); ++i) {
    const Option* const option =
        words[i].starts_with("--") ? (*command)->find_option(words[i]) : nullptr;
    if (option == nullptr || !option->is_flag()) continue;
    const std::vector<std::string>& choices = option->value_names_;
    if (std::find(choices.begin(), choices.end(), words[i + 1]) == choices.end()) continue;
    words[i] += "=" + words[i + 1];
    words.erase(words.begin() + static_cast<std::ptrdiff_t>(i) + 1);
  }
}

bool Command::parse(std::vector<std::string> words) {
  const std::string last = words.empty() ? "" : words.back();
  join_choices(words);
  std::reverse(words.begin(), words.end());  // CLI11 takes words from the end of the list
  try {
    app_->parse(words);
  } catch (const CLI::ArgumentMismatch&) {
    // Each option takes one value, so only the last word can lack its value.
    throw UsageError(last + " has no value: give one");
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      app_->exit(error);
      return false;
    }
    const Command* const command = given_command();
    if (command == nullptr) {
      throw UsageError("a command is missing, such as kiln bake HIGH LOW --out DIR");
    }
    const std::string missing = command->missing_options_message();
    throw UsageError(missing.empty() ? error.what() : missing);
  }
  return true;
}

std::vector<std::string> Command::unaccepted_words() const { return app_->remaining(true); }

}  // namespace kiln::cli
