#include "drivers/sinks/view/view_request.hpp"

#include <cmath>

#include "drivers/parsed_number.hpp"

namespace merkel {
namespace {

constexpr double kMaxSession_s = 1e7;

/// Removes the next word from a text and returns it.
std::string_view take_word(std::string_view& text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  const std::string_view word = text.substr(0, text.find(' '));
  text.remove_prefix(word.size());
  return word;
}

std::optional<ViewRequest> watch(std::string_view words) {
  ViewRequest request{.kind = ViewRequest::Kind::kWatch};
  for (auto word = take_word(words); !word.empty(); word = take_word(words)) {
    const auto neuron = parsed_number<std::uint32_t>(word);
    if (!neuron || request.neurons.size() == ViewRequest::kMaxWatched) return std::nullopt;
    request.neurons.push_back(*neuron);
  }
  return request;
}

/// A label on one line: control characters become spaces.
std::optional<ViewRequest> mark(std::string_view words) {
  if (words.starts_with(' ')) words.remove_prefix(1);
  if (words.empty() || words.size() > ViewRequest::kMaxLabel) return std::nullopt;
  ViewRequest request{.kind = ViewRequest::Kind::kMark, .label = std::string(words)};
  for (char& c : request.label) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) c = ' ';
  }
  return request;
}

}  // namespace

std::optional<ViewRequest> ViewRequest::parse(std::string_view text) {
  const std::string_view verb = take_word(text);
  if (verb == "watch") return watch(text);
  if (verb == "mark") return mark(text);
  const std::string_view word = take_word(text);
  if (!take_word(text).empty()) return std::nullopt;
  if (verb == "tare") {
    const auto probe =
        word == "all" ? std::optional(kAllProbes) : parsed_number<std::uint32_t>(word);
    if (!probe) return std::nullopt;
    return ViewRequest{.kind = Kind::kTare, .probe = *probe};
  }
  if (verb == "record" && word == "start") return ViewRequest{.kind = Kind::kRecordStart};
  if (verb == "record" && word == "stop") return ViewRequest{.kind = Kind::kRecordStop};
  if (verb == "seek") {
    const auto time_s = parsed_number<double>(word);
    if (!time_s || !(*time_s >= 0.0 && *time_s <= kMaxSession_s)) return std::nullopt;
    return ViewRequest{.kind = Kind::kSeek, .time_s = *time_s};
  }
  if (verb == "stop" && word.empty()) return ViewRequest{.kind = Kind::kStop};
  if (verb == "start" && word.empty()) return ViewRequest{.kind = Kind::kStart};
  if (verb == "pause" && word.empty()) return ViewRequest{.kind = Kind::kPause};
  if (verb == "play" && word.empty()) return ViewRequest{.kind = Kind::kPlay};
  return std::nullopt;
}

}  // namespace merkel
