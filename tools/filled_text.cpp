#include "tools/filled_text.hpp"

#include <algorithm>
#include <vector>

#include <fmt/core.h>

#include "drivers/files/embedded_text.hpp"
#include "tools/number_text.hpp"

namespace merkel {

extern const std::span<const EmbeddedText> kReportTexts;  ///< tools/texts/*.txt
namespace {

/// A part of `text` up to a mark, both of which are removed from it.
std::string_view taken(std::string_view& text, std::string_view marks) {
  const std::size_t end = std::min(text.find_first_of(marks), text.size());
  const std::string_view part = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return part;
}

bool is_something(const Json& value) {
  if (value.is_string()) return value != "";
  return !value.empty() && value != false && value != 0;
}

std::string formatted(const Json& value, const std::string& format) {
  if (value.is_null()) return formatted("-", format.substr(0, format.find('.')));
  if (format.starts_with('~')) return number_text(value.get<double>(), std::stoi(format.substr(1)));
  const auto pattern = fmt::runtime("{:" + format + "}");
  if (value.is_string()) return fmt::format(pattern, value.get_ref<const std::string&>());
  if (value.is_number_float() || format.find_first_of("fg") != std::string::npos) {
    return fmt::format(pattern, value.get<double>());
  }
  return fmt::format(pattern, value.get<std::int64_t>());
}

class Filling {
 public:
  explicit Filling(const Json& facts) : scopes_{{&facts, 0}} {}

  std::string file(std::string_view name) {
    const auto file = std::find_if(kReportTexts.begin(), kReportTexts.end(), [&](const auto& each) {
      return each.name == std::string(name) + ".txt";
    });
    std::string_view text = file->text;
    return part(text);
  }

 private:
  struct Scope {
    const Json* value;
    std::size_t number;
  };

  /// Fills a text up to its end or to the end of a section, and removes that from it.
  std::string part(std::string_view& text) {
    std::string filled;
    while (!text.empty()) {
      const std::size_t mark = std::min(text.find_first_of("<{>"), text.size());
      filled += text.substr(0, mark);
      if (mark == text.size()) break;
      const char kind = text[mark];
      text.remove_prefix(mark + 1);
      if (kind == '>') return filled;
      filled += kind == '{' ? field(taken(text, "}")) : section(text);
    }
    return filled;
  }

  std::string section(std::string_view& text) {
    const std::string_view condition = taken(text, "?*");
    const bool each = *(text.data() - 1) == '*';
    const Json& value = value_at(condition);
    std::string filled;
    if (each ? !is_something(value) : !holds(condition)) {
      skip_section(text);
      return filled;
    }
    const std::string_view body = text;
    const bool array = each && value.is_array();
    for (std::size_t i = 0; i < (array ? value.size() : 1); ++i) {
      text = body;
      if (each) scopes_.push_back({array ? &value[i] : &value, i + 1});
      filled += part(text);
      if (each) scopes_.pop_back();
    }
    return filled;
  }

  static void skip_section(std::string_view& text) {
    for (int open = 1; open > 0 && !text.empty();) {
      taken(text, "<{>");
      const char mark = *(text.data() - 1);
      if (mark == '{') {
        taken(text, "}");
      } else {
        open += mark == '<' ? 1 : -1;
      }
    }
  }

  std::string field(std::string_view name) {
    if (name == "@") return std::to_string(scopes_.back().number);
    if (name.starts_with('>')) {
      name.remove_prefix(1);
      const std::string_view text = taken(name, " ");
      const std::string all = name.empty() ? file(text) : Filling(value_at(name)).file(text);
      return all.substr(0, all.find_last_not_of('\n') + 1);
    }
    if (const auto noun = name.find('#'); noun != name.npos) {
      const auto count = value_at(name.substr(0, noun)).get<std::uint64_t>();
      std::string_view many = name.substr(noun + 1);
      const std::string_view one = taken(many, "|");
      return many.empty() ? counted(count, one)
                          : fmt::format("{} {}", count, count == 1 ? one : many);
    }
    const std::string_view path = taken(name, ":");
    return formatted(value_at(path), std::string(name));
  }

  [[nodiscard]] const Json& value_at(std::string_view path) const {
    static const Json kNull;
    if (path.empty()) return *scopes_.back().value;
    const Json::json_pointer pointer("/" + std::string(path));
    const auto scope = std::find_if(scopes_.rbegin(), scopes_.rend(), [&](const Scope& each) {
      return each.value->contains(pointer);
    });
    return scope == scopes_.rend() ? kNull : scope->value->at(pointer);
  }

  [[nodiscard]] bool holds(std::string_view condition) const {
    while (!condition.empty()) {
      std::string_view term = taken(condition, "|");
      const bool inverse = term.starts_with('!');
      if (inverse) term.remove_prefix(1);
      const bool present = term.starts_with('+');
      if (present) term.remove_prefix(1);
      const Json& value = value_at(taken(term, "="));
      const bool holds = !term.empty() ? formatted(value, "") == term
                         : present     ? !value.is_null()
                                       : is_something(value);
      if (holds != inverse) return true;
    }
    return false;
  }

  std::vector<Scope> scopes_;  ///< innermost last
};

}  // namespace

std::string filled_page(std::string_view name, const Json& facts) {
  return Filling(facts).file(name);
}

std::string filled_text(std::string_view name, const Json& facts) {
  const std::string filled = filled_page(name, facts);
  std::string lines;
  for (std::string_view rest = filled; !rest.empty();) {
    const std::string_view line = taken(rest, "\n");
    if (!line.empty()) lines.append(line) += '\n';
  }
  return lines;
}

}  // namespace merkel
