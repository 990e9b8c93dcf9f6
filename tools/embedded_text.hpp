#pragma once

#include <span>
#include <string_view>

namespace merkel {

/// A file of the sources that is a part of the program (tools/cmake/embed_texts.cmake).
struct EmbeddedText {
  std::string_view name;  ///< of the file, without its folder
  std::string_view text;
};

extern const std::span<const EmbeddedText> kPlotScripts;   ///< tools/plots/*.py
extern const std::span<const EmbeddedText> kGoldenSpikes;  ///< tests/golden/PRESET.taps.csv

}  // namespace merkel
