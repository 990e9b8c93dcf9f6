#include "tools/connect/hand_scene.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numeric>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/core.h>

#include "tools/scene/scene_keys.hpp"

namespace merkel {
namespace {

constexpr double kAtRest_N = 0.1;  ///< a device that measures less is not pressed
constexpr double kRounding_N = 1e-9;

/// The patches of the preset hand, each with the names that devices use for it.
struct HandPatch {
  std::string_view name;
  std::array<std::string_view, 3> words;
};
constexpr std::array<HandPatch, 6> kHandPatches = {{{"thumb", {"thumb", "daumen", "pollex"}},
                                                    {"index", {"index", "pointer", "index"}},
                                                    {"middle", {"middle", "mid", "middle"}},
                                                    {"ring", {"ring", "ring", "ring"}},
                                                    {"little", {"little", "pinky", "pinkie"}},
                                                    {"palm", {"palm", "hand", "palm"}}}};

/// The words of a name in lower case, without "finger" and "tip" at their end. They are split at
/// whatever is no letter and where the case changes: "RHThumbtip2" has "rh" and "thumb".
std::vector<std::string> words_of(std::string_view name) {
  const auto is = [&](int (*kind)(int), std::size_t i) {
    return i < name.size() && kind(static_cast<unsigned char>(name[i])) != 0;
  };
  std::vector<std::string> words;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (!is(std::isalpha, i)) continue;
    const bool follows = i > 0 && is(std::isalpha, i - 1);
    const bool capital =
        is(std::isupper, i) && (is(std::islower, i - 1) || is(std::islower, i + 1));
    if (!follows || capital) words.emplace_back();
    words.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(name[i])));
  }
  for (std::string& word : words) {
    for (const std::string_view end : {"tip", "finger"}) {
      if (word.ends_with(end)) word.resize(word.size() - end.size());
    }
  }
  return words;
}

/// The patch that a channel names; empty: none.
std::string_view patch_named(const std::string& channel) {
  const auto words = words_of(std::string_view(channel).substr(0, channel.rfind('_')));
  for (const HandPatch& patch : kHandPatches) {
    if (std::ranges::find_first_of(words, patch.words) != words.end()) return patch.name;
  }
  return {};
}

}  // namespace

std::vector<PlacedChannel> place_on_hand(const std::vector<FoundChannel>& channels) {
  const bool force = std::any_of(channels.begin(), channels.end(),
                                 [](const FoundChannel& channel) { return channel.is_force(); });
  std::vector<PlacedChannel> placed;
  std::vector<PlacedChannel> in_order;
  for (const FoundChannel& channel : channels) {
    if (channel.is_force() != force) continue;
    if (const auto patch = patch_named(channel.name); !patch.empty()) {
      placed.push_back({.channel = channel, .patch = std::string(patch)});
    }
    if (in_order.size() == kHandPatches.size()) continue;
    in_order.push_back({.channel = channel,
                        .patch = std::string(kHandPatches[in_order.size()].name),
                        .by_name = false});
  }
  return placed.empty() ? in_order : placed;
}

std::optional<double> noise_at_rest(const std::vector<double>& values) {
  constexpr std::size_t kParts = 10;
  constexpr std::size_t kMin = 10;  ///< values in a part
  const std::size_t size = std::max(kMin, values.size() / kParts);
  std::vector<double> noises;
  for (auto part = std::span(values); part.size() >= size; part = part.subspan(size)) {
    const auto head = part.first(size);
    const auto count = static_cast<double>(size);
    const double mean = std::accumulate(head.begin(), head.end(), 0.0) / count;
    double sum = 0.0;
    for (const double value : head) sum += (value - mean) * (value - mean);
    const double noise = std::sqrt(sum / count);
    if (std::fabs(mean) <= kAtRest_N && noise <= 0.1 * kAtRest_N) noises.push_back(noise);
  }
  if (noises.empty()) return std::nullopt;
  const auto middle = noises.begin() + static_cast<std::ptrdiff_t>(noises.size() / 2);
  std::nth_element(noises.begin(), middle, noises.end());
  return *middle;
}

std::string contact_line(const FoundChannel& channel) {
  if (!channel.noise || *channel.noise <= kRounding_N) return {};
  const bool force = channel.is_force();
  if (!force && !channel.name.ends_with("_mm")) return {};
  return fmt::format(
             "contact_{0} = {1:.2g}  # six times the noise of {2:.2g} {0} that was measured\n",
             force ? "N" : "mm", 6.0 * *channel.noise, *channel.noise) +
         (force ? "zero = \"track\"  # follows the drift of the sensor\n" : "");
}

std::string hand_scene_text(const std::string& uri, const std::vector<PlacedChannel>& placed,
                            const std::vector<std::string>& lacking) {
  std::string text =
      "# Written by merkel connect.\npreset = \"hand\"  # a patch for each finger, and the palm\n\n"
      "[[device]]\nname = \"hand\"\nuri = " +
      toml_string(uri) + "\n";
  for (const std::string& line : lacking) text += "# missing: " + line + "\n";
  for (const PlacedChannel& each : placed) {
    text += "\n[[probe]]\ndevice = \"hand\"\n" +
            std::string(each.channel.is_force() ? "force" : "depth") + " = " +
            toml_string(each.channel.name) + "\npatch = " + toml_string(each.patch) +
            (each.by_name ? "" : "  # by its place in the line: set the patch that it presses") +
            "\ntip = \"sphere\"\nradius_mm = 2.0  # set the radius of your probe's tip\n" +
            contact_line(each.channel);
  }
  return text;
}

}  // namespace merkel
