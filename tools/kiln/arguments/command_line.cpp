#include "arguments/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <optional>
#include <utility>

#include "arguments/near_words.h"

namespace kiln::cli {

Check::Check(const std::function<std::string(std::string&)>& function, std::string_view words)
    : validator_(std::make_shared<CLI::Validator>(function, std::string(words))) {}
Check::Check(const CLI::Validator& validator)
    : validator_(std::make_shared<CLI::Validator>(validator)) {}

std::string Check::operator()(std::string& value) const { return (*validator_)(value); }
std::string Check::words() const { return validator_->get_description(); }

Check range(double low, double high) {
  // CLI::Range writes both with six decimals, and lets nan through.
  const auto text = [](double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%g", value);
    return std::string(digits);
  };
  return {[=](std::string& value) -> std::string {
            double number = 0;
            if (CLI::detail::lexical_cast(value, number) && number >= low && number <= high)
              return {};
            return "Value " + value + " not in range " + text(low) + " to " + text(high);
          },
          "FLOAT in [" + text(low) + " - " + text(high) + "]"};
}
Check range(int low, int high) { return Check(CLI::Range(low, high)); }
Check range(unsigned low, unsigned high) { return Check(CLI::Range(low, high)); }
Check positive_number() { return Check(CLI::PositiveNumber); }
Check one_of(const std::vector<std::string>& names) {
  std::string words = "{";
  for (const std::string& name : names) words += (words.size() == 1 ? "" : ",") + name;
  return {[names](std::string& value) -> std::string {
            const std::size_t first = value.find_first_not_of(' ');
            if (first != value.npos) {
              value = value.substr(first, value.find_last_not_of(' ') + 1 - first);
            }
            for (const std::string& name : names) {
              if (CLI::detail::to_lower(name) != CLI::detail::to_lower(value)) continue;
              value = name;
              return {};
            }
            return not_one_of(value, names);
          },
          words + "}"};
}

Option* Option::check(const Check& check) {
  option_->transform(*check.validator_);  // may change the value, which check() must not
  return this;
}
Option* Option::group(std::string_view name) {
  option_->group(std::string(name));
  return this;
}
Option* Option::capture_default_str() {
  option_->capture_default_str();
  return this;
}
Option* Option::required() {
  option_->required();
  return this;
}
Option* Option::allow_extra_args(bool allow) {
  option_->allow_extra_args(allow);
  return this;
}
Option* Option::delimiter(char between) {
  option_->delimiter(between);
  return this;
}
Option* Option::needs(const Option* other) {
  option_->needs(other->option_);
  return this;
}
Option* Option::excludes(const Option* other) {
  option_->excludes(other->option_);
  return this;
}
Option* Option::type_name(std::string_view words) {
  option_->type_name(std::string(words));
  return this;
}
Option* Option::each(const std::function<void(std::string)>& function) {
  option_->each(function);
  return this;
}

std::string Option::get_name() const { return option_->get_name(); }
const std::vector<std::string>& Option::get_lnames() const { return option_->get_lnames(); }
std::string Option::get_help() const { return option_->get_description(); }
std::size_t Option::count() const { return option_->count(); }
const std::vector<std::string>& Option::results() const { return option_->results(); }
bool Option::is_flag() const { return option_->get_expected_max() == 0; }

Command::Command(std::string_view description, std::string_view name, const std::string& version,
                 const std::string& footer)
    : owned_(std::make_unique<CLI::App>(std::string(description), std::string(name))),
      app_(owned_.get()) {
  app_->set_version_flag("--version", version);
  app_->require_subcommand(1);
  app_->footer(footer);
}
Command::Command(CLI::App* app) : app_(app) {}
Command::~Command() = default;

template <typename Value>
Option* Command::add_option(std::string_view name, Value& value, std::string_view help) {
  return wrapped(app_->add_option(std::string(name), value, std::string(help)));
}
template Option* Command::add_option(std::string_view, std::string&, std::string_view);
template Option* Command::add_option(std::string_view, double&, std::string_view);
template Option* Command::add_option(std::string_view, std::int64_t&, std::string_view);
template Option* Command::add_option(std::string_view, std::uint32_t&, std::string_view);
template Option* Command::add_option(std::string_view, std::optional<double>&, std::string_view);
template Option* Command::add_option(std::string_view, std::optional<std::uint32_t>&,
                                     std::string_view);
template Option* Command::add_option(std::string_view, std::vector<std::string>&, std::string_view);

Option* Command::add_flag(std::string_view name, bool& value, std::string_view help) {
  return wrapped(app_->add_flag(std::string(name), value, std::string(help)));
}
Option* Command::add_flag(std::string_view name, std::string& value, std::string_view help) {
  return wrapped(app_->add_flag(std::string(name), value, std::string(help)));
}
Option* Command::add_checked_option(std::string_view name, const Check& check,
                                    std::string_view help) {
  const std::function<void(const std::string&)> nothing = [](const std::string&) {};
  return wrapped(app_->add_option_function(std::string(name), nothing, std::string(help)))
      ->check(check);
}
void Command::remove_option(Option* option) { app_->remove_option(option->option_); }

std::string Command::get_name() const { return app_->get_name(); }

std::vector<Option*> Command::get_options() {
  std::vector<Option*> options;
  for (CLI::Option* option : app_->get_options()) options.push_back(wrapped(option));
  return options;
}
std::vector<const Option*> Command::get_options() const {
  std::vector<const Option*> options;
  for (CLI::Option* option : app_->get_options()) options.push_back(wrapped(option));
  return options;
}
const Option* Command::find_option(const std::string& name) const {
  CLI::Option* option = app_->get_option_no_throw(name);
  return option == nullptr ? nullptr : wrapped(option);
}

/// The one of ours that stands for an option. One that was removed stands for what has its place.
Option* Command::wrapped(CLI::Option* option) const {
  for (const std::unique_ptr<Option>& known : options_) {
    if (known->option_ == option) return known.get();
  }
  return options_.emplace_back(std::make_unique<Option>(option)).get();
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

Command* Command::chosen() const {
  const std::vector<CLI::App*> parsed = app_->get_subcommands();
  for (const std::unique_ptr<Command>& command : commands_) {
    if (!parsed.empty() && command->app_ == parsed.front()) return command.get();
  }
  return nullptr;
}

namespace {

/// In plain words what the parser says in its own.
std::string in_words(const CLI::ParseError& error) {
  std::string text = error.what();
  const auto after = [&](std::string_view words) {
    const std::size_t at = text.find(words);
    return at == text.npos ? at : at + words.size();
  };
  if (const std::size_t at = after(": At Most 1 required but received "); at != text.npos) {
    return text.substr(0, text.find(": At Most")) + " was given " + text.substr(at) +
           " times: give it once";
  }
  if (const std::size_t at = after("Could not convert: "); at != text.npos) {
    const std::size_t sign = text.find(" = ", at);
    if (sign != text.npos) {
      return text.substr(at, sign - at) + " is '" + text.substr(sign + 3) + "': give a number";
    }
  }
  const std::size_t value = after(": Value "), bounds = after(" not in range ");
  if (value != text.npos && bounds != text.npos) {
    return text.substr(0, text.find(": Value ")) + " is '" +
           text.substr(value, text.find(" not in range ") - value) + "': give " +
           text.substr(bounds);
  }
  if (text.ends_with(" missing") && after(": 1 required ") != text.npos) {
    return text.substr(0, text.find(": 1 required ")) + " was given nothing: give a value";
  }
  if (text == "A subcommand is required")
    return "a command is missing, such as kiln bake HIGH LOW --out DIR";
  return text;
}

}  // namespace

bool Command::parse(std::vector<std::string> words) {
  std::reverse(words.begin(), words.end());  // as CLI11 wants them
  try {
    app_->parse(words);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw UsageError(in_words(error));
    app_->exit(error);
    return false;
  }
  return true;
}

std::vector<std::string> Command::not_understood() const { return app_->remaining(true); }

}  // namespace kiln::cli
