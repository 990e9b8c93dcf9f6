#include "drivers/uri.hpp"

#include <cmath>
#include <vector>

#include "core/parameters/nearest_name.hpp"
#include "core/parameters/parameter_error.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
Expected<Uri, SetupError> Uri::parse(std::string_view text) {
  Uri uri;
  uri.text = text;
  const auto colon = text.find(':');
  if (colon == std::string_view::npos || colon == 0) {
    return bad_input("\"" + uri.text +
                     "\" is not a URI: write scheme:name, for example replay:trace.csv or "
                     "csv:spikes.csv");
  }
  uri.scheme = text.substr(0, colon);
  const std::string_view rest = text.substr(colon + 1);
  const auto question = rest.rfind('?');
  uri.path = rest.substr(0, question);
  if (question == std::string_view::npos) return uri;

  std::string_view options = rest.substr(question + 1);
  while (!options.empty()) {
    const std::string_view option = take_part(options, '&');
    const auto equals = option.find('=');
    if (equals == std::string_view::npos || equals == 0) {
      return bad_input("\"" + uri.text + "\": the option \"" + std::string(option) +
                       "\" must be written name=value");
    }
    const auto [position, added] =
        uri.options.emplace(option.substr(0, equals), option.substr(equals + 1));
    if (!added) {
      return bad_input("\"" + uri.text + "\": the option " + position->first +
                       " appears twice: keep one");
    }
  }
  return uri;
}

const std::string* UriOptions::find(std::string_view key) {
  known_.emplace(key);
  const auto found = uri_.options.find(key);
  return found == uri_.options.end() ? nullptr : &found->second;
}

void UriOptions::fail(std::string_view key, std::string_view expectation) {
  if (!error_.empty()) return;
  error_ = "\"" + uri_.text + "\": the option " + std::string(key) + " must be " +
           std::string(expectation);
}

double UriOptions::number(std::string_view key, double fallback, double low, double high) {
  const std::string* text = find(key);
  if (text == nullptr) return fallback;
  const auto number = parsed_number<double>(*text);
  if (!number || !(*number >= low && *number <= high)) {
    fail(key, "a number from " + shortest_decimal(low) + " to " + shortest_decimal(high) +
                  ", but is \"" + *text + "\"");
    return fallback;
  }
  return *number;
}

std::int64_t UriOptions::whole(std::string_view key, std::int64_t fallback, std::int64_t low,
                               std::int64_t high) {
  const std::string* text = find(key);
  if (text == nullptr) return fallback;
  const auto number = parsed_number<std::int64_t>(*text);
  if (!number || *number < low || *number > high) {
    fail(key, "a whole number from " + std::to_string(low) + " to " + std::to_string(high) +
                  ", but is \"" + *text + "\"");
    return fallback;
  }
  return *number;
}

std::string UriOptions::text(std::string_view key, std::string_view fallback) {
  const std::string* text = find(key);
  return text == nullptr ? std::string(fallback) : *text;
}

std::string UriOptions::word(std::string_view key, std::string_view fallback,
                             std::string_view words) {
  const std::string* text = find(key);
  if (text == nullptr) return std::string(fallback);
  const std::string bounded = "|" + std::string(words) + "|";
  if (text->empty() || bounded.find("|" + *text + "|") == std::string::npos) {
    fail(key, "one of " + std::string(words) + ", but is \"" + *text + "\"");
    return std::string(fallback);
  }
  return *text;
}

Expected<void, SetupError> UriOptions::finish() const {
  if (!error_.empty()) return bad_input(error_);
  std::vector<std::string> names;
  names.assign(known_.begin(), known_.end());
  for (const auto& [name, value] : uri_.options) {
    if (known_.contains(name)) continue;
    return bad_input("\"" + uri_.text + "\": the option " + name + " is unknown" +
                     did_you_mean(name, names,
                                  names.empty() ? "; there are none"
                                                : "; the known ones are: " + listed(names)));
  }
  return {};
}

}  // namespace merkel
